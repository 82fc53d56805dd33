"""Kinds of values that options of the commands take; what is none ends in one line and code 2."""

from __future__ import annotations

import argparse
import math

_LARGEST = 2**63 - 1
_DIGITS = 19  # of a number in that


def whole(least: int, most: int = _LARGEST, noun: str = "") -> WholeNumber:
    """Return a kind of value: whole numbers from ``least`` to ``most``; ``noun`` is one of them."""
    return WholeNumber(least, most, noun)


class WholeNumber:
    """Reads a whole number within limits, for ``add_argument(type=...)``."""

    def __init__(self, least: int, most: int, noun: str = "") -> None:
        self.least, self.most = least, most
        self.noun = f" {noun}" if noun else ""

    def __call__(self, text: str) -> int:
        """Return the number that a text says."""
        try:
            value = int(text) if len(text.strip().lstrip("+-").lstrip("0")) <= _DIGITS else None
        except ValueError:
            value = None
        if value is None or not self.least <= value <= self.most:
            limits = f"from {self.least} to {self.most}"
            if self.most == _LARGEST and not _is_huge(text):
                limits = f"at least {self.least}{self.noun}"
            raise argparse.ArgumentTypeError(f"must be {limits}, not {text[:40]}")
        return value


def _is_huge(text: str) -> bool:
    return text.strip().removeprefix("+").isdecimal() and len(text) >= _DIGITS


count = whole(1)
seed = whole(0, 2**32 - 1)
port = whole(0, 65535)


def positive(text: str) -> float:
    """Return the positive finite number that a text says."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"must be positive, not {text[:40]}")
    return value


def pace(text: str) -> float:
    """Return a speed: a positive number, or inf for as fast as can be."""
    return math.inf if text.strip().lower() == "inf" else positive(text)


def primitive_key(text: str) -> int | str:
    """Return the id or name of a primitive: digits are an id."""
    return int(text) if text.isdecimal() and len(text) <= _DIGITS else text

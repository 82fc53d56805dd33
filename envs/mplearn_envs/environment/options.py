"""Checks of an environment's options: a wrong one is named with what is allowed."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Real
from typing import Any

import numpy as np

from mplearn.errors import InvalidValueError

_NUMBERS: dict[str, tuple[float, float, str]] = {
    "max_steps": (1, np.inf, "an integer from 1"),
    "hold_s": (0.05, 60.0, "in [0.05, 60] s"),
    "discount": (1e-9, 1.0, "in (0, 1]"),
    "illegal_penalty": (-1e9, 1e9, "finite"),
    "novel_penalty": (-1e9, 1e9, "finite, or None"),
    "frame_rate_hz": (1e-3, 250.0, "in (0, 250] 1/s"),
    "width": (1, 16384, "an integer from 1"),
    "height": (1, 16384, "an integer from 1"),
}
_INTEGERS = ("max_steps", "width", "height")
_WORDS: dict[str, tuple[object, ...]] = {
    "illegal": ("hold", "raise"),
    "render_mode": (None, "human", "rgb_array"),
    "draw_balance": (False, True),
    "dynamics": ("simulated", "kinematic"),
    "flat": (False, True),
}


def require_options(given: Mapping[str, Any]) -> None:
    """Check options by their names; those that are not known here are let pass.

    Raises:
        InvalidValueError: A value is not allowed.
    """
    for name, value in given.items():
        if name in _WORDS:
            allowed = _WORDS[name]
            if not isinstance(value, (str, bool, type(None))) or value not in allowed:
                raise InvalidValueError(f"{name} must be one of {allowed}, not {value!r}")
        elif name in _NUMBERS and not (name == "novel_penalty" and value is None):
            low, high, meaning = _NUMBERS[name]
            number = isinstance(value, (Real, np.number)) and not isinstance(value, bool)
            whole = name not in _INTEGERS or isinstance(value, (int, np.integer))
            if not (number and whole and low <= float(value) <= high):
                raise InvalidValueError(f"{name} must be {meaning}, not {value!r}")

"""What a caller gives where something of another kind is wanted: told as an error of ours."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path

from .errors import InvalidValueError


def require_number(name: str, value: object) -> None:
    """Refuse what is no number; its range is for the caller to check.

    Args:
        name: What it is called.
        value: What was given.

    Raises:
        InvalidValueError: It is none.

    Example:
        >>> require_number("rate_hz", 100)
        >>> require_number("rate_hz", "100")
        Traceback (most recent call last):
        mplearn.errors.InvalidValueError: rate_hz must be a number, not '100'
    """
    try:
        if not isinstance(value, str | bytes):
            float(value)  # type: ignore[arg-type]
            return
    except (TypeError, ValueError, OverflowError):
        pass
    raise InvalidValueError(f"{name} must be a number, not {value!r:.60}")


def require_numbers(settings: object) -> None:
    """Refuse settings that hold something else where a number is usual.

    Args:
        settings: A dataclass.

    Raises:
        InvalidValueError: A field whose default is a number holds none.
    """
    for each in fields(settings):  # type: ignore[arg-type]
        if isinstance(each.default, int | float) and not isinstance(each.default, bool):
            require_number(each.name, getattr(settings, each.name))


def require_kind(name: str, value: object, kind: type, hint: str = "") -> None:
    """Refuse what is of another class.

    Args:
        name: What it is called.
        value: What was given.
        kind: Class that it must be of.
        hint: What to do instead.

    Raises:
        InvalidValueError: It is of another class.

    Example:
        >>> require_kind("path", "life.db", str)
        >>> require_kind("config", "life.db", dict)
        Traceback (most recent call last):
        mplearn.errors.InvalidValueError: config must be a dict, not 'life.db'
    """
    if not isinstance(value, kind):
        then = f": {hint}" if hint else ""
        raise InvalidValueError(f"{name} must be a {kind.__name__}, not {value!r:.60}{then}")


def is_one_of(value: object, choices: tuple[object, ...]) -> bool:
    """Whether a value is one of a few; an array, which is compared place by place, is none.

    Example:
        >>> import numpy as np
        >>> is_one_of("robot", ("robot", "markers")), is_one_of(np.zeros(2), (True, False))
        (True, False)
    """
    try:
        return value in choices
    except ValueError:
        return False


def path_of(name: str, value: object) -> Path:
    """Return the path of a file.

    Args:
        name: What it is called.
        value: What was given.

    Raises:
        InvalidValueError: It is none.

    Example:
        >>> path_of("store", "life.db").name
        'life.db'
        >>> path_of("store", None)
        Traceback (most recent call last):
        mplearn.errors.InvalidValueError: store must be the path of a file, not None
    """
    if isinstance(value, str | os.PathLike):
        path = os.fspath(value)
        if isinstance(path, str) and path and "\0" not in path:
            return Path(path)
    raise InvalidValueError(f"{name} must be the path of a file, not {value!r:.60}")


def names_of(name: str, value: object) -> tuple[str, ...]:
    """Return names, of which one text is none.

    Args:
        name: What they are called.
        value: What was given.

    Raises:
        InvalidValueError: It holds something else.

    Example:
        >>> names_of("channels", ["hip", "knee"])
        ('hip', 'knee')
        >>> names_of("channels", "hip")
        Traceback (most recent call last):
        mplearn.errors.InvalidValueError: channels must be several names, not 'hip'
    """
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        names = tuple(value)
        if all(isinstance(each, str) for each in names):
            return names
    raise InvalidValueError(f"{name} must be several names, not {value!r:.60}")

"""Numbers as tools write them into BVH files: glued together, or not at all."""

from __future__ import annotations

import re

import numpy as np

from ...numbers import plain_number

_UNSIGNED = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eEdD][-+]?\d+)?"  # in one way only: no backtracking
_NUMBER = re.compile(rf"[-+]?{_UNSIGNED}")
_GLUED = re.compile(rf"[-+]?{_UNSIGNED}(?:[-+]{_UNSIGNED})+")
_MISSING = re.compile(
    r"[-+]?(?:nan(?:\(.*\))?|\d+\.?#(?:qnan|ind|snan)\d*|inf(?:inity)?|null|none)", re.IGNORECASE
)
_LONGEST = 400  # characters of a cell; no number has more digits


def split_glued(cell: str) -> list[str]:
    """Return the numbers of a cell in which a sign may stand for a blank, or the cell itself.

    Example:
        >>> split_glued("1.5-2.0e-3-4")
        ['1.5', '-2.0e-3', '-4']
        >>> split_glued("one")
        ['one']
    """
    if len(cell) <= _LONGEST and _GLUED.fullmatch(cell):
        return _NUMBER.findall(cell)
    return [cell]


def missing_or_number(cell: str) -> float | None:
    """Return the number that a cell holds, NaN where it says that there is none, else None.

    Example:
        >>> missing_or_number("-1.#IND00"), missing_or_number("2e1"), missing_or_number("2_0")
        (nan, 20.0, None)
    """
    if len(cell) > _LONGEST:
        return None
    cell = plain_number(cell)
    if _MISSING.fullmatch(cell):
        return np.nan
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None

"""Arrays that many share, and nobody can change."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

_Scalar = TypeVar("_Scalar", bound=np.generic)


def read_only(values: np.ndarray[Any, np.dtype[_Scalar]]) -> np.ndarray[Any, np.dtype[_Scalar]]:
    """Return a view of an array that refuses to be changed.

    Compiled loops take it for another type of array than one that may be changed, and would be
    compiled once more: give them a copy, or the array itself.

    Example:
        >>> shared = read_only(np.arange(3))
        >>> shared[0] = 7
        Traceback (most recent call last):
        ValueError: assignment destination is read-only
    """
    view = values.view()
    view.flags.writeable = False
    return view

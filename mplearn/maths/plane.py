"""Angles and points in the plane of the floor, x ahead and y to the left.

Like `quaternions`, for numbers in kernels and for whole arrays in Python; angles are radians.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import register_jitable

from .quaternions import Numbers


@register_jitable
def turn_in_plane(x: Numbers, y: Numbers, yaw: Numbers) -> tuple[Any, Any]:
    """Return a vector (x, y) turned by yaw; ``-yaw`` gives it as seen from axes turned so.

    Example:
        >>> x, y = turn_in_plane(2.0, 1.0, np.pi / 2)
        >>> float(x.round(9)), float(y.round(9))
        (-1.0, 2.0)
    """
    c, s = np.cos(yaw), np.sin(yaw)
    return c * x - s * y, s * x + c * y


@register_jitable
def wrap_angle(angle: Numbers) -> Any:
    """Return the same angle in [-pi, pi].

    Example:
        >>> float(wrap_angle(np.radians(350.0)) / np.pi * 180)
        -10.0...
    """
    return np.arctan2(np.sin(angle), np.cos(angle))

"""Quaternions (w, x, y, z) by their components: numbers in kernels, whole arrays in Python.

Each function is compiled where a kernel calls it, and is numpy where Python does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numba.extending import register_jitable

from ..recording import FloatArray

Numbers: TypeAlias = float | FloatArray
Quaternion: TypeAlias = Sequence[Any] | FloatArray
"""Four components w, x, y, z: numbers, or arrays of one shape."""


@register_jitable
def quaternion_product(p: Quaternion, q: Quaternion) -> tuple[Any, Any, Any, Any]:
    """Return p q, which turns by q first and by p then.

    Example:
        >>> i, j = (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)
        >>> quaternion_product(i, j)
        (0.0, 0.0, 0.0, 1.0)
    """
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@register_jitable
def vector_quaternion(x: float, y: float, z: float) -> tuple[Any, Any, Any, Any]:
    """Return the unit quaternion of a rotation vector [rad], of numbers only.

    Example:
        >>> w, x, y, z = vector_quaternion(np.pi, 0.0, 0.0)
        >>> float(w.round(9)), float(x)
        (0.0, 1.0)
    """
    angle = np.sqrt(x**2 + y**2 + z**2)
    share = np.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    return np.cos(0.5 * angle), share * x, share * y, share * z


@register_jitable
def quaternion_vector(q: Quaternion) -> tuple[Any, Any, Any]:
    """Return the rotation vector [rad] of a unit quaternion, of numbers only, at most half a turn.

    Example:
        >>> [float(part.round(4)) for part in quaternion_vector((0.0, 0.0, -1.0, 0.0))]
        [0.0, -3.1416, 0.0]
    """
    sine = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    share = 2.0 if sine < 1e-9 else 2.0 * np.arctan2(sine, abs(q[0])) / sine
    if q[0] < 0:
        share = -share
    return share * q[1], share * q[2], share * q[3]

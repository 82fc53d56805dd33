"""An upright body's orientation as yaw, then roll, then pitch: R = R_z(yaw) R_x(roll) R_y(pitch).

Deep bows and forward rolls go through no singular posture; only lying on one side is one. Like
`quaternions`, for numbers in kernels and for whole arrays in Python; angles are radians.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import register_jitable

from ..recording import FloatArray
from .compiling import njit
from .quaternions import Numbers, Quaternion


@register_jitable
def yaw_roll_pitch_quaternion(
    yaw: Numbers, roll: Numbers, pitch: Numbers
) -> tuple[Any, Any, Any, Any]:
    """Return the unit quaternion (w, x, y, z).

    Example:
        >>> [float(part.round(4)) for part in yaw_roll_pitch_quaternion(0.0, 0.0, np.pi / 2)]
        [0.7071, 0.0, 0.7071, 0.0]
    """
    cy, cr, cp = np.cos(0.5 * yaw), np.cos(0.5 * roll), np.cos(0.5 * pitch)
    sy, sr, sp = np.sin(0.5 * yaw), np.sin(0.5 * roll), np.sin(0.5 * pitch)
    return (
        cy * cr * cp - sy * sr * sp,
        cy * sr * cp - sy * cr * sp,
        cy * cr * sp + sy * sr * cp,
        cy * sr * sp + sy * cr * cp,
    )


@njit(cache=True)
def roll_pitch_matrix(roll: float, pitch: float) -> FloatArray:
    """Return the rotation matrix (3, 3) of an orientation without yaw.

    Example:
        >>> roll_pitch_matrix(0.0, np.pi / 2).round().astype(int)
        array([[ 0,  0,  1],
               [ 0,  1,  0],
               [-1,  0,  0]])
    """
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    return np.array([[cp, 0.0, sp], [sr * sp, cr, -sr * cp], [-cr * sp, sr, cr * cp]])


@register_jitable
def yaw_of(q: Quaternion) -> Any:
    """Return the yaw of a unit quaternion, in [-pi, pi].

    Example:
        >>> float(yaw_of(yaw_roll_pitch_quaternion(2.0, 0.3, -0.4)).round(9))
        2.0
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    return np.arctan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z))


@register_jitable
def roll_pitch_of(q: Quaternion) -> tuple[Any, Any]:
    """Return roll, in [-pi / 2, pi / 2], and pitch, in [-pi, pi], of a unit quaternion.

    Example:
        >>> roll, pitch = roll_pitch_of(yaw_roll_pitch_quaternion(2.0, 0.3, -0.4))
        >>> float(roll.round(9)), float(pitch.round(9))
        (0.3, -0.4)
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    roll = np.arcsin(np.minimum(np.maximum(2 * (y * z + w * x), -1.0), 1.0))
    return roll, np.arctan2(2 * (w * y - x * z), 1 - 2 * (x * x + y * y))

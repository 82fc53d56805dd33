"""Euler angles of a motion as a path: continuous, and at rest where the rotation rests.

The angles that a file holds are one choice of many. ``(a, b, c)`` and ``(a + pi, pi - b, c + pi)``
are the same rotation, and so are all that differ by full turns. At gimbal lock (b = 90 deg) only
the sum or the difference of a and c means anything, and near it they whirl while the joint hardly
moves. So the nearest equivalent to the last frame's angles is taken, all three together; and while
a joint stays close to gimbal lock, its outer angle goes only a part of the way of each leap.
"""

from __future__ import annotations

import numpy as np

from ..errors import InvalidValueError
from ..recording import BoolArray, FloatArray, IntArray
from .compiling import njit
from .rotations import euler_to_matrix

_NEAR_LOCK = np.radians(3.0)  # where half of a leap is taken; what is left out is 2 deg at most
_FAR_FROM_LOCK = 2 * _NEAR_LOCK  # from here on the angles are the rotation's, whatever they cost
_LEAP = 2.0  # times as far as the joint turned
_PASSES = 0.5  # of its path, by which a joint that passes gimbal lock gets on
_TURN = 2 * np.pi


def continuous_euler(order: str, angles: FloatArray) -> FloatArray:
    """Return Euler angles of the same rotations that do not leap, turn over or drift.

    They are exactly the rotation's, but for a joint that stays within 6 deg of gimbal lock instead
    of passing it: there they give it up to two degrees where they would leap otherwise.

    Args:
        order: One to three different axes, as ``"ZXY"``: the first angle turns outermost
            (``R = R_z R_x R_y``).
        angles: An angle for each axis, shape (T, len(order)) [rad]; NaN where not known.

    Returns:
        Shape (T, len(order)) [rad]; the first frame's are those nearest to zero.

    Raises:
        InvalidValueError: There is no such order, or it has another number of angles.

    Example:
        >>> flipped = np.array([[0.0, 1.5, 0.0], [np.pi, np.pi - 1.6, np.pi]])
        >>> continuous_euler("XYZ", flipped).round(3)
        array([[0. , 1.5, 0. ],
               [0. , 1.6, 0. ]])
    """
    if not (1 <= len(order) <= 3 and len(set(order)) == len(order) and set(order) <= set("XYZ")):
        raise InvalidValueError(f"an order is one to three different of X, Y, Z, not {order!r}")
    angles = np.ascontiguousarray(angles, dtype=np.float64)
    if angles.ndim != 2 or angles.shape[1] != len(order):
        raise InvalidValueError(
            f"order {order!r} needs angles (T, {len(order)}), not {angles.shape}"
        )
    if len(order) < 3:
        return np.asarray(_unwrapped(angles))
    rotations = np.full((len(angles), 3, 3), np.nan)
    known = np.flatnonzero(~np.isnan(angles).any(axis=1))
    rotations[known] = euler_to_matrix(order, angles[known])
    steps = rotations[known[1:]] - rotations[known[:-1]]
    turned = np.zeros(len(angles))  # by how much since the last known frame [rad]
    turned[known[1:]] = 2 * np.arcsin(np.minimum(np.sqrt((steps**2).sum(axis=(1, 2)) / 8), 1.0))
    off_lock = np.arcsin(np.abs(np.cos(angles[:, 1])))
    axes = np.array(["XYZ".index(axis) for axis in order])
    stays = _stays(off_lock < _FAR_FROM_LOCK, turned, rotations)
    return np.asarray(_path(axes, angles, rotations, turned, off_lock, stays))


def _stays(close: BoolArray, turned: FloatArray, rotations: FloatArray) -> BoolArray:
    """Return where a joint is close to gimbal lock, and not because it passes it on its way."""
    stays = close.copy()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], close, [False]]).astype(np.int8)))
    for start, end in edges.reshape(-1, 2):
        if start > 0 and end < len(close):
            net = np.sqrt(((rotations[end - 1] - rotations[start]) ** 2).sum() / 2)
            if net > _PASSES * turned[start + 1 : end].sum():
                stays[start:end] = False
    return stays


@njit(cache=True)
def _near(angle: float, last: float) -> float:
    """Return the equivalent of an angle that is nearest to the last one."""
    turns: float = np.rint((last - angle) / _TURN)
    return angle + _TURN * turns


@njit(cache=True)
def _unwrapped(angles: FloatArray) -> FloatArray:
    out = np.empty_like(angles)
    for column in range(angles.shape[1]):
        last = 0.0
        for t in range(len(angles)):
            out[t, column] = _near(angles[t, column], last)
            if not np.isnan(out[t, column]):
                last = out[t, column]
    return out


@njit(cache=True)
def _path(
    axes: IntArray,
    angles: FloatArray,
    rotations: FloatArray,
    turned: FloatArray,
    off_lock: FloatArray,
    stays: BoolArray,
) -> FloatArray:
    i, j, k = axes
    handed = 1.0 if (j - i) % 3 == 1 else -1.0
    out = np.full_like(angles, np.nan)
    last = np.zeros(3)
    begun = False
    for t in range(len(angles)):
        a, b, c = angles[t]
        if np.isnan(a + b + c):
            continue
        best = np.array([_near(a, last[0]), _near(b, last[1]), _near(c, last[2])])
        other = np.array(
            [_near(a + np.pi, last[0]), _near(np.pi - b, last[1]), _near(c + np.pi, last[2])]
        )
        step = np.sqrt(((best - last) ** 2).sum())
        step_other = np.sqrt(((other - last) ** 2).sum())
        if step_other < step:
            best, step = other, step_other
        if begun and stays[t] and step > _LEAP * turned[t]:
            share = 1.0 / (1.0 + (_NEAR_LOCK / max(off_lock[t], 1e-12)) ** 6)
            a = last[0] + share * (best[0] - last[0])
            # what is left, R_j(b) R_k(c), as nearly as this a allows; rows of R_i(a)^T R
            rotation = rotations[t]
            sine, cosine = np.sin(a), np.cos(a)
            row_j = cosine * rotation[j] + handed * sine * rotation[k]
            row_k = cosine * rotation[k] - handed * sine * rotation[j]
            row_i = rotation[i]
            c = np.arctan2(handed * row_j[i], row_j[j])
            sine, cosine = np.sin(c), np.cos(c)
            # columns i and k after R_k(c)^T
            ii = row_i[i] * cosine - handed * row_i[j] * sine
            ki = row_k[i] * cosine - handed * row_k[j] * sine
            b = np.arctan2(handed * (row_i[k] - ki), ii + row_k[k])
            best = np.array([a, _near(b, last[1]), _near(c, last[2])])
        out[t] = best
        last = best
        begun = True
    return out

"""Whether one foot of the reference robot meets the other on its way."""

from __future__ import annotations

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.kinematics import forward
from mplearn_envs.mechanics.reference import ReferenceRobot

NEAR_M = 0.003  # feet so near to each other may touch where the body is not as believed
_HIGH = 0.5  # of the way from its sole to its ankle a foot is a block


@njit(cache=True, nogil=True)
def feet_touch(robot: ReferenceRobot, q: FloatArray, near_m: float = NEAR_M) -> bool:
    """Return whether the feet come too near to each other anywhere along a motion.

    Args:
        robot: The reference robot.
        q: Postures, shape (K, 7 + n).
        near_m: Gap that is too narrow [m]; negative is how far they may overlap.
    """
    feet, corners = robot.stance.feet, robot.corners
    soles = np.empty((2, 4, 3))
    for k in range(q.shape[0]):
        pose = forward(robot.tree, q[k])
        for side in range(2):
            foot = feet[side]
            for corner in range(4):
                for i in range(3):
                    soles[side, corner, i] = pose.position[foot, i]
                    for j in range(3):
                        soles[side, corner, i] += (
                            pose.rotation[foot, i, j] * corners[side, corner, j]
                        )
        upper = int(soles[1, :, 2].min() > soles[0, :, 2].min())
        apart = soles[upper, :, 2].min() - soles[1 - upper, :, 2].max()
        apart += _HIGH * corners[1 - upper, :, 2].max()  # soles are below ankles
        if apart < max(near_m, 0.0) and outline_gap(soles[0, :, :2], soles[1, :, :2]) < near_m:
            return True
    return False


@njit(cache=True, nogil=True)
def outline_gap(one: FloatArray, other: FloatArray) -> float:
    """Return by how much an edge of two parallelograms separates them at most [m].

    Args:
        one: Corners in a row, shape (4, 2) [m].
        other: Likewise.

    Returns:
        Negative where they overlap; never more than their distance.

    Example:
        >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        >>> outline_gap(square, square + 1.5)
        0.5
    """
    best = -np.inf
    for which in range(2):
        outline = one if which == 0 else other
        for edge in range(2):
            x = outline[edge + 1, 1] - outline[edge, 1]
            y = outline[edge, 0] - outline[edge + 1, 0]
            length = np.hypot(x, y)
            if length == 0.0:
                continue
            a = (one[:, 0] * x + one[:, 1] * y) / length
            b = (other[:, 0] * x + other[:, 1] * y) / length
            best = max(best, b.min() - a.max(), a.min() - b.max())
    return float(best)

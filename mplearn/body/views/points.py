"""Where points of a body are in the postures that features describe."""

from __future__ import annotations

import numpy as np

from mplearn.maths.yaw_roll_pitch import yaw_roll_pitch_quaternion
from mplearn.recording import FloatArray, IntArray

from ...maths.compiling import njit
from ..kinematics.kernels import points_of_postures
from ..models.body import Body


def points_of(features: FloatArray, body: Body, parts: IntArray, places: FloatArray) -> FloatArray:
    """Return points of a body relative to its base, x ahead and y to the left.

    Args:
        features: Shape (T, 3 + driven), as `features_of` returns them.
        body: The body.
        parts: Part that each point is fixed to, shape (P,).
        places: Where in the part's frame it is, shape (P, 3) [m].

    Returns:
        Shape (T, P, 3) [m].
    """
    postures = _postures(features, body.driven.copy(), len(body.tree.axis))
    return np.asarray(points_of_postures(postures, body.tree.linkage, parts, places))


@njit(cache=True)
def _postures(features: FloatArray, driven: IntArray, n_joints: int) -> FloatArray:
    """Return the postures at the origin, without heading, shape (T, 7 + n)."""
    postures = np.zeros((len(features), 7 + n_joints))
    for t in range(len(features)):
        turn = postures[t, 3:7]
        turn[0], turn[1], turn[2], turn[3] = yaw_roll_pitch_quaternion(
            0.0, features[t, 1], features[t, 2]
        )
        for j in range(len(driven)):
            postures[t, 7 + driven[j]] = features[t, 3 + j]
    return postures

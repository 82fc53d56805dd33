"""Where points of a body are in the postures that features describe."""

from __future__ import annotations

from functools import cache

import numpy as np
from numba import njit

from mplearn.recording import FloatArray, IntArray

from .body import Body
from .gauss_newton import Linkage
from .kinematics import forward_kinematics


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
    return np.asarray(_points(features, body.driven, _linkage(body), parts, places))


@cache
def _linkage(body: Body) -> Linkage:
    return Linkage.of(body.tree)


@njit(cache=True)
def _points(
    features: FloatArray,
    driven: IntArray,
    linkage: Linkage,
    parts: IntArray,
    places: FloatArray,
) -> FloatArray:
    n_bodies, n = len(linkage.parent), len(linkage.axis)
    posture = np.zeros(7 + n)
    pos, mat = np.empty((n_bodies, 3)), np.empty((n_bodies, 3, 3))
    axes, anchors = np.empty((n, 3)), np.empty((n, 3))
    points = np.empty((len(features), len(parts), 3))
    for t in range(len(features)):
        cr, sr = np.cos(features[t, 1] / 2), np.sin(features[t, 1] / 2)
        cp, sp = np.cos(features[t, 2] / 2), np.sin(features[t, 2] / 2)
        posture[3], posture[4], posture[5], posture[6] = cr * cp, sr * cp, cr * sp, sr * sp
        for j in range(len(driven)):
            posture[7 + driven[j]] = features[t, 3 + j]
        forward_kinematics(
            posture,
            linkage.parent,
            linkage.offset,
            linkage.rotation,
            linkage.joint_body,
            linkage.axis,
            linkage.anchor,
            pos,
            mat,
            axes,
            anchors,
            linkage.slides,
        )
        for p in range(len(parts)):
            b = parts[p]
            for i in range(3):
                value = pos[b, i]
                for k in range(3):
                    value += mat[b, i, k] * places[p, k]
                points[t, p, i] = value
    return points

"""Forces of the ground on soles that can push and rub, but not pull."""

from __future__ import annotations

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.recording import FloatArray

_EDGES = 4  # of each corner's friction pyramid
_SWEEPS = 60
_EASE = 1e-5  # price of forces themselves, against those that cancel each other


@njit(cache=True, nogil=True)
def contact_forces(
    points: FloatArray, wrench: FloatArray, weight: FloatArray, friction: float
) -> FloatArray:
    """Return the forces at points of the floor whose sum is most like a wanted one, (P, 3) [N].

    Least squares over non-negative shares of the edges of a friction pyramid at each point, by
    coordinate descent from an even share: the same input gives the same output.

    Args:
        points: Where the ground can push, from the origin of the moment, shape (P, 3) [m].
        wrench: Wanted force and moment, shape (6,) [N, N m].
        weight: How much each of its components counts, shape (6,).
        friction: Coefficient; the pyramid lies inside the cone.
    """
    n = points.shape[0] * _EDGES
    slope = friction / np.sqrt(2.0)
    columns = np.empty((n, 6))
    edge = np.empty(3)
    for p in range(points.shape[0]):
        x, y, z = points[p]
        for k in range(_EDGES):
            edge[0] = slope if k % 2 == 0 else -slope
            edge[1] = slope if k < 2 else -slope
            edge[2] = 1.0
            row = columns[p * _EDGES + k]
            row[:3] = edge
            row[3] = y * edge[2] - z * edge[1]
            row[4] = z * edge[0] - x * edge[2]
            row[5] = x * edge[1] - y * edge[0]
            row *= weight
    square = columns @ columns.T
    right = columns @ (weight * wrench)
    share = np.full(n, max(wrench[2], 0.0) / max(n, 1))
    for _ in range(_SWEEPS):
        for i in range(n):
            slack = right[i] + square[i, i] * share[i]
            for j in range(n):
                slack -= square[i, j] * share[j]
            share[i] = max(slack / (square[i, i] + _EASE), 0.0)
    out = np.zeros((points.shape[0], 3))
    for p in range(points.shape[0]):
        for k in range(_EDGES):
            force = share[p * _EDGES + k]
            out[p, 0] += (slope if k % 2 == 0 else -slope) * force
            out[p, 1] += (slope if k < 2 else -slope) * force
            out[p, 2] += force
    return out

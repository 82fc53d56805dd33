"""How far postures are apart, rounded: those that are equally far but for rounding are it exactly.

A motion that is made comes back to the very same postures, but for rounding. Which of them are
nearest must not depend on that.
"""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray

_ROUNDED = 1e-9  # share of the spread of all postures, squared


def rounding(points: FloatArray) -> float:
    """Return what squared distances among points are rounded to, for points of shape (n, D)."""
    return _ROUNDED * float(points.var(axis=0).sum())


def squared_distances(some: FloatArray, others: FloatArray, unit: float) -> FloatArray:
    """Return the squared Euclidean distances between points, rounded to multiples of a unit.

    Args:
        some: Shape (m, D).
        others: Shape (n, D).
        unit: As from `rounding`; 0 does not round.

    Returns:
        Shape (m, n).

    Example:
        >>> import numpy as np
        >>> squared_distances(np.array([[0.1 + 0.2]]), np.array([[0.3], [1.3]]), 1e-9).tolist()
        [[0.0, 1.0]]
    """
    from scipy.spatial.distance import cdist

    distances: FloatArray = cdist(some, others, "sqeuclidean")
    if unit > 0:
        np.divide(distances, unit, out=distances)
        np.rint(distances, out=distances)
        np.multiply(distances, unit, out=distances)
    return distances

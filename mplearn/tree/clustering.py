"""Complete-link clustering of a node's exemplars [Kulic2012, 2.2, eq. 7]."""

from __future__ import annotations

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from ..recording import FloatArray, IntArray
from .spread import pairs


def clusters_below(matrix: FloatArray, cutoff: float, least: int) -> list[IntArray]:
    """Return the clusters whose largest distance is at most ``cutoff``, tightest first.

    Args:
        matrix: Distances, shape (n, n).
        cutoff: D_cutoff.
        least: Fewest members of a cluster.

    Returns:
        Positions of the members, in order.
    """
    if len(matrix) < least or not cutoff >= 0:
        return []
    labels = fcluster(linkage(pairs(matrix), "complete"), cutoff, "distance")
    groups = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    large = [group for group in groups if len(group) >= least]
    return sorted(large, key=lambda group: float(matrix[np.ix_(group, group)].max()))


def two_branches(matrix: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the positions of the two last branches of the complete-link tree, larger one first."""
    labels = fcluster(linkage(pairs(matrix), "complete"), 2, "maxclust")
    first, second = np.flatnonzero(labels == 1), np.flatnonzero(labels == 2)
    return (first, second) if len(first) >= len(second) else (second, first)


def separation(matrix: FloatArray, first: IntArray, second: IntArray) -> float:
    """Return the mean distance between two groups over that inside them."""
    inside = np.concatenate([pairs(matrix[np.ix_(group, group)]) for group in (first, second)])
    between = float(matrix[np.ix_(first, second)].mean())
    return between / max(float(inside.mean()), 1e-300) if len(inside) else float("inf")


def most_redundant(matrix: FloatArray) -> int:
    """Return which exemplar tells least: of the closest pair, the one nearer to all others."""
    apart = matrix + np.diag(np.full(len(matrix), np.inf))
    i, j = np.unravel_index(int(apart.argmin()), apart.shape)
    return int(i) if matrix[i].sum() <= matrix[j].sum() else int(j)

"""Complete-link clustering of a node's exemplars [Kulic2012, 2.2, eq. 7]."""

from __future__ import annotations

import numpy as np

from ...recording import FloatArray, IntArray
from ..exemplars.spread import pairs


def clusters_below(matrix: FloatArray, cutoff: float, least: int) -> list[IntArray]:
    """Return the clusters whose largest distance is at most ``cutoff``, tightest first.

    Args:
        matrix: Distances, shape (n, n).
        cutoff: D_cutoff.
        least: Fewest members of a cluster.

    Returns:
        Positions of the members, in order.
    """
    from scipy.cluster.hierarchy import fcluster, linkage

    if len(matrix) < max(least, 2) or not cutoff >= 0:
        return []
    labels = fcluster(linkage(pairs(matrix), "complete"), cutoff, "distance")
    groups = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    large = [group for group in groups if len(group) >= least]
    return sorted(large, key=lambda group: float(matrix[np.ix_(group, group)].max()))


def two_branches(matrix: FloatArray, least: int) -> tuple[IntArray, IntArray] | None:
    """Return the positions of the two main branches of the complete-link tree, larger one first.

    Branches of fewer than ``least`` members that join last are outliers; each goes to the branch
    that is nearer on average. None where there are no two branches of that size.
    """
    from scipy.cluster.hierarchy import linkage

    n = len(matrix)
    if n < 2 * least:
        return None
    merges = linkage(pairs(matrix), "complete")
    sizes = np.concatenate([np.ones(n), merges[:, 3]])
    at = 2 * n - 2
    while True:
        if at < n:
            return None
        left, right = (int(child) for child in merges[at - n, :2])
        if min(sizes[left], sizes[right]) >= least:
            break
        at = left if sizes[left] >= sizes[right] else right
    groups = [_members(merges, left), _members(merges, right)]
    inside = np.concatenate(groups)
    for outlier in np.setdiff1d(np.arange(n), inside):
        nearer = int(np.argmin([matrix[outlier, group].mean() for group in groups]))
        groups[nearer] = np.sort(np.append(groups[nearer], outlier))
    first, second = sorted(groups, key=lambda group: (-len(group), group[0]))
    return first, second


def _members(merges: FloatArray, cluster: int) -> IntArray:
    """Return the positions of a cluster's members, in order."""
    n = len(merges) + 1
    found = []
    pending = [cluster]
    while pending:
        at = pending.pop()
        if at < n:
            found.append(at)
        else:
            pending += [int(child) for child in merges[at - n, :2]]
    return np.array(sorted(found), dtype=np.int64)


def separation(matrix: FloatArray, first: IntArray, second: IntArray) -> float:
    """Return the mean distance between two groups over that inside them.

    Copies, where a recording is seen twice, say nothing of how much executions vary.
    """
    inside = np.concatenate([pairs(matrix[np.ix_(group, group)]) for group in (first, second)])
    between = float(matrix[np.ix_(first, second)].mean())
    inside = inside[inside > 1e-6 * between]
    return between / max(float(inside.mean()), 1e-300) if len(inside) else float("inf")


def gap(matrix: FloatArray, first: IntArray, second: IntArray) -> float:
    """Return the smallest distance between two groups over the usual one to a neighbour inside.

    Unlike the mean, it stays low where one motion varies widely but without a break. The second
    neighbour counts: the first may be a copy, where a recording is seen twice.
    """
    inside = [matrix[np.ix_(group, group)] for group in (first, second)]
    usual = max(nearest_usual(*inside), 1e-300)
    return float(matrix[np.ix_(first, second)].min()) / usual


def nearest_usual(*matrices: FloatArray) -> float:
    """Return the usual distance to a second neighbour in groups of at least two, given theirs.

    Of two, each has one neighbour, which counts.
    """
    apart = [matrix + np.diag(np.full(len(matrix), np.inf)) for matrix in matrices]
    second = [np.sort(rows, axis=1)[:, min(1, len(rows) - 2)] for rows in apart]
    return float(np.median(np.concatenate(second)))


def most_redundant(matrix: FloatArray) -> int:
    """Return which exemplar tells least: of the closest pair, the one nearer to all others."""
    apart = matrix + np.diag(np.full(len(matrix), np.inf))
    i, j = np.unravel_index(int(apart.argmin()), apart.shape)
    return int(i) if matrix[i].sum() <= matrix[j].sum() else int(j)

"""Complete-link clustering of a node's exemplars [Kulic2012, 2.2, eq. 7]."""

from __future__ import annotations

import numpy as np

from ...maths.compiling import njit
from ...recording import FloatArray, IntArray
from ..exemplars.spread import pairs


@njit(cache=True)
def complete_linkage(matrix: FloatArray, cutoff: float) -> tuple[FloatArray, IntArray]:
    """Join what is nearest by the largest distance inside it, as far as that is at most ``cutoff``.

    Args:
        matrix: Distances, shape (n, n).
        cutoff: Largest distance inside a cluster.

    Returns:
        The joins so far as scipy's ``linkage`` has them, shape (k, 4); and of each of the n the
        first in its cluster, shape (n,).
    """
    n = len(matrix)
    apart = matrix.copy()
    homes, ids, sizes = np.arange(n), np.arange(n), np.ones(n)
    nearest, nearness = np.zeros(n, np.int64), np.full(n, np.inf)
    merges = np.empty((max(n - 1, 0), 4))
    stale = np.ones(n, np.bool_)
    n_merges = 0
    while True:
        one = -1
        for i in range(n):
            if homes[i] != i:
                continue
            if stale[i]:
                nearness[i], stale[i] = np.inf, False
                for j in range(n):
                    if homes[j] == j and j != i and apart[i, j] < nearness[i]:
                        nearest[i], nearness[i] = j, apart[i, j]
            if nearness[i] <= cutoff and (one < 0 or nearness[i] < nearness[one]):
                one = i
        if one < 0 or n_merges == n - 1:
            return merges[:n_merges], homes
        kept, gone = min(one, nearest[one]), max(one, nearest[one])
        merges[n_merges, 0] = min(ids[kept], ids[gone])
        merges[n_merges, 1] = max(ids[kept], ids[gone])
        merges[n_merges, 2] = nearness[one]
        sizes[kept] += sizes[gone]
        merges[n_merges, 3] = sizes[kept]
        ids[kept] = n + n_merges
        n_merges += 1
        for j in range(n):
            if homes[j] == gone:
                homes[j] = kept
            apart[kept, j] = apart[j, kept] = max(apart[kept, j], apart[gone, j])
            stale[j] |= nearest[j] == kept or nearest[j] == gone
        stale[kept] = True


def clusters_below(matrix: FloatArray, cutoff: float, least: int) -> list[IntArray]:
    """Return the clusters whose largest distance is at most ``cutoff``, tightest first.

    Args:
        matrix: Distances, shape (n, n).
        cutoff: D_cutoff.
        least: Fewest members of a cluster.

    Returns:
        Positions of the members, in order.
    """
    if len(matrix) < max(least, 2) or not cutoff >= 0:
        return []
    _, homes = complete_linkage(np.ascontiguousarray(matrix), cutoff)
    sizes = np.bincount(homes)
    groups = [np.flatnonzero(homes == home) for home in np.flatnonzero(sizes >= max(least, 1))]
    return sorted(groups, key=lambda group: float(matrix[np.ix_(group, group)].max()))


def two_branches(matrix: FloatArray, least: int) -> tuple[IntArray, IntArray] | None:
    """Return the positions of the two main branches of the complete-link tree, larger one first.

    Branches of fewer than ``least`` members that join last are outliers; each goes to the branch
    that is nearer on average. None where there are no two branches of that size.
    """
    n = len(matrix)
    if n < 2 * least:
        return None
    merges, _ = complete_linkage(np.ascontiguousarray(matrix), np.inf)
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

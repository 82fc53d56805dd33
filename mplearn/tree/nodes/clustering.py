"""Complete-link clustering of a node's exemplars [Kulic2012, 2.2, eq. 7]."""

from __future__ import annotations

import numpy as np

from ...maths.compiling import njit
from ...maths.sums import pairwise_sum
from ...recording import BoolArray, FloatArray, IntArray


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
    if len(matrix) < 2 * least:
        return None
    second = _in_second(np.array(matrix), least)
    if not len(second):
        return None
    return np.flatnonzero(~second), np.flatnonzero(second)


@njit(cache=True)
def _in_second(matrix: FloatArray, least: int) -> BoolArray:
    """Return which of `two_branches` each is in, shape (n,); of none where there are none."""
    n = len(matrix)
    merges, _ = complete_linkage(matrix, np.inf)
    at = 2 * n - 2
    while True:
        if at < n:
            return np.zeros(0, np.bool_)
        left, right = int(merges[at - n, 0]), int(merges[at - n, 1])
        of_left = merges[left - n, 3] if left >= n else 1.0
        of_right = merges[right - n, 3] if right >= n else 1.0
        if min(of_left, of_right) >= least:
            break
        at = left if of_left >= of_right else right
    groups = [_members(merges, left), _members(merges, right)]
    inside = np.zeros(n, np.bool_)
    for group in groups:
        inside[group] = True
    for outlier in np.flatnonzero(~inside):
        apart = [pairwise_sum(matrix[outlier][group]) / len(group) for group in groups]
        nearer = 0 if apart[0] <= apart[1] else 1
        groups[nearer] = np.sort(np.append(groups[nearer], outlier))
    one, other = groups
    if len(one) != len(other):
        second = one if len(one) < len(other) else other
    else:
        second = one if one[0] > other[0] else other
    chosen = np.zeros(n, np.bool_)
    chosen[second] = True
    return chosen


@njit(cache=True)
def _members(merges: FloatArray, cluster: int) -> IntArray:
    """Return the positions of a cluster's members, in order."""
    n = len(merges) + 1
    found, pending = np.zeros(n, np.bool_), [cluster]
    while pending:
        at = pending.pop()
        if at < n:
            found[at] = True
        else:
            pending.append(int(merges[at - n, 0]))
            pending.append(int(merges[at - n, 1]))
    return np.flatnonzero(found)


@njit(cache=True)
def separation(matrix: FloatArray, first: IntArray, second: IntArray) -> float:
    """Return the mean distance between two groups over that inside them.

    Copies, where a recording is seen twice, say nothing of how much executions vary.
    """
    between = mean_between(matrix, first, second)
    inside = np.empty((len(first) ** 2 + len(second) ** 2) // 2)
    n = 0
    for group in (first, second):
        for k, i in enumerate(group):
            for j in group[k + 1 :]:
                if matrix[i, j] > 1e-6 * between:
                    inside[n] = matrix[i, j]
                    n += 1
    return between / max(pairwise_sum(inside[:n]) / n, 1e-300) if n else np.inf


@njit(cache=True)
def mean_between(matrix: FloatArray, first: IntArray, second: IntArray) -> float:
    """Return the mean distance between two groups."""
    between = np.empty((len(first), len(second)))
    for k, i in enumerate(first):
        between[k] = matrix[i][second]
    return pairwise_sum(between.ravel()) / between.size


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


@njit(cache=True)
def most_redundant(matrix: FloatArray) -> int:
    """Return which exemplar tells least: of the closest pair, the one nearer to all others."""
    one, other, least = 0, 0, np.inf
    for i in range(len(matrix)):
        for j in range(len(matrix)):
            if j != i and matrix[i, j] < least:
                one, other, least = i, j, matrix[i, j]
    return one if pairwise_sum(matrix[one]) <= pairwise_sum(matrix[other]) else other

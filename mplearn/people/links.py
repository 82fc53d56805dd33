"""Which leaves of several people's trees are the same motion."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..recording import BoolArray, FloatArray, IntArray
from .config import PeopleConfig
from .shapes import Shape, distances

_ROUNDS = 3  # links and people's offsets are found in turn


def solve(
    shapes: Shape, people: IntArray, n_people: int, config: PeopleConfig
) -> tuple[IntArray, FloatArray, float]:
    """Find the groups of leaves that are one primitive each.

    Args:
        shapes: Of all n leaves, stacked.
        people: Whose leaf each is, 0, 1, ..., shape (n,).
        n_people: How many people there are.
        config: The rules.

    Returns:
        The group of each leaf, shape (n,); each person's usual deviation in posture,
        shape (n_people, D); the unit of distance, inf where no person has two leaves.
    """
    offsets = np.zeros((n_people, shapes.posture.shape[1]))
    groups = np.arange(len(people))
    unit = float("inf")
    for _ in range(_ROUNDS):
        level = corrected(shapes, people, offsets)
        matrix = distances(level, level, config.posture)
        unit = unit_of(matrix, people, config.repertoire)
        if not np.isfinite(unit):
            break
        before, groups = groups, agglomerate(matrix / unit, people, config)
        if np.array_equal(before, groups):
            break
        offsets = offsets_of(shapes.posture, people, n_people, groups, config.offset_prior)
    return groups, offsets, unit


def corrected(shapes: Shape, people: IntArray, offsets: FloatArray) -> Shape:
    """Return shapes less what their people's postures usually deviate by."""
    return Shape(shapes.posture - offsets[people], shapes.movement)


def unit_of(matrix: FloatArray, people: IntArray, repertoire: int) -> float:
    """Return how far a person's primitives lie apart, or will when as many are known as are usual.

    It is the median distance from a leaf to the nearest other leaf of the same person. While few
    are known they lie far apart: neighbours of n points in a volume do so by n^(-1/3).

    Args:
        matrix: Distances, shape (n, n).
        people: Whose leaf each is, shape (n,).
        repertoire: Leaves of a person from which on the distance is taken as it is.
    """
    own = (people[:, None] == people) & ~np.eye(len(people), dtype=np.bool_)
    nearest = np.where(own, matrix, np.inf).min(axis=1, initial=np.inf)
    known = np.isfinite(nearest)
    if not known.any():
        return float("inf")
    share = min(1.0, (1.0 + float(own.sum(axis=1)[known].mean())) / repertoire)
    return float(np.median(nearest[known])) * float(np.cbrt(share))


def tension(nearest: FloatArray, second: FloatArray, reach: float) -> FloatArray:
    """Return how doubtful it is that a motion is its nearest neighbour.

    Large motions differ more from person to person than small ones do, so nearness alone decides
    nothing: it counts together with how much farther the next candidate is.

    Args:
        nearest: Distance to the nearest, in units.
        second: Distance to the next.
        reach: Distance up to which the next one counts: while few are known, it is far off.
    """
    return np.asarray(nearest**2 / np.clip(second, 1e-12, reach))


def agglomerate(matrix: FloatArray, people: IntArray, config: PeopleConfig) -> IntArray:
    """Join leaves by average link, the least doubtful first; of one person only what is very near.

    Args:
        matrix: Distances in units, shape (n, n).
        people: Whose leaf each is, shape (n,).
        config: The rules.

    Returns:
        The group of each leaf, named by its first one, shape (n,).
    """
    own = (people[:, None] == people) & (matrix > config.link_own)
    return np.asarray(_agglomerate(matrix, own, config.link, config.reach))


@njit(cache=True)
def _agglomerate(matrix: FloatArray, barred: BoolArray, link: float, reach: float) -> IntArray:
    n = len(matrix)
    groups = np.arange(n)
    total, sizes, alive = matrix.copy(), np.ones(n), np.ones(n, dtype=np.bool_)
    barred = barred.copy()
    mean = matrix.copy()
    nearest, second = np.empty(n), np.empty(n)
    while True:
        for i in range(n):
            nearest[i] = second[i] = np.inf
            for j in range(n):
                if j != i and alive[i] and alive[j]:
                    if mean[i, j] < nearest[i]:
                        nearest[i], second[i] = mean[i, j], nearest[i]
                    elif mean[i, j] < second[i]:
                        second[i] = mean[i, j]
        best, first, other = np.inf, -1, -1
        for i in range(n):
            for j in range(i + 1, n):
                if alive[i] and alive[j] and not barred[i, j]:
                    d = mean[i, j]
                    next_i = second[i] if d <= nearest[i] else nearest[i]
                    next_j = second[j] if d <= nearest[j] else nearest[j]
                    doubt = d * d / max(min(next_i, next_j, reach), 1e-12)
                    if doubt < best:
                        best, first, other = doubt, i, j
        if first < 0 or not best <= link:
            return groups
        sizes[first] += sizes[other]
        alive[other] = False
        for k in range(n):
            total[first, k] += total[other, k]
            barred[first, k] |= barred[other, k]
            if groups[k] == other:
                groups[k] = first
        for k in range(n):
            total[k, first] = total[first, k]
            barred[k, first] = barred[first, k]
            mean[first, k] = mean[k, first] = total[first, k] / (sizes[first] * sizes[k])


def offsets_of(
    postures: FloatArray, people: IntArray, n_people: int, groups: IntArray, prior: float
) -> FloatArray:
    """Return by how much each person's postures deviate from the others' in the same primitives.

    Args:
        postures: Mean posture of each leaf, shape (n, D).
        people: Whose leaf each is, shape (n,).
        n_people: How many people there are.
        groups: The primitive of each leaf, shape (n,).
        prior: Shared primitives for which half of it is believed.

    Returns:
        Shape (n_people, D); zero for a person who shares nothing.
    """
    offsets = np.zeros((n_people, postures.shape[1]))
    shared = [
        np.flatnonzero(groups == group)
        for group in np.unique(groups)
        if len(np.unique(people[groups == group])) > 1
    ]
    for _ in range(_ROUNDS):
        sums, counts = np.zeros_like(offsets), np.zeros(n_people)
        for leaves in shared:
            level = postures[leaves] - offsets[people[leaves]]
            mean = level.mean(axis=0)
            for leaf in leaves:
                sums[people[leaf]] += postures[leaf] - mean
                counts[people[leaf]] += 1
        offsets = sums / (counts + prior)[:, None]
    return offsets

"""Which leaves of several people's trees are the same motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..maths.compiling import njit
from ..recording import BoolArray, FloatArray, IntArray
from .config import PeopleConfig
from .shapes.offsets import offsets_of
from .shapes.shape_table import ShapeTable

_ROUNDS = 3  # links and people's offsets are found in turn
_NO_PAIRS = np.zeros((0, 2), dtype=np.int64)


class Known(NamedTuple):
    """What is known of n leaves, in any order.

    Attributes:
        slots: Where their shapes are in the table, shape (n,).
        people: Whose leaf each is, 0, 1, ..., shape (n,).
        firm: Whether it is a leaf, or only what waits to become one, shape (n,).
        together: Pairs that a person said are one motion, shape (n, n).
        apart: Pairs that a person said are different ones, shape (n, n).
    """

    slots: IntArray
    people: IntArray
    firm: BoolArray
    together: BoolArray
    apart: BoolArray


class Solution(NamedTuple):
    """Which leaves are one primitive each.

    Attributes:
        groups: The group of each leaf, named by its first one, shape (n,).
        offsets: Each person's usual deviation in posture, shape (n_people, D).
        unit: The unit of distance, inf where no person has two leaves.
    """

    groups: IntArray
    offsets: FloatArray
    unit: float


def solve(table: ShapeTable, known: Known, n_people: int, config: PeopleConfig) -> Solution:
    """Find the groups of leaves that are one primitive each.

    Args:
        table: The shapes.
        known: The leaves.
        n_people: How many people there are.
        config: The rules.
    """
    postures = table.postures(known.slots)
    offsets = np.zeros((n_people, postures.shape[1]))
    groups = np.arange(len(known.people))
    unit = math.inf
    for _ in range(_ROUNDS):
        levels = postures - offsets[known.people]
        direct, image = table.distances(levels, known.slots, config.posture)
        firm = np.flatnonzero(known.firm)
        sure = direct if len(firm) == len(direct) else direct[np.ix_(firm, firm)]
        unit = unit_of(sure, known.people[firm], config)
        if not np.isfinite(unit):
            groups = _together(known.together)
            break
        direct /= unit
        image /= unit
        before, groups = groups, agglomerate(direct, image, known, config)
        if np.array_equal(before, groups):
            break
        offsets = offsets_of(postures, known.people, n_people, groups, config.offset_prior)
    return Solution(groups, offsets, unit)


def unit_of(matrix: FloatArray, people: IntArray, config: PeopleConfig) -> float:
    """Return how far a person's primitives lie apart, or will when as many are known as are usual.

    It is the median distance from a leaf to the nearest other leaf of the same person. While few
    are known they lie far apart: neighbours of n points in a volume do so by n^(-1/3).

    Args:
        matrix: Distances, shape (n, n).
        people: Whose leaf each is, shape (n,).
        config: The rules.
    """
    nearest = _nearest_own(matrix, people)
    known = np.isfinite(nearest)
    if not known.any():
        return math.inf
    others = np.bincount(people)[people] - 1.0  # of the same person
    share = min(1.0, (1.0 + float(others[known].mean())) / config.repertoire)
    return float(np.median(nearest[known])) * float(np.cbrt(share))


@njit(cache=True)
def _nearest_own(matrix: FloatArray, people: IntArray) -> FloatArray:
    """Return the distance of each leaf from the nearest other one of its person; inf for none."""
    nearest = np.full(len(people), np.inf)
    for i in range(len(people)):
        for j in range(len(people)):
            if people[i] == people[j] and i != j:
                nearest[i] = min(nearest[i], matrix[i, j])
    return nearest


def tension(nearest: float, second: float, reach: float) -> float:
    """Return how doubtful it is that a motion is its nearest neighbour.

    Large motions differ more from person to person than small ones do, so nearness alone decides
    nothing: it counts together with how much farther the next candidate is.

    Args:
        nearest: Distance to the nearest, in units.
        second: Distance to the next.
        reach: Distance up to which the next one counts: while few are known, it is far off.
    """
    return nearest**2 / min(max(second, 1e-12), reach)


def agglomerate(
    direct: FloatArray, image: FloatArray, known: Known, config: PeopleConfig
) -> IntArray:
    """Join leaves by average link, the least doubtful first; of one person only what is very near.

    What is clearly nearer to the mirror image, on average, is the same motion on the other side.

    Args:
        direct: Distances in units, shape (n, n).
        image: Distances from the mirror images, shape (n, n).
        known: The leaves.
        config: The rules.

    Returns:
        The group of each leaf, named by its first one, shape (n,).
    """
    at = np.flatnonzero(known.firm | ~_covered(direct, known.people, known.firm))
    totals, barred = np.empty((len(at), len(at), 2)), np.empty((len(at), len(at)), np.bool_)
    _lay_out(direct, image, at, known.people, known.apart, config.link_own, totals, barred)
    told = np.argwhere(known.together[np.ix_(at, at)]) if known.together.any() else _NO_PAIRS
    groups = np.arange(len(direct))
    groups[at] = at[_agglomerate(totals, barred, told, config.link, config.reach, config.sided)]
    return groups


def _together(pairs: BoolArray) -> IntArray:
    """Return the group of each leaf where only what a person said joins any."""
    n = len(pairs)
    return _agglomerate(np.zeros((n, n, 2)), ~pairs, np.argwhere(pairs), 0.0, 1.0, 0.0)


@njit(cache=True)
def _covered(direct: FloatArray, people: IntArray, firm: BoolArray) -> BoolArray:
    """Return what waits though its person has the leaf that it is nearest to by now."""
    covered = np.zeros(len(firm), dtype=np.bool_)
    leaves = np.flatnonzero(firm)
    if not len(leaves):
        return covered
    for i in np.flatnonzero(~firm):
        nearest = leaves[0]
        for j in leaves:
            if direct[i, j] < direct[i, nearest]:
                nearest = j
        covered[i] = people[nearest] == people[i]
    return covered


@njit(cache=True)
def _lay_out(
    direct: FloatArray,
    image: FloatArray,
    at: IntArray,
    people: IntArray,
    apart: BoolArray,
    link_own: float,
    totals: FloatArray,
    barred: BoolArray,
) -> None:
    """Put down both distances of each pair of some leaves, (n, n, 2), and which must not join.

    They lie side by side, for a join writes a column of both.
    """
    for i, a in enumerate(at):
        for j, b in enumerate(at):
            totals[i, j, 0], totals[i, j, 1] = direct[a, b], image[a, b]
            own = people[a] == people[b]
            barred[i, j] = (own and direct[a, b] > link_own) or apart[a, b]


@njit(cache=True)
def _agglomerate(
    totals: FloatArray,
    barred: BoolArray,
    pinned: IntArray,
    link: float,
    reach: float,
    sided: float,
) -> IntArray:
    """Join the pair of least doubt until all doubts exceed ``link``; never mirror images.

    Each row remembers its best pair, and looks anew only where what its doubts follow from has
    changed: the pairs of few rows do with each join. Both matrices are used up; ``pinned``, shape
    (k, 2), are joined first.
    """
    n = len(totals)
    groups = np.arange(n)
    sizes, nearer = np.ones(n), np.empty(n)
    alive = np.arange(n)
    nearest, second = np.full(n, np.inf), np.full(n, np.inf)
    doubts, partners = np.full(n, np.inf), np.full(n, -1)
    stale, changed = np.ones(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    for at in range(len(pinned)):
        i, j = groups[pinned[at, 0]], groups[pinned[at, 1]]
        if i != j:
            alive = _joined(min(i, j), max(i, j), alive, groups, totals, sizes, barred)
    far = np.sqrt(link * reach)
    first = -1
    while True:
        for i in alive:
            changed[i] = first < 0 or i == first
            if stale[i]:
                stale[i] = False
                before = nearest[i], second[i]
                nearest[i] = second[i] = np.inf
                for j in alive:
                    if j != i:
                        d = totals[i, j, 0] / (sizes[i] * sizes[j])
                        if d < nearest[i]:
                            nearest[i], second[i] = d, nearest[i]
                        elif d < second[i]:
                            second[i] = d
                changed[i] |= before != (nearest[i], second[i])
        news = alive[changed[alive]]
        first = -1
        for i in alive:
            others, partner = news, partners[i]
            if changed[i] or (partner >= 0 and (groups[partner] != partner or changed[partner])):
                others, doubts[i], partners[i] = alive, np.inf, -1
            for j in others:
                if j <= i or barred[i, j]:
                    continue
                pairs = sizes[i] * sizes[j]
                d = totals[i, j, 0] / pairs
                if d <= far and totals[i, j, 1] / pairs >= sided * d:
                    next_i = second[i] if d <= nearest[i] else nearest[i]
                    next_j = second[j] if d <= nearest[j] else nearest[j]
                    doubt = d * d / max(min(next_i, next_j, reach), 1e-12)
                    tied = doubt == doubts[i] and j < partners[i]
                    if doubt <= link and (doubt < doubts[i] or tied):
                        doubts[i], partners[i] = doubt, j
            if partners[i] >= 0 and (first < 0 or doubts[i] < doubts[first]):
                first = int(i)
        if first < 0:
            return groups
        other = partners[first]
        for k in alive:
            one = totals[first, k, 0] / (sizes[first] * sizes[k])
            nearer[k] = min(one, totals[other, k, 0] / (sizes[other] * sizes[k]))
        alive = _joined(first, other, alive, groups, totals, sizes, barred)
        for k in alive:
            mean = totals[first, k, 0] / (sizes[first] * sizes[k])
            stale[k] = nearer[k] <= second[k] or mean <= second[k]
        stale[first] = True


@njit(cache=True)
def _joined(
    first: int,
    other: int,
    alive: IntArray,
    groups: IntArray,
    totals: FloatArray,
    sizes: FloatArray,
    barred: BoolArray,
) -> IntArray:
    """Let one group take up another; return what is left."""
    sizes[first] += sizes[other]
    alive = alive[alive != other]
    for k in range(len(groups)):
        if groups[k] == other:
            groups[k] = first
    for k in alive:
        for part in range(2):
            totals[first, k, part] += totals[other, k, part]
            totals[k, first, part] = totals[first, k, part]
        barred[first, k] |= barred[other, k]
        barred[k, first] = barred[first, k]
    return alive

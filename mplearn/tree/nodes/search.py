"""The search for the node that a segment belongs to; tree and recogniser decide by it alike."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cache
from typing import Annotated, NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from ...maths.compiling import njit
from ...maths.sums import pairwise_sum
from ...recording import BoolArray, FloatArray, IntArray
from ...state import Array, Range, State, require, require_no_cycle
from ..config import TreeConfig
from ..distance import Exemplar
from ..exemplars.bank import ExemplarBank
from ..exemplars.slot_arrays import SlotArrays
from ..placement import ROOT, Match
from .node import Node

_KNOWN = np.dtype(
    [
        ("id", np.int64),
        ("parent", np.int64),
        ("is_leaf", np.bool_),
        ("diameter", np.float64),
        ("extent", np.float64),
        ("slot", np.int64),
        ("size", np.int64),
    ]
)


@dataclass(frozen=True, eq=False)
class IndexState(State):
    """What the search knows; attributes are those of `NodeIndex`, shape (n,) each.

    Attributes:
        parents: The node above each.
        diameters: Largest distance between the exemplars of each.
    """

    limit: Annotated[float, Range(0.0)]
    ids: Annotated[IntArray, Array("n", low=1)]
    parents: Annotated[IntArray, Array("n", low=0)]
    leaves: Annotated[BoolArray, Array("n")]
    members: tuple[tuple[int, ...], ...]
    diameters: Annotated[FloatArray, Array("n", low=0.0)]
    caps: Annotated[FloatArray, Array("n", low=0.0, high=np.inf)] | None = None

    def check(self) -> None:
        """Check that ids rise, that each node has exemplars once, and none lies below itself."""
        require(bool((np.diff(self.ids) > 0).all()), "ids", "must rise")
        require(len(self.members) == len(self.ids), "members", f"must be {len(self.ids)} lists")
        for k, group in enumerate(self.members):
            once = len(set(group)) == len(group) > 0
            require(once, f"members[{k}]", "must hold a number, and each once")
        parents = dict(zip(self.ids.tolist(), self.parents.tolist(), strict=True))
        require_no_cycle(parents, lambda id: f"parents[{list(parents).index(id)}]")


_Short: TypeAlias = NDArray[np.float32]
_NOWHERE = (ROOT,)
_ROOM = 16  # nodes that there is room for at first; twice as many, at least, when it is full
_YOUNG = 3  # exemplars of a leaf up to which little is known of how much executions vary
_YOUNG_GROWTH = np.array([1.0, 1.0, 1.35, 1.1, 1.0])
# by number of exemplars: the largest of a few distances is smaller than that of many


class Sight(NamedTuple):
    """What a search saw.

    Attributes:
        matches: The nodes that a segment was compared with, best first.
        distances: To all exemplars of those, shape (k,).
    """

    matches: list[Match]
    distances: FloatArray


class NodeIndex:
    """What the search knows of the nodes below the root; one more costs as much as one less.

    Args:
        config: Rules of the tree.
        bank: Holds the exemplars of the nodes.

    Attributes:
        limit: Largest radius.
        caps: Largest radius of each node, shape (n,); None for that of the rules.
        members: Numbers of the exemplars of each node, in the order of the nodes' ids.
    """

    def __init__(self, config: TreeConfig, bank: ExemplarBank) -> None:
        self.config = config
        self.limit = 0.0
        self.caps: FloatArray | None = None
        self.members: list[list[int]] = []
        self._ids: list[int] = []
        self._room = np.zeros(_ROOM, _KNOWN)
        self._n = 0
        self._leaf_ids: tuple[int, ...] | None = None
        self._widths: list[float] = []  # `_diameters` of the leaves, in order of size
        self._homes: dict[int, list[int]] | None = None  # nodes by exemplar, once it is asked for
        self._waves = _slow_waves(config.normalisation.n_points)
        n_values = bank.n_channels * len(self._waves)
        n_slow = bank.n_channels * self._waves.shape[1]
        # mean, `nearest_others`, the mean's slow part
        self._of_node = SlotArrays((n_values,), (config.max_exemplars,), (n_slow,), short=(2,))

    @property
    def _known(self) -> NDArray[np.void]:
        """What is known of each node, shape (n,); a view of its own in each copy of the index."""
        return self._room[: self._n]

    @property
    def ids(self) -> IntArray:
        """Ids of the nodes, in order, shape (n,)."""
        return np.asarray(self._known["id"])

    @property
    def leaves(self) -> NDArray[np.bool_]:
        """Which of them are leaves, shape (n,)."""
        return np.asarray(self._known["is_leaf"])

    @property
    def leaf_ids(self) -> tuple[int, ...]:
        """Ids of the leaves, in order."""
        if self._leaf_ids is None:
            self._leaf_ids = tuple(self.ids[self.leaves].tolist())
        return self._leaf_ids

    def leaves_below(self, size: int) -> list[int]:
        """Return the ids of the leaves that hold fewer exemplars than that, in order."""
        found: list[int] = self.ids[self.leaves & (self._known["size"] < size)].tolist()
        return found

    def nearest_others(self) -> FloatArray:
        """Return `nearest_others` of the leaves, in order, shape (n, K); NaN where there is none.

        Of nodes that were put here, not of those that a state described.
        """
        return self._of_node.gather(self._known["slot"][self.leaves], 1)

    def put(self, node: Node, bank: ExemplarBank) -> None:
        """Take note of a node: that it is there and is searched, or what has changed in it."""
        if node.parent is None or (self.config.n_candidates and not node.is_leaf):
            self.drop(node.id)
        else:
            facts = (node.id, node.parent, node.is_leaf, node.diameter)
            self.enter(facts, node.members, bank, node.matrix)

    def drop(self, id: int) -> None:
        """Forget a node, if it is known."""
        k = bisect_left(self._ids, id)
        if id not in self._ids[k : k + 1]:
            return
        self._of_node.release(int(self._known["slot"][k]))
        self._forget(k)
        self._leave(id, self.members[k])
        self._leaf_ids = None
        self._known[k:-1] = self._known[k + 1 :]
        self._n -= 1
        del self._ids[k], self.members[k]

    def enter(
        self,
        facts: tuple[int, int, bool, float],
        members: Sequence[int],
        bank: ExemplarBank,
        matrix: FloatArray | None = None,
    ) -> None:
        """Take note of a node: its id, its parent's, whether it is a leaf, its diameter.

        Args:
            facts: Those.
            members: Numbers of its exemplars.
            bank: Holds them.
            matrix: Distances among them, shape (k, k), for `nearest_others`.
        """
        k = bisect_left(self._ids, facts[0])
        if facts[0] in self._ids[k : k + 1]:
            self._forget(k)
        else:
            self._open(k)
            self._known[k] = (*facts, np.inf, self._of_node.take(), 0)
            self._ids.insert(k, facts[0])
            self.members.insert(k, [])
            self._leaf_ids = None
        known = self._known[k]
        if known["is_leaf"] != facts[2]:
            self._leaf_ids = None
        known["parent"], known["is_leaf"], known["diameter"] = facts[1:]
        if self.members[k] != members:
            self._leave(facts[0], self.members[k])
            self.members[k] = list(members)
            if self._homes is not None:
                for number in members:
                    insort(self._homes.setdefault(number, []), facts[0])
            known["size"] = len(members)
            known["extent"] = _mean_extents(bank, [members])[0]
            others = np.full(self.config.max_exemplars, np.nan)
            if matrix is not None and len(matrix) > 1:
                others[: len(matrix)] = nearest_others(matrix, self.config.n_nearest)
            mean = bank.mean_profile(members)
            self._of_node.write(int(known["slot"]), (mean, others, self._slow(mean)))
        if known["is_leaf"]:
            insort(self._widths, self._width(k))

    def _open(self, k: int) -> None:
        """Make room for a node at a place."""
        if self._n == len(self._room):
            more = np.zeros(max(self._n, _ROOM), _KNOWN)
            self._room = np.concatenate([self._room, more])
        self._n += 1
        self._known[k + 1 :] = self._known[k:-1]

    def _forget(self, k: int) -> None:
        """Take the width of a node, if it is a leaf, out of those that are known."""
        if self._known["is_leaf"][k]:
            del self._widths[bisect_left(self._widths, self._width(k))]

    def _width(self, k: int) -> float:
        """Return the diameter of the node at a place as `_diameters` has it."""
        return float(self._diameters(self._known[k : k + 1])[0])

    def _leave(self, id: int, members: Sequence[int]) -> None:
        """Take note that exemplars are no longer in a node."""
        homes = self._homes
        if homes is None:
            return
        for number in members:
            homes[number].remove(id)
            if not homes[number]:
                del homes[number]

    def homes(self, numbers: Collection[int]) -> list[int]:
        """Return the id of the node that each exemplar is in, the youngest of several.

        It is `ROOT` for what is in none.
        """
        if self._homes is None:
            self._homes = {}
            for id, members in zip(self._ids, self.members, strict=True):
                for number in members:
                    self._homes.setdefault(number, []).append(id)
        return [self._homes.get(number, _NOWHERE)[-1] for number in numbers]

    def remeasured(self, nodes: Mapping[int, Node], bank: ExemplarBank) -> None:
        """Take note of new distances in nodes, by id, and of the new models of their exemplars."""
        known, matrices = self._known, [nodes[id].matrix for id in self.ids.tolist()]
        sizes = np.array([len(matrix) for matrix in matrices], np.int64)
        for size in np.unique(sizes).tolist():
            places = np.flatnonzero(sizes == size)
            some = np.array([matrices[k] for k in places.tolist()])
            known["diameter"][places] = some.max(axis=(1, 2), initial=0.0)
            if size > 1:
                others = nearest_others(some, self.config.n_nearest)
                self._of_node.write_some(known["slot"][places], 1, others)
        known["extent"] = _mean_extents(bank, self.members)
        self._widths = sorted(self._diameters(known)[self.leaves].tolist())

    def scale(self, but: int | None = None) -> float:
        """Return the median diameter of the leaves, but for one: how much executions vary.

        It is 0 where there is no leaf.
        """
        k = len(self._ids) if but is None else bisect_left(self._ids, but)
        widths, n = self._widths, len(self._widths)
        gone = n
        if but in self._ids[k : k + 1] and self._known["is_leaf"][k]:
            gone, n = bisect_left(widths, self._width(k)), n - 1
        if not n:
            return 0.0
        low, high = ((m if m < gone else m + 1) for m in ((n - 1) // 2, n // 2))
        return (widths[low] + widths[high]) / 2

    def _diameters(self, known: NDArray[np.void]) -> FloatArray:
        """Return the diameters of some nodes, those of young ones as they will be, shape (k,)."""
        diameters = np.asarray(known["diameter"])
        if not self.config.young_reach:
            return diameters
        sizes = np.minimum(known["size"], len(_YOUNG_GROWTH) - 1)
        return np.asarray(diameters * _YOUNG_GROWTH[sizes])

    def radii(self) -> FloatArray:
        """Return the radius of each node: eq. 6, capped by the scale that the leaves share."""
        return self._radii(np.arange(len(self._ids)))

    def _radii(self, places: IntArray) -> FloatArray:
        """Return the radii of the nodes at some places."""
        config, known = self.config, self._known[places]
        radii = config.reach * self._diameters(known)
        if np.isfinite(config.reach_cap):
            radii = np.minimum(radii, min(config.reach_cap * self.scale(), self.limit))
            if np.isfinite(self.limit):
                young = known["size"] <= _YOUNG
                least = np.where(young, config.young_reach, config.least_reach)
                radii = np.minimum(np.maximum(radii, least * self.limit), self.limit)
        radii = np.minimum(radii, config.extent_share * known["extent"])
        return np.asarray(radii if self.caps is None else np.minimum(radii, self.caps[places]))

    def radius(self, id: int) -> float:
        """Return the radius of one node."""
        return float(self._radii(np.array([bisect_left(self._ids, id)]))[0])

    def search(self, exemplar: Exemplar, bank: ExemplarBank) -> list[Match]:
        """Return the nodes that a segment was compared with, best first.

        The first belongs to it if its ratio is at most 1.
        """
        return self.look(exemplar, bank).matches

    def look(self, exemplar: Exemplar, bank: ExemplarBank) -> Sight:
        """Search, and return all that was seen."""
        if not self._ids:
            return Sight([], np.zeros(0))
        if self.config.n_candidates:
            (places,) = self._candidates([exemplar], bank)
            return self._compare(exemplar, bank, places)
        return self._descend(exemplar, bank)

    def search_each(self, exemplars: Sequence[Exemplar], bank: ExemplarBank) -> list[list[Match]]:
        """Return what `search` does for each of some segments, which is quicker together."""
        if not exemplars or not self._ids or not self.config.n_candidates:
            return [self.search(each, bank) for each in exemplars]
        near = self._candidates(exemplars, bank)
        return [
            self._compare(each, bank, places).matches
            for each, places in zip(exemplars, near, strict=True)
        ]

    def others(self, exemplar: Exemplar, bank: ExemplarBank, but: int) -> list[Match]:
        """Return the leaves that a segment is near to, best first, but for one of them."""
        (near,) = self._candidates([exemplar], bank)
        return self._compare(exemplar, bank, near[self.ids[near] != but]).matches

    def near(self, exemplar: Exemplar, bank: ExemplarBank) -> list[int]:
        """Return the ids of the leaves that a segment may belong to, in order."""
        (near,) = self._candidates([exemplar], bank)
        found: list[int] = self.ids[near].tolist()
        return found

    def _candidates(self, exemplars: Sequence[Exemplar], bank: ExemplarBank) -> list[IntArray]:
        """Return the places of the leaves nearest to each of some segments by mean trajectory.

        All leaves if that is asked. No mean is nearer than its slow part is, which is short, and in
        single precision: few means are looked at in full.
        """
        if not self.config.n_candidates:
            return [np.flatnonzero(self.leaves)] * len(exemplars)
        if len(self._ids) <= self.config.n_candidates:
            return [np.arange(len(self._ids))] * len(exemplars)
        profiles = [bank.profile(each) for each in exemplars]
        slow = np.array([self._slow(each) for each in profiles])
        by_slot, end = np.empty((len(profiles), self._of_node.n_slots), np.float32), 0
        for _, _, parts in self._of_node.used():
            _all_squared_offsets(cast(_Short, parts), slow, by_slot[:, end : end + len(parts)])
            end += len(parts)
        at_least = by_slot[:, self._known["slot"]].astype(np.float64)
        at_least[~np.isfinite(at_least).all(axis=1)] = 0.0  # too large: all are looked at
        return [self._nearest(*each) for each in zip(profiles, slow, at_least, strict=True)]

    def _nearest(self, profile: FloatArray, slow: _Short, at_least: FloatArray) -> IntArray:
        """Return the places of the means that are nearest to a profile, in order of their ids."""
        n = self.config.n_candidates
        nearness, best, first = (
            np.full(len(at_least), np.inf),
            np.full(n, np.inf),
            _least(at_least, n),
        )
        self._measure(nearness, first, profile, best)
        size = float(np.square(slow, dtype=np.float64).sum())
        most = best[-1] + _ROUNDING * (len(slow) * best[-1] + 16 * size)
        near = at_least <= most
        near[first] = False
        self._measure(nearness, np.flatnonzero(near), profile, best)
        seen = np.flatnonzero(np.isfinite(nearness))
        return np.sort(seen[np.argsort(nearness[seen], kind="stable")[:n]])

    def _measure(
        self, nearness: FloatArray, places: IntArray, profile: FloatArray, best: FloatArray
    ) -> None:
        """Measure how near the means at some places are, as far as they are among the best."""
        for (means, _, _), rows, here in self._of_node.parted(self._known["slot"][places]):
            nearness[places[here]] = _squared_offsets(means, rows, profile, best)

    def _slow(self, profile: FloatArray) -> _Short:
        """Return the slow part of a profile, shape (D * P,) to (D * W,)."""
        waves = (profile.reshape(-1, len(self._waves)) @ self._waves).ravel()
        with np.errstate(over="ignore"):
            return np.asarray(waves, np.float32)

    def _compare(self, exemplar: Exemplar, bank: ExemplarBank, places: IntArray) -> Sight:
        row = bank.distances(exemplar, [m for k in places.tolist() for m in self.members[k]])
        known = self._known[places]
        radii = np.minimum(self._radii(places), self.config.extent_share * exemplar.extent)
        means = _group_means(row, known["size"].copy(), self.config.n_nearest)
        seen = zip(known["id"].tolist(), means.tolist(), radii.tolist(), strict=True)
        matches = [
            Match(id, bank.distance.divergence_of(mean), mean / max(radius, 1e-12))
            for id, mean, radius in seen
        ]
        return Sight(sorted(matches, key=lambda match: (match.ratio, match.node)), row)

    def _descend(self, exemplar: Exemplar, bank: ExemplarBank) -> Sight:
        found: list[Match] = []
        seen = np.zeros(0)
        level = ROOT
        while True:
            places = np.flatnonzero(self._known["parent"] == level)
            if not len(places):
                return Sight(found, seen)
            matches, row = self._compare(exemplar, bank, places)
            seen = np.concatenate([seen, row])
            inside = [match for match in matches if match.ratio <= 1]
            if not inside:
                return Sight(found + matches, seen)
            nearest = min(inside, key=lambda match: (match.distance, match.node))
            found = [nearest, *found]
            level = nearest.node

    def fork(self) -> NodeIndex:
        """Return an index that knows the same, and goes on apart; see `ExemplarBank.fork`."""
        twin = copy(self)
        twin._room, twin._n = self._known.copy(), self._n
        twin._ids, twin._widths, twin._homes = list(self._ids), list(self._widths), None
        twin.members = list(self.members)
        twin._of_node = self._of_node.fork()
        return twin

    def state(self) -> IndexState:
        """Return everything that the index knows."""
        return IndexState(
            limit=self.limit,
            caps=None if self.caps is None else self.caps.copy(),
            ids=self.ids.copy(),
            parents=self._known["parent"].copy(),
            leaves=self.leaves.copy(),
            members=tuple(map(tuple, self.members)),
            diameters=self._known["diameter"].copy(),
        )

    @classmethod
    def from_state(cls, config: TreeConfig, bank: ExemplarBank, state: IndexState) -> NodeIndex:
        """Return the index that `state` described."""
        index = cls(config, bank)
        index.limit = state.limit
        index.caps = None if state.caps is None else state.caps.copy()
        columns = (state.ids, state.parents, state.leaves, state.diameters)
        rows = zip(*(each.tolist() for each in columns), state.members, strict=True)
        for id, parent, is_leaf, diameter, members in rows:
            index.enter((id, parent, is_leaf, diameter), list(members), bank)
        return index


def mean_nearest(distances: FloatArray, n_nearest: int) -> FloatArray:
    """Return the mean of the smallest distances along the last axis, (..., k) -> (...)."""
    return np.asarray(np.sort(distances, axis=-1)[..., :n_nearest].mean(axis=-1))


def nearest_others(matrix: FloatArray, n_nearest: int) -> FloatArray:
    """Return how far each of at least two exemplars is from the nearest others.

    Of one group, or of several that are as large: (..., k, k) -> (..., k).
    """
    k = matrix.shape[-1]
    found = _nearest_others(np.array(matrix, dtype=np.float64).reshape(-1, k, k), n_nearest)
    return np.asarray(found.reshape(matrix.shape[:-1]))


@njit(cache=True)
def _nearest_others(matrices: FloatArray, n_nearest: int) -> FloatArray:
    """Return `nearest_others` of groups that are as large, (g, k, k) -> (g, k)."""
    found = np.empty(matrices.shape[:2])
    for g, matrix in enumerate(matrices):
        for i, row in enumerate(matrix):
            row[i] = np.inf
            nearest = np.sort(row)[: min(n_nearest, len(row) - 1)]
            found[g, i] = pairwise_sum(nearest) / len(nearest)
    return found


@njit(cache=True)
def _group_means(distances: FloatArray, sizes: IntArray, n_nearest: int) -> FloatArray:
    """Return `mean_nearest` of each of some groups that stand one after the other, shape (g,)."""
    means = np.empty(len(sizes))
    first = 0
    for k, size in enumerate(sizes):
        nearest = np.sort(distances[first : first + size])[:n_nearest]
        means[k] = nearest.sum() / len(nearest)
        first += size
    return means


def _mean_extents(bank: ExemplarBank, groups: Sequence[Sequence[int]]) -> FloatArray:
    """Return the mean extent of the exemplars of each group, shape (n,)."""
    sizes = np.array([len(group) for group in groups], np.int64)
    extents = bank.extents([number for group in groups for number in group])
    return np.asarray(np.add.reduceat(extents, np.cumsum(sizes) - sizes) / sizes)


_N_WAVES = 6  # that motions, and two of them in one, mostly consist of
_ROUNDING = 2.0**-24  # of each sum of so many squares, and of the squares' numbers


@cache
def _slow_waves(n_points: int) -> FloatArray:
    """Return the slowest cosine waves over some points, orthonormal, shape (P, W) [Ahmed1974]."""
    n_waves = min(_N_WAVES, n_points)
    waves = np.cos(np.pi * np.outer(np.arange(n_points) + 0.5, np.arange(n_waves)) / n_points)
    return np.asarray(waves / np.sqrt((waves**2).sum(axis=0)))


@njit(cache=True, fastmath={"reassoc", "contract"})
def _all_squared_offsets(means: _Short, profiles: _Short, out: _Short) -> None:
    """Write the squared distances of means (n, F) to profiles (k, F) to ``out``, shape (k, n).

    They are right but for rounding: sums are taken in any order, which is much faster.
    """
    for i in range(means.shape[0]):
        for k in range(profiles.shape[0]):
            total = np.float32(0.0)
            for f in range(means.shape[1]):
                offset = means[i, f] - profiles[k, f]
                total += offset * offset
            out[k, i] = total


@njit(cache=True)
def _least(values: FloatArray, n: int) -> IntArray:
    """Return where the n least of more values are, the least first."""
    least, places = np.full(n, np.inf), np.zeros(n, np.int64)
    for k, value in enumerate(values):
        if value < least[-1]:
            at = n - 1
            while at > 0 and least[at - 1] > value:
                least[at], places[at] = least[at - 1], places[at - 1]
                at -= 1
            least[at], places[at] = value, k
    return places


_PART = 64  # values after which it is asked whether the sum is too large already


@njit(cache=True)
def _squared_offsets(
    means: FloatArray, rows: IntArray, profile: FloatArray, best: FloatArray
) -> FloatArray:
    """Return the squared distance of some means (n, F) to a profile (F,), shape (k,).

    It is inf for those that are not among the least: as many as ``best`` holds, which are the least
    of former calls, in order, and then of this one as well.
    """
    out = np.full(len(rows), np.inf)
    n = len(profile)
    for k, row in enumerate(rows):
        mean = means[row]
        a = b = c = d = 0.0  # four sums at once, in an order of their own
        for part in range(0, n, _PART):
            end = min(part + _PART, n)
            for f in range(part, end - 3, 4):
                a += (mean[f] - profile[f]) ** 2
                b += (mean[f + 1] - profile[f + 1]) ** 2
                c += (mean[f + 2] - profile[f + 2]) ** 2
                d += (mean[f + 3] - profile[f + 3]) ** 2
            for f in range(end - (end - part) % 4, end):
                a += (mean[f] - profile[f]) ** 2
            if a + b + c + d > best[-1]:
                break
        else:
            out[k] = total = a + b + c + d
            place = np.searchsorted(best, total)
            if place < len(best):
                best[place + 1 :] = best[place:-1].copy()
                best[place] = total
    return out

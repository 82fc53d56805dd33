"""The incremental tree of motion primitives [Kulic2012, 2.2, figure 2]."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InvalidValueError, UnknownPrimitiveError
from ..hmm import LeftRightHMM, fit
from ..hmm.sequences import as_frames
from ..recording import FloatArray
from . import form
from .bank import ExemplarBank
from .clustering import clusters_below, separation, two_branches
from .config import TreeConfig
from .node import Node
from .placement import ROOT, Match, Merge, Placement, Split
from .recogniser import Recogniser, refusal
from .search import NodeIndex, mean_nearest
from .spread import ChannelSpread, DistanceSample, moments

_SHORTEST_S = 0.1
_RESCALE = 1.2  # models are made again when the variance of all motion has changed by this factor
_MODEL_FLOOR = 0.1  # smallest standard deviation of a primitive's model, as a share of all motion's


class PrimitiveTree:
    """Groups segments by similarity as they come; its leaves are the motion primitives.

    Every decision is deterministic. A leaf keeps its id for life.

    Args:
        config: The rules.
        n_channels: Channels of a frame, D.
        rate_hz: Frames per second [1/s].
        groups: A group number for each channel, 0, 1, ...; channels of a group share one variance,
            so they should share a unit. By default all do.

    Raises:
        InvalidValueError: A value is out of range.
    """

    def __init__(
        self,
        config: TreeConfig,
        n_channels: int,
        rate_hz: float,
        groups: Sequence[int] | None = None,
    ) -> None:
        if n_channels < 1 or not (np.isfinite(rate_hz) and rate_hz > 0):
            raise InvalidValueError(
                f"n_channels >= 1 and rate_hz > 0 are needed, not {n_channels} and {rate_hz}"
            )
        numbers = np.zeros(n_channels, np.int64) if groups is None else np.array(groups, np.int64)
        if numbers.shape != (n_channels,) or numbers.min() < 0:
            raise InvalidValueError(f"groups must be {n_channels} numbers >= 0, not {groups}")
        self.config = config
        self.n_channels = n_channels
        self.rate_hz = rate_hz
        self.groups = tuple(int(group) for group in numbers)
        self.n_seen = 0
        self._next_id = ROOT + 1
        self._spread = ChannelSpread(numbers)
        self._sample = DistanceSample(config.n_sampled, config.seed)
        self._bank = ExemplarBank(config, n_channels, np.ones(n_channels))
        self._frames: dict[int, FloatArray] = {}
        self._holds: Counter[int] = Counter()
        self._nodes = {ROOT: Node(ROOT, None, 0)}
        self._index = NodeIndex(config, self._bank, (), 0.0)
        self._models: dict[int, tuple[tuple[int, ...], LeftRightHMM]] = {}

    # ---- looking

    @property
    def leaves(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""
        return tuple(id for id, node in self._nodes.items() if id != ROOT and node.is_leaf)

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes, the root first, in the order of their birth."""
        return tuple(self._nodes.values())

    def node(self, id: int) -> Node:
        """Return a node.

        Raises:
            UnknownPrimitiveError: There is none of this id.
        """
        if id not in self._nodes:
            raise UnknownPrimitiveError(f"no node {id} in the tree; it holds {list(self._nodes)}")
        return self._nodes[id]

    def radius(self, id: int) -> float:
        """Return the radius of a node below the root, on the scale of the rules."""
        self.node(id)
        return float(self._index.radii()[self._index.ids == id][0])

    def exemplars(self, id: int) -> tuple[FloatArray, ...]:
        """Return the kept segments of a node as they came, shape (L, D) each."""
        return tuple(self._frames[number] for number in self.node(id).members)

    def model(self, id: int) -> LeftRightHMM:
        """Return a node's group model: fitted to its exemplars as they came, at their rate.

        It has fewer states than configured where an exemplar is shorter than those.
        """
        members = tuple(self.node(id).members)
        known = self._models.get(id)
        if known is None or known[0] != members:
            frames = [self._frames[number] for number in members]
            n_states = min(self.config.n_states, *(len(each) for each in frames))
            floor = _MODEL_FLOOR**2 * self._spread.variances()
            self._models[id] = members, fit(frames, n_states, variance_floor=floor)
        return self._models[id][1]

    def recogniser(self) -> Recogniser:
        """Return what the tree would recognise now, frozen."""
        numbers = {number for group in self._index.members for number in group}
        bank = self._bank.subset(numbers)
        index = NodeIndex.from_state(self.config, bank, self._index.state())
        return Recogniser(self.config, bank, index, self._shortest_frames)

    # ---- learning

    def insert(self, frames: FloatArray) -> Placement:
        """Place a segment, shape (L, D), and let the tree grow.

        A segment that is too short for a motion, or lacks a channel for most of the time, is
        refused: it changes nothing.

        Raises:
            FrameError: The frames have another width, or hold infinite values.
        """
        frames = as_frames(frames, self.n_channels).copy()
        reason = refusal(frames, self._shortest_frames)
        if reason:
            return Placement(-1, ROOT, False, np.inf, np.inf, refused=reason)
        points = form.points_of(frames, self.config.form)
        self._spread.update(points)
        if self.n_seen == 0:
            self._rescale()
        number = self.n_seen
        self.n_seen += 1
        self._remember(number, points, frames)
        matches = self._index.search(self._bank[number], self._bank)
        distance, ratio = (matches[0].distance, matches[0].ratio) if matches else (np.inf, np.inf)
        node = self._nodes[matches[0].node if ratio <= 1 else ROOT]
        recognised = node.id != ROOT and node.is_leaf
        self._add(node, number)
        born, splits, moved = self._grow(node)
        merges = () if splits or not recognised else self._merge(matches)
        self._release(number)
        self._rescale()
        self._index.limit = self.config.reach_limit * self._common_scale()
        home = next((to for which, to in moved if which == number), node.id)
        home = next((merge.kept for merge in merges if merge.absorbed == home), home)
        others = tuple(move for move in moved if move[0] != number)
        return Placement(number, home, recognised, distance, ratio, born, splits, merges, others)

    def _remember(self, number: int, points: FloatArray, frames: FloatArray) -> None:
        """Model a segment; it is held until released."""
        self._bank.add(number, self._bank.model(form.centred(points, self.config.form)))
        self._frames[number] = frames
        self._hold(number)
        place = self._sample.place_for(number)
        if place is not None:
            self._hold(number)
            gone = self._sample.put(number, place, self._bank)
            if gone is not None:
                self._release(gone)

    def _rescale(self) -> None:
        """Model all exemplars again where the variance of all motion has changed much."""
        floor = self.config.variance_floor**2 * self._spread.variances()
        change = floor / self._bank.floor
        if change.max() <= _RESCALE and change.min() >= 1 / _RESCALE:
            return
        self._bank.refit(floor)
        self._sample.measure(self._bank)
        for node in self._nodes.values():
            node.matrix = self._bank.matrix(node.members)
        self._reindex()

    def _add(self, node: Node, number: int) -> None:
        node.add(number, self._bank.distances(self._bank[number], node.members))
        node.n_placed += 1
        node.n_frames += len(self._frames[number])
        self._hold(number)
        if node.id == ROOT:
            excess = len(node.members) - self.config.max_unplaced
            self._release(*node.remove(list(range(excess))))
        else:
            self._release(*node.thin(self.config.max_exemplars))
            if not self.config.n_candidates or node.is_leaf:
                self._index.update(node, self._bank)

    def _grow(
        self, node: Node
    ) -> tuple[tuple[int, ...], tuple[Split, ...], tuple[tuple[int, int], ...]]:
        """Form what can be formed in a node that grew."""
        if node.id != ROOT and not self.config.local:
            return self._split(node)
        born: list[int] = []
        moved: list[tuple[int, int]] = []
        while True:
            loose = [i for i, number in enumerate(node.members) if number not in node.settled]
            groups = clusters_below(
                node.matrix[np.ix_(loose, loose)], self._cutoff(node), self.config.min_exemplars
            )
            if not groups:
                return tuple(born), (), tuple(moved)
            members = [node.members[loose[i]] for i in groups[0]]
            rest = np.delete(np.arange(len(node.members)), [loose[i] for i in groups[0]])
            apart = node.matrix[np.ix_(rest, [loose[i] for i in groups[0]])]
            child = self._child(node, members)
            born.append(child.id)
            moved += [(number, child.id) for number in members]
            if node.id == ROOT and not self.config.local:
                moved += self._reassign(child, mean_nearest(apart, self.config.n_nearest))

    def _cutoff(self, node: Node) -> float:
        """Return the largest distance inside a cluster that becomes a node, D_cutoff."""
        if self.config.local:
            mu, sigma = moments(node.matrix)
            return mu - self.config.cutoff * sigma
        return self._common_scale()

    def _common_scale(self) -> float:
        return self._sample.scale(self.config.spread, self.config.mean_share)

    def _child(self, parent: Node, members: Sequence[int]) -> Node:
        """Form a node below another from some of its exemplars."""
        child = Node(self._next_id, parent.id, self.n_seen, history=[("born", self.n_seen)])
        self._next_id += 1
        places = [parent.members.index(number) for number in members]
        child.members = list(members)
        child.matrix = parent.matrix[np.ix_(places, places)]
        child.n_placed = len(members)
        child.n_frames = sum(len(self._frames[number]) for number in members)
        self._hold(*members)
        if parent.id == ROOT:
            self._release(*parent.remove(places))
        else:
            parent.settled.update(members)
        self._nodes[child.id] = child
        parent.children.append(child.id)
        self._release(*child.thin(self.config.max_exemplars))
        self._reindex()
        return child

    def _reassign(self, leaf: Node, row: FloatArray) -> list[tuple[int, int]]:
        """Move what waits in the root, ``row`` from a leaf that was just formed, into it."""
        root = self._nodes[ROOT]
        inside = [root.members[i] for i in np.flatnonzero(row <= self.radius(leaf.id))]
        for number in inside:
            self._add(leaf, number)
            self._release(*root.remove([root.members.index(number)]))
        return [(number, leaf.id) for number in inside]

    def _split(
        self, leaf: Node
    ) -> tuple[tuple[int, ...], tuple[Split, ...], tuple[tuple[int, int], ...]]:
        """Split a leaf whose two branches lie too far apart."""
        branches = two_branches(leaf.matrix, self.config.min_branch)
        if branches is None:
            return (), (), ()
        ratio = separation(leaf.matrix, *branches)
        between = float(leaf.matrix[np.ix_(*branches)].mean())
        usual = self._index.scale(but=leaf.id)
        if ratio <= self.config.split_ratio or between <= self.config.split_scale * usual:
            return (), (), ()
        leaf.history.append(("split", self.n_seen))
        groups = [[leaf.members[i] for i in branch] for branch in branches]
        shares = [len(group) / len(leaf.members) for group in groups]
        into = []
        moved = []
        for group, share in zip(groups, shares, strict=True):
            child = self._child(leaf, group)
            child.n_placed = max(len(group), round(share * leaf.n_placed))
            child.n_frames = round(leaf.n_frames / leaf.n_placed * child.n_placed)
            into.append(child.id)
            moved += [(number, child.id) for number in group]
        return tuple(into), (Split(leaf.id, tuple(into)),), tuple(moved)

    def _merge(self, matches: Sequence[Match]) -> tuple[Merge, ...]:
        """Merge the two leaves that a segment lies in, if they are no farther apart than inside."""
        inside = [match.node for match in matches if match.ratio <= 1]
        if len(inside) < 2 or self.config.local:
            return ()
        older, younger = sorted((self._nodes[id] for id in inside[:2]), key=lambda node: node.id)
        rows = [self._bank.distances(self._bank[n], younger.members) for n in older.members]
        across = np.stack(rows)
        joint = np.block([[older.matrix, across], [across.T, younger.matrix]])
        first, second = np.split(np.arange(len(joint)), [len(older.members)])
        if separation(joint, first, second) >= self.config.merge_ratio:
            return ()
        older.matrix = joint
        older.members += younger.members
        older.n_placed += younger.n_placed
        older.n_frames += younger.n_frames
        older.history.append(("merged", self.n_seen))
        self._remove(younger)
        self._release(*older.thin(self.config.max_exemplars))
        self._reindex()
        return (Merge(older.id, younger.id),)

    def _remove(self, node: Node) -> None:
        """Take a leaf out of the tree, and what is above it and holds nothing else."""
        del self._nodes[node.id]
        self._models.pop(node.id, None)
        parent = self._nodes[node.parent if node.parent is not None else ROOT]
        parent.children.remove(node.id)
        if parent.id != ROOT and not parent.children:
            self._release(*parent.members)
            self._remove(parent)

    # ---- keeping

    def state(self) -> dict[str, Any]:
        """Return all of the state, plain values and arrays: `load_state` resumes bit for bit."""
        return {
            "n_seen": self.n_seen,
            "next_id": self._next_id,
            "spread": self._spread.state(),
            "sample": self._sample.state(),
            "bank": self._bank.state(),
            "frames": [self._frames[number].copy() for number in self._bank.numbers()],
            "nodes": [node.state() for node in self._nodes.values()],
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned, under the same configuration."""
        self.n_seen = int(state["n_seen"])
        self._next_id = int(state["next_id"])
        self._spread.load_state(state["spread"])
        self._sample.load_state(state["sample"])
        self._bank = ExemplarBank.from_state(self.config, state["bank"])
        self._frames = {
            number: np.array(frames, dtype=np.float64)
            for number, frames in zip(self._bank.numbers(), state["frames"], strict=True)
        }
        nodes = [Node.from_state(node) for node in state["nodes"]]
        self._nodes = {node.id: node for node in nodes}
        self._holds = Counter(self._sample.numbers)
        for node in nodes:
            self._holds.update(node.members)
        self._models = {}
        self._reindex()

    def _hold(self, *numbers: int) -> None:
        self._holds.update(numbers)

    def _release(self, *numbers: int) -> None:
        self._holds.subtract(numbers)
        for number in numbers:
            if self._holds[number] == 0:
                del self._holds[number], self._frames[number]
                self._bank.drop(number)

    def _reindex(self) -> None:
        limit = self.config.reach_limit * self._common_scale()
        self._index = NodeIndex(self.config, self._bank, self._nodes.values(), limit)

    @property
    def _shortest_frames(self) -> int:
        return max(2, round(_SHORTEST_S * self.rate_hz))

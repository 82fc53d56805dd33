"""The incremental tree of motion primitives [Kulic2012, 2.2, figure 2]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InvalidValueError, UnknownPrimitiveError
from ..hmm import FactorialHMM, LeftRightHMM
from ..hmm.sequences import as_frames
from ..recording import FloatArray
from .births import form_primitives
from .config import TreeConfig
from .editing import chosen_groups, leaf_of, pair_of, place_below
from .memory import SegmentMemory
from .models import GroupModels
from .node import Node
from .placement import ROOT, Change, Placement
from .recogniser import Recogniser, refusal
from .revision import merge_duplicates, split_mixed
from .search import NodeIndex
from .structure import Structure

_SHORTEST_S = 0.1
_LONGEST_S = 60.0
_LIKENESS = 1.1  # largest distance over the tree's scale at which two segments may show one motion


class PrimitiveTree:
    """Groups segments by similarity as they come; its leaves are the motion primitives.

    Every decision is deterministic. A leaf keeps its id for life. `insert` follows the rules; a
    person can `split`, `merge`, `reparent` and `remove` by hand, which the rules then respect.

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
        self._memory = SegmentMemory(config, numbers)
        self._structure = Structure(config, self._memory)
        self._models = GroupModels(config, self._structure)

    # ---- looking

    @property
    def leaves(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""
        return tuple(node.id for node in self.nodes if node.id != ROOT and node.is_leaf)

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes, the root first, in the order of their birth."""
        return tuple(self._structure.nodes.values())

    def node(self, id: int) -> Node:
        """Return a node.

        Raises:
            UnknownPrimitiveError: There is none of this id.
        """
        nodes = self._structure.nodes
        if id not in nodes:
            raise UnknownPrimitiveError(f"no node {id} in the tree; it holds {list(nodes)}")
        return nodes[id]

    def radius(self, id: int) -> float:
        """Return the radius of a node below the root, on the scale of the rules."""
        self.node(id)
        index = self._structure.index
        if id not in index.ids:
            raise UnknownPrimitiveError(
                f"node {id} is not searched and has no radius; {index.ids.tolist()} have one"
            )
        return index.radius(id)

    def exemplars(self, id: int) -> tuple[FloatArray, ...]:
        """Return the kept segments of a node as they came, shape (L, D) each."""
        return tuple(self._memory.frames[number] for number in self.node(id).members)

    def model(self, id: int) -> LeftRightHMM:
        """Return a node's group model: fitted to its exemplars as they came, at their rate.

        It has fewer states than configured where an exemplar is shorter than those; where the
        motion has more chains than one, it goes through the combinations that they visit.

        Raises:
            UnknownPrimitiveError: There is none of this id.
        """
        model = self.chains(id)
        return model.left_right() if isinstance(model, FactorialHMM) else model

    def chains(self, id: int) -> LeftRightHMM | FactorialHMM:
        """Return a node's group model with all its chains.

        There are more than one where ``max_chains`` allows it and a primitive cannot be told apart
        from its neighbour by one [Kulic2008b].

        Raises:
            UnknownPrimitiveError: There is none of this id.
        """
        self.node(id)
        return self._models.of(id)

    def recogniser(self) -> Recogniser:
        """Return what the tree would recognise now, frozen; at the stated rate, if there is one."""
        index = self._structure.index
        numbers = {number for group in index.members for number in group}
        bank = self._memory.bank.subset(numbers)
        known = NodeIndex.from_state(self.config, bank, index.state())
        frozen = Recogniser(self.config, bank, known, self._shortest_frames)
        return frozen.calibrated(self.config.false_acceptance)

    # ---- learning

    def insert(self, frames: FloatArray) -> Placement:
        """Place a segment, shape (L, D), and let the tree grow.

        A segment that is too short or too long for a motion, or lacks a channel for most of the
        time, is refused: it changes nothing.

        Raises:
            FrameError: The frames have another width, or hold infinite values.
        """
        frames = as_frames(frames, self.n_channels)
        longest = round(_LONGEST_S * self.rate_hz)
        reason = refusal(frames, self._shortest_frames, longest)
        if reason:
            return Placement(-1, ROOT, False, np.inf, np.inf, refused=reason)
        structure, bank, number = self._structure, self._memory.bank, self.n_seen
        self.n_seen += 1
        self._memory.remember(number, frames.copy())
        matches = structure.index.search(bank[number], bank)
        distance, ratio = (matches[0].distance, matches[0].ratio) if matches else (np.inf, np.inf)
        node = self.node(matches[0].node if ratio <= 1 else ROOT)
        recognised = node.id != ROOT and node.is_leaf
        structure.add(node, number)
        like = self._waiting_like(node)
        if node.id == ROOT or self.config.local:
            change = form_primitives(structure, node, self.n_seen)
        else:
            change = split_mixed(structure, node, self.n_seen)
            if not change.splits:
                change = merge_duplicates(structure, matches, self.n_seen)
        self._memory.release(number)
        if self._memory.rescale():
            structure.remeasure()
        structure.tune()
        self._models.forget()
        home = next((to for which, to in change.moved if which == number), node.id)
        home = next((merge.kept for merge in change.merges if merge.absorbed == home), home)
        others = tuple(move for move in change.moved if move[0] != number)
        return Placement(
            number,
            home,
            recognised,
            distance,
            ratio,
            **change._replace(moved=others)._asdict(),
            nearest=matches[0].node if matches else None,
            like=like,
        )

    # ---- learning by hand

    def split(self, id: int, groups: Sequence[Sequence[int]] | None = None) -> Change:
        """Split a primitive, which the rules never merge again.

        Args:
            id: The primitive.
            groups: Positions in `exemplars` that belong together, at least 2 each and every one in
                one group; the two main branches of complete-link clustering where not given.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
            InvalidValueError: The groups are wrong, or there are too few exemplars.
        """
        leaf = leaf_of(self._structure, id)
        numbers = chosen_groups(leaf, groups)
        change = self._structure.split(leaf, numbers, self.n_seen)
        for born in change.born:
            self.node(born).apart = set(change.born) - {born}
        return self._edited(change)

    def merge(self, first: int, second: int) -> Change:
        """Merge two primitives into the older one, which the rules never split again.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
            InvalidValueError: They are the same.
        """
        older, younger = pair_of(self._structure, first, second)
        joint = self._structure.joint(older, younger)
        change = self._structure.merge(older, younger, joint, self.n_seen)
        older.whole = True
        older.apart.discard(older.id)
        return self._edited(change)

    def reparent(self, id: int, parent: int) -> Change:
        """Hang a node below the root or another inner node.

        Raises:
            UnknownPrimitiveError: There is no such node.
            InvalidValueError: The parent is a primitive, or lies below the node.
        """
        node, above = place_below(self._structure, id, parent)
        return self._edited(self._structure.reparent(node, above, self.n_seen))

    def remove(self, id: int, *, forget: bool = False) -> Change:
        """Take a primitive out; its exemplars wait to be placed again, unless they are forgotten.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
        """
        leaf = leaf_of(self._structure, id)
        return self._edited(self._structure.remove(leaf, self.n_seen, forget=forget))

    def _edited(self, change: Change) -> Change:
        self._structure.tune()
        self._models.forget()
        return change

    # ---- keeping

    def state(self) -> dict[str, Any]:
        """Return all of the state, plain values and arrays: `load_state` resumes bit for bit."""
        return {
            "n_seen": self.n_seen,
            "next_id": self._structure.next_id,
            **self._memory.state(),
            "nodes": [node.state() for node in self.nodes],
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned, under the same configuration."""
        nodes = [Node.from_state(node) for node in state["nodes"]]
        self.n_seen = int(state["n_seen"])
        self._memory.load_state(state, [number for node in nodes for number in node.members])
        self._structure = Structure(self.config, self._memory)
        self._structure.next_id = int(state["next_id"])
        self._structure.nodes = {node.id: node for node in nodes}
        self._structure.reindex()
        self._structure.tune()
        self._models = GroupModels(self.config, self._structure)

    def _waiting_like(self, node: Node) -> int | None:
        """Return what the newest segment of the root is most like among those before it."""
        if node.id != ROOT or len(node.members) < 2:
            return None
        row = node.matrix[-1, :-1]
        nearest = int(row.argmin())
        alike = row[nearest] <= _LIKENESS * self._memory.scale()
        return node.members[nearest] if alike else None

    @property
    def _shortest_frames(self) -> int:
        return max(2, round(_SHORTEST_S * self.rate_hz))

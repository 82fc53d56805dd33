"""The primitives that people share: which leaves they are made of."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..recording import FloatArray, IntArray
from ..state import Array, Count, Range, State, require, require_no_cycle
from ..tree import ROOT, MirrorMap, Node, PrimitiveTree, TreeConfig
from ..tree.node import Happening
from .config import PeopleConfig
from .leaf import Leaf, LeafState
from .links import Known, solve
from .nodes import nodes_of
from .offsets import offsets_of
from .pins import Pins, PinsState
from .shape_table import ShapeTable
from .shapes import Shape, shape_of
from .waiting import Waiting, WaitingRoom, WaitingState


@dataclass(frozen=True, eq=False)
class NumbersState(State):
    """Numbers of segments in a person's tree, and in the tree of all people, shape (n,) each."""

    person: Count
    there: Annotated[IntArray, Array("n", low=0)]
    here: Annotated[IntArray, Array("n", low=0)]


@dataclass(frozen=True, eq=False)
class AboveState(State):
    """A node above primitives; attributes are those of `Node`."""

    id: Annotated[int, Range(1)]
    born_at: Count
    history: tuple[tuple[Happening, Count], ...]


@dataclass(frozen=True, eq=False)
class OffsetState(State):
    """A person's usual deviation in posture, shape (D,)."""

    person: Count
    offset: Annotated[FloatArray, Array(None)]


@dataclass(frozen=True, eq=False)
class SharingState(State):
    """What people share; attributes are those of `SharedPrimitives`."""

    next_id: Annotated[int, Range(1)]
    n_seen: Count
    unit: Annotated[float, Range(0.0, math.inf)]
    leaves: tuple[LeafState, ...]
    waiting: tuple[WaitingState, ...]
    numbers: tuple[NumbersState, ...]
    above: tuple[AboveState, ...]
    parents: tuple[tuple[Count, Count], ...]
    pins: PinsState
    offsets: tuple[OffsetState, ...]

    def check(self) -> None:
        """Check that ids name what is there."""
        keys = {(leaf.person, leaf.local) for leaf in self.leaves}
        require(len(keys) == len(self.leaves), "leaves", "must differ")
        primitives = {leaf.primitive for leaf in self.leaves}
        above = {node.id for node in self.above}
        named = {leaf.id for leaf in self.leaves} | primitives | above
        founded = {leaf.founded for leaf in self.leaves}
        require(max(named | founded, default=0) < self.next_id, "next_id", "must exceed all ids")
        require(len(above) == len(self.above), "above", "must differ")
        require(not above & primitives, "above", "must be no primitives")
        parents: dict[int, int | None] = dict(self.parents)
        require(
            len(parents) == len(self.parents) and parents.keys() == above | primitives,
            "parents",
            f"must be of {sorted(above | primitives)}, each once, not {sorted(parents)}",
        )
        for k, (id, parent) in enumerate(self.parents):
            require(
                parent == ROOT or parent in above,
                f"parents[{k}]",
                f"node {id} must lie below one of {sorted({ROOT, *above})}, not {parent}",
            )
        require_no_cycle(parents, lambda id: f"parents[{list(parents).index(id)}]")
        for k, each in enumerate(self.waiting):
            require(each.primitive in primitives, f"waiting[{k}].primitive", "must be a primitive")
        waiting = {(each.person, each.primitive) for each in self.waiting}
        require(len(waiting) == len(self.waiting), "waiting", "must differ")
        for name in ("together", "apart"):
            for k, pair in enumerate(getattr(self.pins, name)):
                require(keys.issuperset(pair), f"pins.{name}[{k}]", "must name leaves")
        seen: set[int] = set()
        for k, own in enumerate(self.numbers):
            here = set(own.here.tolist())
            fine = len(here) == len(own.here) == len(set(own.there.tolist()))
            require(
                fine and not here & seen and max(here, default=-1) < self.n_seen,
                f"numbers[{k}]",
                f"must differ from all others, and be below {self.n_seen}",
            )
            seen |= here


class SharedPrimitives:
    """Keeps the primitives that the leaves of several people's trees make up.

    Nothing here decides when what changes: see `sharing`, `editing` and `mplearn.merging`.

    Args:
        config: Rules of the trees.
        rules: What makes motions of different people one primitive.
        trees: Each person's tree; one for now, others may be added by the owner.
        next_id: First id that was never used.
        mirror: Which channel is the mirror image of which; None where none is.

    Attributes:
        leaves: Leaves of all people.
        pins: What a person said of them.
        above: Nodes above primitives: what was split.
        parents: The node above each of those, and of each primitive.
        numbers: Person -> number of a segment in that person's tree -> number here.
        table: The shapes.
        waiting: What joined primitives of others.
        unit: The unit of distance (`links.unit_of`).
    """

    def __init__(
        self,
        config: TreeConfig,
        rules: PeopleConfig,
        trees: dict[int, PrimitiveTree],
        next_id: int,
        mirror: MirrorMap | None = None,
    ) -> None:
        self.config = config
        self.rules = rules
        self.trees = trees
        self.next_id = next_id
        self.n_seen = 0
        self.leaves: list[Leaf] = []
        self.pins = Pins()
        self.above: dict[int, Node] = {}
        self.parents: dict[int, int] = {}
        self.numbers: dict[int, dict[int, int]] = {}
        self.table = ShapeTable(mirror)
        self.waiting = WaitingRoom(self.table)
        self._offsets: dict[int, FloatArray] = {}
        self.unit = float("inf")
        for person, tree in trees.items():
            self.n_seen = tree.n_seen
            self.numbers[person] = {n: n for node in tree.nodes for n in node.members}
            for node in tree.nodes:
                if node.id == ROOT:
                    continue
                self.parents[node.id] = node.parent or ROOT
                if node.is_leaf:
                    leaf = self.new_leaf(person, node.id)
                    leaf.id = leaf.primitive = leaf.founded = node.id
                else:
                    self.above[node.id] = node
        if self.leaves:
            self.regroup()

    # ---- looking

    @property
    def primitives(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""
        return tuple(sorted({leaf.primitive for leaf in self.leaves}))

    def leaves_of(self, id: int) -> list[Leaf]:
        """Return the leaves of a primitive, or that one leaf."""
        return [leaf for leaf in self.leaves if id in (leaf.id, leaf.primitive)]

    def own(self) -> set[tuple[int, int]]:
        """Return person and primitive of all leaves."""
        return {(leaf.person, leaf.primitive) for leaf in self.leaves}

    def distances(self, leaves: Sequence[Leaf]) -> FloatArray:
        """Return the distances among some leaves, shape (n, n)."""
        slots = self.slots(leaves)
        return self.table.distances(self.levels(leaves), slots, self.rules.posture)[0]

    def members(self, leaf: Leaf) -> list[int]:
        """Return the numbers here of a leaf's kept exemplars."""
        own = self.numbers[leaf.person]
        return [own[n] for n in self.trees[leaf.person].node(leaf.local).members]

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes, by id: the root, what was split, primitives, and leaves below those."""
        return nodes_of(
            self.leaves, self.trees, self.numbers, self.above, self.parents, self.n_seen
        )

    # ---- which are one motion

    def regroup(self) -> tuple[list[int], list[int]]:
        """Find again what is one primitive; return the groups of leaves, and of what waits."""
        found = solve(self.table, self._known(), len(self.trees), self.rules)
        self.unit = found.unit
        self._offsets = dict(zip(self.trees, found.offsets, strict=True))
        groups: list[int] = found.groups.tolist()
        return groups[: len(self.leaves)], groups[len(self.leaves) :]

    def _known(self) -> Known:
        """Return all leaves, and what waits, for the search of what is one motion."""
        places = {person: place for place, person in enumerate(self.trees)}
        entries = [*self.leaves, *self.waiting]
        n, n_leaves = len(entries), len(self.leaves)
        together, apart = np.zeros((2, n, n), dtype=np.bool_)
        for all_pairs, pairs in zip(
            (together, apart), self.pins.among([leaf.key for leaf in self.leaves]), strict=True
        ):
            all_pairs[:n_leaves, :n_leaves] = pairs
        people = np.array([places[each.person] for each in entries], dtype=np.int64)
        return Known(self.slots(entries), people, np.arange(n) < n_leaves, together, apart)

    def measure_offsets(self) -> None:
        """Learn from what joined how its person deviates from others."""
        known = self._known()
        primitives = [each.primitive for each in (*self.leaves, *self.waiting)]
        offsets = offsets_of(
            self.table.postures(known.slots),
            known.people,
            len(self.trees),
            np.array(primitives, dtype=np.int64),
            self.rules.offset_prior,
        )
        self._offsets = dict(zip(self.trees, offsets, strict=True))

    # ---- leaves come and go

    def new_id(self) -> int:
        """Return an id that was never used."""
        self.next_id += 1
        return self.next_id - 1

    def new_leaf(self, person: int, local: int) -> Leaf:
        """Take a leaf of a person's tree, of no primitive yet."""
        slot = self.table.add(self.seen(person, local))
        self.leaves.append(Leaf(person, local, ROOT, ROOT, ROOT, slot))
        return self.leaves[-1]

    def look_again(self, leaf: Leaf) -> None:
        """Take note of a leaf's new exemplars."""
        self.table.put(leaf.slot, self.seen(*leaf.key))

    def found(self, leaves: Sequence[Leaf], below: int = ROOT) -> int:
        """Form a primitive of some leaves; return its id."""
        id = self.new_id()
        leaves[0].founded = id
        self.parents[id] = below
        for leaf in leaves:
            leaf.primitive = id
        return id

    def drop_leaf(self, leaf: Leaf) -> None:
        """Forget a leaf that is gone."""
        self.leaves.remove(leaf)
        self.table.drop(leaf.slot)

    def put_above(self, id: int, children: Iterable[int]) -> None:
        """Let what was a primitive be a node above others."""
        self.above[id] = Node(id, None, self.n_seen, history=[("split", self.n_seen)])
        for child in children:
            self.parents[child] = id

    def name_leaves(self) -> None:
        """Give a leaf an id of its own as soon as it shares its primitive."""
        sizes = Counter(leaf.primitive for leaf in self.leaves)
        for leaf in self.leaves:
            alone = sizes[leaf.primitive] == 1 and leaf.id in (ROOT, leaf.primitive)
            if alone:
                leaf.id = leaf.primitive
            elif leaf.id in (ROOT, leaf.primitive) or leaf.id in sizes or leaf.id in self.above:
                leaf.id = self.new_id()

    # ---- keeping

    def state(self) -> SharingState:
        """Return everything but the trees."""
        return SharingState(
            next_id=self.next_id,
            n_seen=self.n_seen,
            unit=self.unit,
            leaves=tuple(leaf.state(self.table) for leaf in self.leaves),
            waiting=self.waiting.state(),
            numbers=tuple(
                NumbersState(
                    person, np.array(list(own), np.int64), np.array(list(own.values()), np.int64)
                )
                for person, own in self.numbers.items()
            ),
            above=tuple(
                AboveState(node.id, node.born_at, tuple(node.history))
                for node in self.above.values()
            ),
            parents=tuple(self.parents.items()),
            pins=self.pins.state(),
            offsets=tuple(
                OffsetState(person, offset.copy()) for person, offset in self._offsets.items()
            ),
        )

    def load_state(self, state: SharingState) -> None:
        """Resume from what `state` returned, with the same trees."""
        self.next_id, self.n_seen, self.unit = state.next_id, state.n_seen, state.unit
        self.table = ShapeTable(self.table.mirror)
        self.leaves = []
        for leaf in state.leaves:
            slot = self.table.add(Shape(leaf.shape.posture, leaf.shape.movement))
            ids = leaf.person, leaf.local, leaf.id, leaf.primitive, leaf.founded
            self.leaves.append(Leaf(*ids, slot))
        self.waiting = WaitingRoom(self.table)
        self.waiting.load_state(state.waiting)
        self.numbers = {
            own.person: dict(zip(own.there.tolist(), own.here.tolist(), strict=True))
            for own in state.numbers
        }
        self.above = {
            node.id: Node(node.id, None, node.born_at, history=list(node.history))
            for node in state.above
        }
        self.parents = dict(state.parents)
        self.pins.load_state(state.pins)
        self._offsets = {each.person: each.offset.copy() for each in state.offsets}

    # ---- shapes

    def seen(self, person: int, leaf: int) -> Shape:
        """Return the shape of a leaf as its exemplars are now."""
        return shape_of(self.trees[person].exemplars(leaf), self.config.form)

    def offset(self, person: int) -> FloatArray:
        """Return a person's usual deviation in posture, shape (D,)."""
        known = self._offsets.get(person)
        return np.zeros(self.trees[person].n_channels) if known is None else known

    def levels(self, leaves: Sequence[Leaf]) -> FloatArray:
        """Return the postures of some leaves, less their people's usual deviations."""
        offsets = np.array([self.offset(leaf.person) for leaf in leaves])
        return np.asarray(self.table.postures(self.slots(leaves)) - offsets)

    @staticmethod
    def slots(entries: Iterable[Leaf | Waiting]) -> IntArray:
        """Return where the shapes of some leaves, or of what waits, are, shape (n,)."""
        return np.array([each.slot for each in entries], dtype=np.int64)

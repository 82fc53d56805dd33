"""The primitives that people share: which leaves they are made of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..recording import FloatArray, IntArray
from ..tree import ROOT, MirrorMap, Node, PrimitiveTree, TreeConfig
from .config import PeopleConfig
from .leaf import Leaf
from .links import Known, solve
from .nodes import nodes_of
from .offsets import offsets_of
from .pins import Pins
from .shape_table import ShapeTable
from .shapes import Shape, shape_of
from .waiting import Waiting, WaitingRoom


class SharedPrimitives:
    """Keeps the primitives that the leaves of several people's trees make up.

    Nothing here decides when what changes: see `sharing`, `editing` and `union`.

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

    def state(self) -> dict[str, Any]:
        """Return everything as plain values and arrays."""
        return {
            "next_id": self.next_id,
            "n_seen": self.n_seen,
            "unit": self.unit,
            "leaves": [leaf.state(self.table[leaf.slot]) for leaf in self.leaves],
            "waiting": self.waiting.state(),
            "numbers": [
                [person, [list(pair) for pair in numbers.items()]]
                for person, numbers in self.numbers.items()
            ],
            "above": [node.state() for node in self.above.values()],
            "parents": [list(pair) for pair in self.parents.items()],
            "pins": self.pins.state(),
            "offsets": [[person, offset] for person, offset in self._offsets.items()],
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned, with the same trees."""
        self.next_id, self.n_seen = int(state["next_id"]), int(state["n_seen"])
        self.unit = float(state["unit"])
        self.table = ShapeTable(self.table.mirror)
        self.leaves = []
        for *ids, posture, movement in state["leaves"]:
            slot = self.table.add(Shape(np.array(posture), np.array(movement)))
            person, local, id, primitive, founded = map(int, ids)
            self.leaves.append(Leaf(person, local, id, primitive, founded, slot))
        self.waiting = WaitingRoom(self.table)
        self.waiting.load_state(state["waiting"])
        self.numbers = {
            int(person): {int(there): int(here) for there, here in pairs}
            for person, pairs in state["numbers"]
        }
        self.above = {node.id: node for node in map(Node.from_state, state["above"])}
        self.parents = {int(id): int(parent) for id, parent in state["parents"]}
        self.pins = Pins.from_state(state["pins"])
        self._offsets = {int(person): np.array(offset) for person, offset in state["offsets"]}

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

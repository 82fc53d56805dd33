"""The primitives that people share: which leaves they are made of, and what becomes of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..recording import FloatArray, IntArray
from ..tree import ROOT, Change, Merge, Node, Placement, PrimitiveTree, Split, TreeConfig
from .config import PeopleConfig
from .identities import executions_held, identities, recognised_as, split_into
from .leaf import Leaf, stacked
from .links import corrected, solve, tension
from .nodes import nodes_of
from .shapes import Shape, distances, shape_of


class Sharing:
    """Follows the trees of several people, and keeps the primitives that their leaves make up.

    Which leaves are one primitive is solved again whenever a leaf comes or goes; a primitive keeps
    its id for life: it stays with the leaf that it was born with, or else with most of its
    executions.

    Args:
        config: Rules of the trees.
        rules: What makes motions of different people one primitive.
        trees: Each person's tree; one for now, others may be added by the owner.
        next_id: First id that was never used.
    """

    def __init__(
        self,
        config: TreeConfig,
        rules: PeopleConfig,
        trees: dict[int, PrimitiveTree],
        next_id: int,
    ) -> None:
        self.config = config
        self.rules = rules
        self.leaves: list[Leaf] = []
        self._trees = trees
        self._next_id = next_id
        self._n_seen = 0
        self._numbers: dict[int, dict[int, int]] = {}  # person -> number in the tree -> here
        self._above: dict[int, Node] = {}  # nodes above primitives: what was split
        self._parents: dict[int, int] = {}
        self._joined: dict[int, int] = {}  # segments that wait in their tree's root: primitive
        self._offsets: dict[int, FloatArray] = {}
        self._unit = float("inf")
        for person, tree in trees.items():
            self._n_seen = tree.n_seen
            self._numbers[person] = {n: n for node in tree.nodes for n in node.members}
            for node in tree.nodes:
                if node.id == ROOT:
                    continue
                self._parents[node.id] = node.parent or ROOT
                if node.is_leaf:
                    seen = self._seen(tree, node.id)
                    self.leaves.append(Leaf(person, node.id, node.id, node.id, node.id, seen))
                else:
                    self._above[node.id] = node
        if self.leaves:
            _, _, self._unit = self._solved()

    # ---- looking

    @property
    def primitives(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""
        return tuple(sorted({leaf.primitive for leaf in self.leaves}))

    def leaves_of(self, id: int) -> list[tuple[int, int]]:
        """Return the leaves of a primitive, or that one leaf, as person and id in its tree."""
        return [
            (leaf.person, leaf.local) for leaf in self.leaves if id in (leaf.id, leaf.primitive)
        ]

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes, by id: the root, what was split, primitives, and leaves below those."""
        above, parents = self._above, self._parents
        return nodes_of(self.leaves, self._trees, self._numbers, above, parents, self._n_seen)

    # ---- learning

    def follow(self, person: int, placement: Placement, frames: FloatArray) -> Placement:
        """Take note of what a person's tree did with a segment; return what it means for all."""
        tree = self._trees[person]
        number = self._n_seen
        self._n_seen += 1
        numbers = self._numbers.setdefault(person, {})
        numbers[placement.number] = number
        shape = shape_of([frames], self.config.form)
        before = {(leaf.person, leaf.local): leaf.primitive for leaf in self.leaves}
        said, ratio = ROOT, float("inf")
        nearest = before.get((person, placement.nearest or ROOT))
        if not placement.recognised:
            other, ratio = self._nearest(person, shape)
            nearest = other if nearest is None else nearest
            if other is not None and ratio <= 1:
                self._joined[number] = said = nearest = other
        if placement.recognised:
            said = before.get((person, recognised_as(placement)), ROOT)
        changed = self._take_up(person, tree, placement)
        born, splits, merges, moved = self._solve(before, person, placement) if changed else _NONE
        self._tidy(person, tree)
        home = self._home(person, placement.node_id, number)
        return Placement(
            number,
            home if home != ROOT else said,
            said != ROOT,
            placement.distance,
            min(placement.ratio, ratio),
            born,
            splits,
            merges,
            tuple(move for move in moved if move[0] != number),
            nearest=nearest,
            like=None if placement.like is None else numbers.get(placement.like),
        )

    def edited(self, person: int, change: Change) -> Change:
        """Take note of a change by hand in a person's tree; return what it means for all."""
        before = {(leaf.person, leaf.local): leaf.primitive for leaf in self.leaves}
        told = Placement(-1, ROOT, False, np.inf, np.inf, **change._asdict())
        self._take_up(person, self._trees[person], told)
        if not self.leaves:
            return Change(removed=tuple(sorted(set(before.values()))))
        born, splits, merges, moved = self._solve(before, person, told)
        gone = set(before.values()) - {leaf.primitive for leaf in self.leaves}
        gone -= {merge.absorbed for merge in merges} | {split.node for split in splits}
        return Change(born, splits, merges, moved, removed=tuple(sorted(gone)))

    def _nearest(self, person: int, shape: Shape) -> tuple[int | None, float]:
        """Return the nearest primitive, and how far out a segment lies: up to 1 it joins it."""
        if not np.isfinite(self._unit):
            return None, float("inf")
        ids, matrix = self._to_primitives(person, shape)
        at = int(matrix.argmin())
        nearest = matrix[at] / self._unit
        second = np.delete(matrix, at).min(initial=np.inf) / self._unit
        ratio = float(tension(nearest, second, self.rules.reach)) / self.rules.join
        return ids[at], ratio

    def _to_primitives(self, person: int, shape: Shape) -> tuple[list[int], FloatArray]:
        """Return the distance from a shape to each primitive, averaged over its leaves."""
        own = Shape((shape.posture - self._offset(person))[None], shape.movement[None])
        row = distances(own, self._corrected(), self.rules.posture)[0]
        ids, place = np.unique([leaf.primitive for leaf in self.leaves], return_inverse=True)
        mean = np.bincount(place, row) / np.bincount(place)
        return [int(id) for id in ids], mean

    def _take_up(self, person: int, tree: PrimitiveTree, placement: Placement) -> bool:
        """Bring a person's leaves up to date; say whether any came or went."""
        known = {leaf.local for leaf in self.leaves if leaf.person == person}
        now = set(tree.leaves)
        touched = {placement.node_id, *(node for _, node in placement.moved)}
        self.leaves = [leaf for leaf in self.leaves if leaf.person != person or leaf.local in now]
        for leaf in self.leaves:
            if leaf.person == person and leaf.local in touched:
                leaf.shape = self._seen(tree, leaf.local)
        for local in sorted(now - known):
            self.leaves.append(Leaf(person, local, ROOT, ROOT, ROOT, self._seen(tree, local)))
        return now != known

    def _solve(
        self, before: Mapping[tuple[int, int], int], person: int, placement: Placement
    ) -> tuple[tuple[int, ...], tuple[Split, ...], tuple[Merge, ...], tuple[tuple[int, int], ...]]:
        """Find again which leaves are one primitive, and say what changed by it."""
        found, offsets, self._unit = self._solved()
        groups: list[int] = found.tolist()
        self._offsets = dict(zip(self._trees, offsets, strict=True))
        held = executions_held(
            self.leaves,
            groups,
            before,
            self._trees,
            self._numbers,
            self._joined,
            person,
            placement,
        )
        ids = identities(held)
        born, merges, splits = [], [], []
        for group in dict.fromkeys(groups):
            if group not in ids:
                ids[group] = self._next_id
                self._next_id += 1
                born.append(ids[group])
                self.leaves[group].founded = ids[group]
                self._parents[ids[group]] = ROOT
        gone = set(before.values()) - set(ids.values())
        for id in sorted(gone):
            heirs = Counter({g: counts[id] for g, counts in held.items() if counts[id]})
            into = split_into(id, self.leaves, groups, ids, before, person, placement)
            if into:
                splits.append(Split(id, into))
                self._above[id] = Node(id, None, self._n_seen, history=[("split", self._n_seen)])
                for child in into:
                    if child in born:
                        self._parents[child] = id
            elif heirs:
                merges.append(Merge(ids[heirs.most_common(1)[0][0]], id))
        moved: list[tuple[int, int]] = []
        absorbed = {merge.absorbed: merge.kept for merge in merges}
        for leaf, group in zip(self.leaves, groups, strict=True):
            old = before.get((leaf.person, leaf.local), ROOT)
            leaf.primitive = ids[group]
            if absorbed.get(old, old) != leaf.primitive:
                members = self._trees[leaf.person].node(leaf.local).members
                moved += [(self._numbers[leaf.person][n], leaf.primitive) for n in members]
        self._joined = {
            number: absorbed.get(id, id)
            for number, id in self._joined.items()
            if absorbed.get(id, id) not in gone
        }
        self._name_leaves()
        return tuple(born), tuple(splits), tuple(merges), tuple(moved)

    def _name_leaves(self) -> None:
        """Give a leaf an id of its own as soon as it shares its primitive."""
        sizes = Counter(leaf.primitive for leaf in self.leaves)
        for leaf in self.leaves:
            alone = sizes[leaf.primitive] == 1 and leaf.id in (ROOT, leaf.primitive)
            if alone:
                leaf.id = leaf.primitive
            elif leaf.id in (ROOT, leaf.primitive) or leaf.id in sizes:
                leaf.id = self._next_id
                self._next_id += 1

    # ---- keeping

    def state(self) -> dict[str, Any]:
        """Return everything as plain values and arrays."""
        return {
            "next_id": self._next_id,
            "n_seen": self._n_seen,
            "unit": self._unit,
            "leaves": [leaf.state() for leaf in self.leaves],
            "numbers": [
                [person, [list(pair) for pair in numbers.items()]]
                for person, numbers in self._numbers.items()
            ],
            "above": [node.state() for node in self._above.values()],
            "parents": [list(pair) for pair in self._parents.items()],
            "joined": [list(pair) for pair in self._joined.items()],
            "offsets": [[person, offset] for person, offset in self._offsets.items()],
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned, with the same trees."""
        self._next_id, self._n_seen = int(state["next_id"]), int(state["n_seen"])
        self._unit = float(state["unit"])
        self.leaves = [Leaf.from_state(leaf) for leaf in state["leaves"]]
        self._numbers = {
            int(person): {int(there): int(here) for there, here in pairs}
            for person, pairs in state["numbers"]
        }
        above = [Node.from_state(node) for node in state["above"]]
        self._above = {node.id: node for node in above}
        self._parents = {int(id): int(parent) for id, parent in state["parents"]}
        self._joined = {int(number): int(id) for number, id in state["joined"]}
        self._offsets = {int(person): np.array(offset) for person, offset in state["offsets"]}

    # ---- inside

    def _solved(self) -> tuple[IntArray, FloatArray, float]:
        return solve(stacked(self.leaves), self._whose(), len(self._trees), self.rules)

    def _seen(self, tree: PrimitiveTree, leaf: int) -> Shape:
        return shape_of(tree.exemplars(leaf), self.config.form)

    def _home(self, person: int, node: int, number: int) -> int:
        for leaf in self.leaves:
            if (leaf.person, leaf.local) == (person, node):
                return leaf.primitive
        return self._joined.get(number, ROOT)

    def _offset(self, person: int) -> FloatArray:
        known = self._offsets.get(person)
        return np.zeros(self.leaves[0].shape.posture.shape) if known is None else known

    def _corrected(self) -> Shape:
        offsets = np.array([self._offset(person) for person in self._trees])
        return corrected(stacked(self.leaves), self._whose(), offsets)

    def _whose(self) -> IntArray:
        places = {person: place for place, person in enumerate(self._trees)}
        return np.array([places[leaf.person] for leaf in self.leaves], dtype=np.int64)

    def _tidy(self, person: int, tree: PrimitiveTree) -> None:
        """Forget the numbers of segments that the tree has forgotten."""
        if tree.n_seen % TIDY:
            return
        numbers = self._numbers[person]
        held = {n for node in tree.nodes for n in node.members}
        for n in numbers.keys() - held:
            self._joined.pop(numbers.pop(n), None)


TIDY = 32  # segments after which those are forgotten that the tree has forgotten
_NONE: tuple[tuple[()], tuple[()], tuple[()], tuple[()]] = ((), (), (), ())

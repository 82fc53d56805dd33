"""The primitives that people share: which leaves they are made of, as their trees grow."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ..recording import BoolArray, FloatArray, IntArray
from ..tree import ROOT, Change, Merge, MirrorMap, Node, Placement, PrimitiveTree, Split, TreeConfig
from .config import PeopleConfig
from .constraints import Constraints, Key
from .identities import executions_held, identities, recognised_as, split_into
from .leaf import Leaf
from .matching import Known, solve, tension
from .nodes import nodes_of, tidied
from .provisional import ProvisionalLeaf, ProvisionalLeaves
from .shapes.offsets import offsets_of
from .shapes.shape import Shape, shape_of
from .shapes.shape_table import ShapeTable
from .sharing_state import AboveState, NumbersState, OffsetState, SharingState

TIDY = 32  # segments after which those are forgotten that the tree has forgotten


class Sharing:
    """Follows the trees of several people, and keeps the primitives that their leaves make up.

    Which leaves are one primitive is solved again whenever a leaf comes or goes; a primitive keeps
    its id for life: it stays with the leaf that it was born with, or else with most of its
    executions. What a person asks is in `editing`, what two learners know in `mplearn.merging`.

    Args:
        config: Rules of the trees.
        rules: What makes motions of different people one primitive.
        trees: Each person's tree; one for now, others may be added by the owner.
        next_id: First id that was never used.
        mirror: Which channel is the mirror image of which; None where none is.

    Attributes:
        leaves: Leaves of all people.
        constraints: What a person said of them.
        above: Nodes above primitives: what was split.
        parents: The node above each of those, and of each primitive.
        numbers: Person -> number of a segment in that person's tree -> number here.
        table: The shapes.
        provisional: What joined primitives of others.
        unit: The unit of distance (`matching.unit_of`).
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
        self.constraints = Constraints()
        self.above: dict[int, Node] = {}
        self.parents: dict[int, int] = {}
        self.numbers: dict[int, dict[int, int]] = {}
        self.table = ShapeTable(mirror)
        self.provisional = ProvisionalLeaves(self.table)
        self._offsets: dict[int, FloatArray] = {}
        self.unit = float("inf")
        for person, tree in trees.items():
            self.n_seen = tree.n_seen
            self.numbers[person] = {n: n for node in tree.nodes for n in node.members}
            nodes = [node for node in tree.nodes if node.id != ROOT]
            self.parents |= {node.id: node.parent or ROOT for node in nodes}
            self.above |= {node.id: node for node in nodes if not node.is_leaf}
            own = [((person, node.id), None) for node in nodes if node.is_leaf]
            for leaf in self.new_leaves(own):
                leaf.id = leaf.primitive = leaf.founded = leaf.local
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
        entries = [*self.leaves, *self.provisional]
        n, n_leaves = len(entries), len(self.leaves)
        together, apart = np.zeros((2, n, n), dtype=np.bool_)
        for all_pairs, pairs in zip(
            (together, apart),
            self.constraints.among([leaf.key for leaf in self.leaves]),
            strict=True,
        ):
            all_pairs[:n_leaves, :n_leaves] = pairs
        self._keep_frozen(together, apart)
        people = np.array([places[each.person] for each in entries], dtype=np.int64)
        return Known(self.slots(entries), people, np.arange(n) < n_leaves, together, apart)

    def frozen(self, leaf: Leaf) -> bool:
        """Whether a leaf is to stay as it is."""
        return self.trees[leaf.person].node(leaf.local).frozen

    def _keep_frozen(self, together: BoolArray, apart: BoolArray) -> None:
        """Let frozen primitives be what they are; a leaf that is new may join one."""
        frozen = np.array([self.frozen(leaf) for leaf in self.leaves], dtype=np.bool_)
        if not frozen.any():
            return
        homes = np.array([leaf.primitive for leaf in self.leaves])
        same, n = homes[:, None] == homes, len(homes)
        either = (frozen[:, None] | frozen) & (homes[:, None] != ROOT) & (homes != ROOT)
        together[:n, :n] = np.where(either, same & ~np.eye(n, dtype=np.bool_), together[:n, :n])
        apart[:n, :n] = np.where(either, ~same, apart[:n, :n])

    def measure_offsets(self) -> None:
        """Learn from what joined how its person deviates from others."""
        known = self._known()
        primitives = [each.primitive for each in (*self.leaves, *self.provisional)]
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

    def new_leaf(self, person: int, local: int, shape: Shape | None = None) -> Leaf:
        """Take a leaf of a person's tree, of no primitive yet, whose shape may be known."""
        return self.new_leaves([((person, local), shape)])[0]

    def new_leaves(self, known: Sequence[tuple[Key, Shape | None]]) -> list[Leaf]:
        """Take many leaves at once, which is quicker: person and leaf, and its shape; see above."""
        shapes = [self.seen(*key) if shape is None else shape for key, shape in known]
        slots = self.table.add_all(shapes)
        new = [
            Leaf(*key, ROOT, ROOT, ROOT, slot) for (key, _), slot in zip(known, slots, strict=True)
        ]
        self.leaves += new
        return new

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
        self.above[id] = Node(id, None, self.n_seen, history=(("split", self.n_seen),))
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

    # ---- following the trees

    def follow(self, person: int, placement: Placement, frames: FloatArray) -> Placement:
        """Take note of what a person's tree did with a segment; return what it means for all."""
        number = self.n_seen
        self.n_seen += 1
        self.numbers.setdefault(person, {})[placement.number] = number
        before = {leaf.key: leaf.primitive for leaf in self.leaves}
        nearest = before.get((person, placement.nearest or ROOT))
        said, ratio = ROOT, float("inf")
        if placement.recognised:
            said = before.get((person, recognised_as(placement)), ROOT)
        else:
            shape = shape_of([frames], self.config.normalisation)
            other, ratio = self._nearest(person, shape)
            nearest = other if nearest is None else nearest
            if other is not None and ratio <= 1:
                said = nearest = other
                self.provisional.join(person, other, {number: shape})
        joined = self.provisional.homes()
        change = Change()
        if self._take_up(person, placement):
            change = self._solve(before, joined, person, placement)
        elif number in joined:
            self.measure_offsets()
        own = self.numbers[person]
        back = [(own[n], ROOT) for n, to in placement.moved if to == ROOT and n in own]
        change = Change(moved=tuple(back)).then(change)
        self._tidy(person)
        home = self._home(person, placement.node_id, number)
        new = home in change.born and not any(home in split.into for split in change.splits)
        return Placement(
            number,
            home if home != ROOT else said,
            said != ROOT and not new,
            placement.distance,
            min(placement.ratio, ratio),
            **change._replace(moved=tuple(m for m in change.moved if m[0] != number))._asdict(),
            nearest=nearest,
            like=None if placement.like is None else self.numbers[person].get(placement.like),
        )

    def _nearest(self, person: int, shape: Shape) -> tuple[int | None, float]:
        """Return the nearest primitive in which a segment's person has no leaf.

        Returns:
            Its id, and how far out the segment lies: up to 1 it joins it.
        """
        if not self.leaves or not np.isfinite(self.unit):
            return None, float("inf")
        level = Shape(shape.posture - self.offset(person), shape.movement)
        slots = self.slots(self.leaves)
        rows = self.table.distances_to(level, self.levels(self.leaves), slots, self.rules.posture)
        ids, place = np.unique([leaf.primitive for leaf in self.leaves], return_inverse=True)
        mean, image = (np.bincount(place, row) / np.bincount(place) / self.unit for row in rows)
        own = [id for whose, id in self.own() if whose == person]
        barred = np.isin(ids, own) | (image < self.rules.sided * mean)
        if barred.all():
            return None, float("inf")
        at = int(np.where(barred, np.inf, mean).argmin())
        second = float(np.delete(mean, at).min(initial=np.inf))
        return int(ids[at]), tension(float(mean[at]), second, self.rules.reach) / self.rules.join

    def _take_up(self, person: int, placement: Placement) -> bool:
        """Bring a person's leaves up to date; say whether any came or went."""
        tree = self.trees[person]
        known = {leaf.local: leaf for leaf in self.leaves if leaf.person == person}
        now = set(tree.leaves)
        placed = {placement.number: placement.node_id, **dict(placement.moved)}
        for local in sorted((set(placed.values()) & known.keys()) & now):
            self.look_again(known[local])
        for local in sorted(known.keys() - now):
            self.drop_leaf(known[local])
        for local in sorted(now - known.keys()):
            self.new_leaf(person, local)
        heirs = {(person, each.absorbed): [(person, each.kept)] for each in placement.merges}
        heirs |= {(person, s.node): [(person, to) for to in s.into] for s in placement.splits}
        self.constraints.follow(heirs)
        own = self.numbers[person]
        self.provisional.leave(person, {own[n] for n, node in placed.items() if node != ROOT})
        return now != known.keys()

    def _solve(
        self,
        before: Mapping[tuple[int, int], int],
        joined: Mapping[int, int],
        person: int,
        placement: Placement,
    ) -> Change:
        """Find again which leaves are one primitive, and say what changed by it."""
        groups, of_provisional = self.regroup()
        held = executions_held(
            self.leaves, groups, before, self.trees, self.numbers, joined, person, placement
        )
        ids = identities(held)
        born, merges, splits, removed = [], [], [], []
        for group in dict.fromkeys(groups):
            if group not in ids:
                ids[group] = self.new_id()
                born.append(ids[group])
                self.leaves[group].founded = ids[group]
                self.parents[ids[group]] = ROOT
        gone = set(before.values()) - set(ids.values())
        for id in sorted(gone):
            heirs = Counter({g: counts[id] for g, counts in held.items() if counts[id]})
            into = split_into(id, self.leaves, groups, ids, before, person, placement)
            if into:
                splits.append(Split(id, into))
                self.put_above(id, [child for child in into if child in born])
            elif heirs:
                merges.append(Merge(ids[heirs.most_common(1)[0][0]], id))
            else:
                removed.append(id)
        moved: list[tuple[int, int]] = []
        absorbed = {merge.absorbed: merge.kept for merge in merges}
        for leaf, group in zip(self.leaves, groups, strict=True):
            old = before.get(leaf.key, ROOT)
            leaf.primitive = ids[group]
            if absorbed.get(old, old) != leaf.primitive:
                moved += [(n, leaf.primitive) for n in self.members(leaf)]
        homes = [ids.get(group, ROOT) for group in of_provisional]
        moved += self.provisional.move(homes, absorbed, self.own())
        self.name_leaves()
        of_parts = {before.get((person, local)) for local in placement.parts}
        change = Change(
            tuple(born),
            tuple(splits),
            tuple(merges),
            tuple(moved),
            removed=tuple(removed),
            parts=tuple(id for id in removed if id in of_parts),
        )
        return change.then(tidied(self.above, self.parents, self.primitives))

    def _tidy(self, person: int) -> None:
        """Forget the numbers of segments that the tree has forgotten."""
        tree = self.trees[person]
        if tree.n_seen % TIDY:
            return
        held = {n for node in tree.nodes for n in node.members}
        own = self.numbers[person]
        self.numbers[person] = {there: here for there, here in own.items() if there in held}
        self.provisional.leave(person, {here for there, here in own.items() if there not in held})

    def _home(self, person: int, node: int, number: int) -> int:
        for leaf in self.leaves:
            if leaf.key == (person, node):
                return leaf.primitive
        return self.provisional.homes().get(number, ROOT)

    # ---- keeping

    def state(self) -> SharingState:
        """Return everything but the trees."""
        return SharingState(
            next_id=self.next_id,
            n_seen=self.n_seen,
            unit=self.unit,
            leaves=tuple(leaf.state(self.table) for leaf in self.leaves),
            provisional=self.provisional.state(),
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
            constraints=self.constraints.state(),
            offsets=tuple(
                OffsetState(person, offset.copy()) for person, offset in self._offsets.items()
            ),
        )

    def load_state(self, state: SharingState) -> None:
        """Resume from what `state` returned, with the same trees."""
        self.next_id, self.n_seen, self.unit = state.next_id, state.n_seen, state.unit
        self.table = ShapeTable(self.table.mirror)
        self.leaves = []
        shapes = [Shape(leaf.shape.posture, leaf.shape.movement) for leaf in state.leaves]
        for leaf, slot in zip(state.leaves, self.table.add_all(shapes), strict=True):
            ids = leaf.person, leaf.local, leaf.id, leaf.primitive, leaf.founded
            self.leaves.append(Leaf(*ids, slot))
        self.provisional = ProvisionalLeaves(self.table)
        self.provisional.load_state(state.provisional)
        self.numbers = {
            own.person: dict(zip(own.there.tolist(), own.here.tolist(), strict=True))
            for own in state.numbers
        }
        self.above = {
            node.id: Node(node.id, None, node.born_at, history=node.history) for node in state.above
        }
        self.parents = dict(state.parents)
        self.constraints.load_state(state.constraints)
        self._offsets = {each.person: each.offset.copy() for each in state.offsets}

    # ---- shapes

    def seen(self, person: int, leaf: int) -> Shape:
        """Return the shape of a leaf as its exemplars are now."""
        return shape_of(self.trees[person].exemplars(leaf), self.config.normalisation)

    def offset(self, person: int) -> FloatArray:
        """Return a person's usual deviation in posture, shape (D,)."""
        known = self._offsets.get(person)
        return np.zeros(self.trees[person].n_channels) if known is None else known

    def levels(self, leaves: Sequence[Leaf]) -> FloatArray:
        """Return the postures of some leaves, less their people's usual deviations."""
        offsets = np.array([self.offset(leaf.person) for leaf in leaves])
        return np.asarray(self.table.postures(self.slots(leaves)) - offsets)

    @staticmethod
    def slots(entries: Iterable[Leaf | ProvisionalLeaf]) -> IntArray:
        """Return where the shapes of some leaves, or of what waits, are, shape (n,)."""
        return np.array([each.slot for each in entries], dtype=np.int64)

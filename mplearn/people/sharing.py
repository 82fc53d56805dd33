"""What becomes of the primitives that people share as their trees grow."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from ..recording import FloatArray
from ..tree import ROOT, Change, Merge, Placement, Split
from .identities import executions_held, identities, recognised_as, split_into
from .links import tension
from .nodes import tidied
from .shapes import Shape, shape_of
from .shared_primitives import SharedPrimitives


class Sharing(SharedPrimitives):
    """Follows the trees of several people.

    Which leaves are one primitive is solved again whenever a leaf comes or goes; a primitive keeps
    its id for life: it stays with the leaf that it was born with, or else with most of its
    executions.
    """

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
            shape = shape_of([frames], self.config.form)
            other, ratio = self._nearest(person, shape)
            nearest = other if nearest is None else nearest
            if other is not None and ratio <= 1:
                said = nearest = other
                self.waiting.join(person, other, {number: shape})
        joined = self.waiting.homes()
        change = Change()
        if self._take_up(person, placement):
            change = self._solve(before, joined, person, placement)
        elif number in joined:
            self.measure_offsets()
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
        if not np.isfinite(self.unit):
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
        self.pins.follow(heirs)
        own = self.numbers[person]
        self.waiting.leave(person, {own[n] for n, node in placed.items() if node != ROOT})
        return now != known.keys()

    def _solve(
        self,
        before: Mapping[tuple[int, int], int],
        joined: Mapping[int, int],
        person: int,
        placement: Placement,
    ) -> Change:
        """Find again which leaves are one primitive, and say what changed by it."""
        groups, of_waiting = self.regroup()
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
        homes = [ids.get(group, ROOT) for group in of_waiting]
        moved += self.waiting.move(homes, absorbed, self.own())
        self.name_leaves()
        change = Change(
            tuple(born), tuple(splits), tuple(merges), tuple(moved), removed=tuple(removed)
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
        self.waiting.leave(person, {here for there, here in own.items() if there not in held})

    def _home(self, person: int, node: int, number: int) -> int:
        for leaf in self.leaves:
            if leaf.key == (person, node):
                return leaf.primitive
        return self.waiting.homes().get(number, ROOT)


TIDY = 32  # segments after which those are forgotten that the tree has forgotten

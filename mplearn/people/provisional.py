"""Provisional leaves: what joined primitives of others, of people who have no such leaf yet."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from ..recording import FloatArray, IntArray
from ..state import Array, Count, Range, SharedState, require
from ..tree import ROOT
from .shapes.shape import Shape, mean_shape
from .shapes.shape_table import ShapeTable


@dataclass(frozen=True, eq=False)
class ProvisionalState(SharedState):
    """The state of a `ProvisionalLeaf`.

    Attributes:
        person: Whose they are.
        primitive: Id of the primitive.
        numbers: Their numbers in the tree of all people, shape (n,).
        postures: Their mean postures, shape (n, D).
        movements: Their movements, shape (n, P * D).
    """

    person: Count
    primitive: Annotated[int, Range(1)]
    numbers: Annotated[IntArray, Array("n", low=0)]
    postures: Annotated[FloatArray, Array("n", None)]
    movements: Annotated[FloatArray, Array("n", None)]

    def check(self) -> None:
        """Check that something waits, and nothing twice."""
        numbers = self.numbers.tolist()
        require(0 < len(set(numbers)) == len(numbers), "numbers", "must differ, at least one")


@dataclass
class ProvisionalLeaf:
    """Segments of one person that joined one primitive.

    Attributes:
        person: Whose they are.
        primitive: Id of the primitive.
        slot: Where their mean trajectory is in the table of shapes.
        shapes: Each of them, by its number in the tree of all people.
    """

    person: int
    primitive: int
    slot: int
    shapes: dict[int, Shape] = field(default_factory=dict)
    _kept: ProvisionalState | None = field(default=None, repr=False, compare=False)

    def state(self) -> ProvisionalState:
        """Return everything: the same object as long as nothing has changed."""
        kept = self._kept
        if kept is None or kept.numbers.tolist() != list(self.shapes):
            postures, movements = zip(*self.shapes.values(), strict=True)
            kept = self._kept = ProvisionalState(
                self.person,
                self.primitive,
                np.array(list(self.shapes), np.int64),
                np.array(postures),
                np.array(movements),
            )
        return kept


class ProvisionalLeaves:
    """All provisional leaves, by person and primitive.

    Each counts as a leaf of its person when it is found out which leaves are one primitive.

    Args:
        table: Where shapes are kept.
    """

    def __init__(self, table: ShapeTable) -> None:
        self._table = table
        self._all: dict[tuple[int, int], ProvisionalLeaf] = {}

    def __iter__(self) -> Iterator[ProvisionalLeaf]:
        """Go through what waits."""
        return iter(list(self._all.values()))

    def homes(self) -> dict[int, int]:
        """Return the primitive that each segment joined, by its number."""
        return {number: each.primitive for each in self for number in each.shapes}

    def join(self, person: int, primitive: int, shapes: Mapping[int, Shape]) -> None:
        """Let segments of a person join a primitive."""
        each = self._all.get((person, primitive))
        if each is None:
            slot = self._table.add(mean_shape(list(shapes.values())))
            self._all[person, primitive] = ProvisionalLeaf(person, primitive, slot, dict(shapes))
            return
        each.shapes |= shapes
        self._table.put(each.slot, mean_shape(list(each.shapes.values())))

    def leave(self, person: int, numbers: Collection[int]) -> None:
        """Let segments of a person wait no more."""
        for each in self:
            if each.person == person and not each.shapes.keys().isdisjoint(numbers):
                self._keep(each, each.shapes.keys() - set(numbers))

    def move(
        self,
        homes: Iterable[int],
        absorbed: Mapping[int, int],
        own: Collection[tuple[int, int]],
    ) -> list[tuple[int, int]]:
        """Let all that waits join other primitives, or none.

        Args:
            homes: The primitive that each joins; `ROOT` for none.
            absorbed: What became of primitives that are gone.
            own: Person and primitive of all leaves: no one waits for a leaf that is there.

        Returns:
            Numbers of the segments for which that is news, and where they are now.
        """
        moved = []
        for each, wanted in zip(self, homes, strict=True):
            home = ROOT if (each.person, wanted) in own else wanted
            if absorbed.get(each.primitive, each.primitive) != home:
                moved += [(number, home) for number in each.shapes]
            if each.primitive != home:
                shapes = dict(each.shapes)
                self._keep(each, ())
                if home != ROOT:
                    self.join(each.person, home, shapes)
        return moved

    def state(self) -> tuple[ProvisionalState, ...]:
        """Return all that waits."""
        return tuple(each.state() for each in self)

    def load_state(self, state: Sequence[ProvisionalState]) -> None:
        """Resume from what `state` returned."""
        for each in state:
            shapes = map(Shape, each.postures, each.movements)
            known = dict(zip(each.numbers.tolist(), shapes, strict=True))
            self.join(each.person, each.primitive, known)

    def _keep(self, each: ProvisionalLeaf, numbers: Collection[int]) -> None:
        each.shapes = {n: shape for n, shape in each.shapes.items() if n in numbers}
        if each.shapes:
            self._table.put(each.slot, mean_shape(list(each.shapes.values())))
        else:
            self._table.drop(each.slot)
            del self._all[each.person, each.primitive]

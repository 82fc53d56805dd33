"""A leaf of a person's tree, as a part of a primitive that people share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from ..state import Count, Range, State
from .shapes.shape import ShapeState
from .shapes.shape_table import ShapeTable


@dataclass(frozen=True, eq=False)
class LeafState(State):
    """A leaf with its shape; attributes are those of `Leaf`."""

    person: Count
    local: Annotated[int, Range(1)]
    id: Annotated[int, Range(1)]
    primitive: Annotated[int, Range(1)]
    founded: Count
    shape: ShapeState


@dataclass
class Leaf:
    """A leaf of a person's tree, and the primitive that it belongs to.

    Attributes:
        person: Whose it is.
        local: Its id in that person's tree.
        id: Its id among all nodes; that of its primitive, as long as it was never joined by others.
        primitive: Id of the primitive; `ROOT` before it is known.
        founded: Id of the primitive that was born with this leaf; `ROOT` if none was.
        slot: Where its mean trajectory is in the table of shapes.
    """

    person: int
    local: int
    id: int
    primitive: int
    founded: int
    slot: int

    @property
    def key(self) -> tuple[int, int]:
        """Person, and id in that person's tree."""
        return self.person, self.local

    def state(self, table: ShapeTable) -> LeafState:
        """Return everything, with the shape from the table."""
        ids = self.person, self.local, self.id, self.primitive, self.founded
        return LeafState(*ids, table.state(self.slot))

"""A leaf of a person's tree, as a part of a primitive that people share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .shapes import Shape


@dataclass
class Leaf:
    """A leaf of a person's tree, and the primitive that it belongs to.

    Attributes:
        person: Whose it is.
        local: Its id in that person's tree.
        id: Its id among all nodes; that of its primitive, as long as it was never joined by others.
        primitive: Id of the primitive; `ROOT` before it is known.
        founded: Id of the primitive that was born with this leaf; `ROOT` if none was.
        shape: Its mean trajectory.
    """

    person: int
    local: int
    id: int
    primitive: int
    founded: int
    shape: Shape

    def state(self) -> list[Any]:
        """Return everything as plain values and arrays."""
        ids = self.person, self.local, self.id, self.primitive, self.founded
        return [*ids, *self.shape]

    @classmethod
    def from_state(cls, state: Sequence[Any]) -> Leaf:
        """Return the leaf that `state` described."""
        *ids, posture, movement = state
        person, local, id, primitive, founded = map(int, ids)
        shape = Shape(np.array(posture), np.array(movement))
        return cls(person, local, id, primitive, founded, shape)


def stacked(leaves: Sequence[Leaf]) -> Shape:
    """Return the shapes of leaves as one."""
    return Shape(*(np.array(part) for part in zip(*(leaf.shape for leaf in leaves), strict=True)))

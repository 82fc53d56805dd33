"""A node of the tree: a group of similar segments."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..recording import FloatArray
from .clustering import most_redundant
from .spread import without


@dataclass
class Node:
    """A group of similar segments; a leaf is a primitive.

    Attributes:
        id: Identity, for life.
        parent: Id of the node above; None at the root.
        born_at: How many segments the tree had seen when it was formed.
        members: Numbers of its kept exemplars, in the order of their arrival.
        matrix: Distances among them, shape (k, k).
        n_placed: Segments ever placed in it.
        n_frames: Frames of those.
        children: Ids of the nodes below.
        settled: Those of its exemplars that went to one of them.
        history: Kind and time of what happened to it: ("born", n), ("split", n), ("merged", n),
            ("moved", n).
        whole: Whether a person said that it is one motion: the rules never split it.
        apart: Ids of leaves that a person said are other motions: the rules never merge them.
    """

    id: int
    parent: int | None
    born_at: int
    members: list[int] = field(default_factory=list)
    matrix: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    n_placed: int = 0
    n_frames: int = 0
    children: list[int] = field(default_factory=list)
    settled: set[int] = field(default_factory=set)
    history: list[tuple[str, int]] = field(default_factory=list)
    whole: bool = False
    apart: set[int] = field(default_factory=set)

    @property
    def is_leaf(self) -> bool:
        """Whether there is no node below."""
        return not self.children

    @property
    def diameter(self) -> float:
        """Largest distance between its exemplars, D_max^G."""
        return float(self.matrix.max()) if self.matrix.size else 0.0

    def add(self, number: int, row: FloatArray) -> None:
        """Take an exemplar, ``row`` being its distances to the members, shape (k,)."""
        k = len(self.members)
        grown = np.zeros((k + 1, k + 1))
        grown[:k, :k] = self.matrix
        grown[k, :k] = grown[:k, k] = row
        self.matrix = grown
        self.members.append(number)

    def remove(self, positions: list[int]) -> list[int]:
        """Let exemplars go, and return their numbers."""
        gone = [self.members[i] for i in positions]
        self.members = [m for i, m in enumerate(self.members) if i not in set(positions)]
        self.matrix = without(self.matrix, positions)
        return gone

    def thin(self, most: int) -> list[int]:
        """Let the least informative exemplars go until ``most`` are left; return their numbers."""
        gone: list[int] = []
        while len(self.members) > most:
            gone += self.remove([most_redundant(self.matrix)])
        return gone

    def state(self) -> dict[str, Any]:
        """Return everything as plain values and arrays."""
        plain = {name: getattr(self, name) for name in _PLAIN}
        return plain | {
            "members": list(self.members),
            "children": list(self.children),
            "settled": sorted(self.settled),
            "apart": sorted(self.apart),
            "matrix": self.matrix.copy(),
            "history": [list(event) for event in self.history],
        }

    @classmethod
    def from_state(cls, state: dict[str, Any]) -> Node:
        """Return the node that `state` described."""
        return cls(
            **{name: state[name] for name in _PLAIN},
            members=[int(number) for number in state["members"]],
            children=[int(child) for child in state["children"]],
            settled={int(number) for number in state["settled"]},
            apart={int(id) for id in state["apart"]},
            matrix=np.array(state["matrix"], dtype=np.float64),
            history=[(str(kind), int(when)) for kind, when in state["history"]],
        )


_PLAIN = ("id", "parent", "born_at", "n_placed", "n_frames", "whole")

"""What people share, as it is kept."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from ..recording import FloatArray, IntArray
from ..state import Array, Count, Range, State, require, require_no_cycle, saved_as
from ..tree import ROOT
from ..tree.nodes.node import Happening
from .constraints import ConstraintsState
from .leaf import LeafState
from .provisional import ProvisionalState


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


@saved_as(provisional="waiting", constraints="pins")
@dataclass(frozen=True, eq=False)
class SharingState(State):
    """What people share; attributes are those of `Sharing`."""

    next_id: Annotated[int, Range(1)]
    n_seen: Count
    unit: Annotated[float, Range(0.0, math.inf)]
    leaves: tuple[LeafState, ...]
    provisional: tuple[ProvisionalState, ...]
    numbers: tuple[NumbersState, ...]
    above: tuple[AboveState, ...]
    parents: tuple[tuple[Count, Count], ...]
    constraints: ConstraintsState
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
        with_leaf = {(leaf.person, leaf.primitive) for leaf in self.leaves}
        for k, each in enumerate(self.provisional):
            place = f"provisional[{k}].primitive"
            require(each.primitive in primitives, place, "must be a primitive")
            free = (each.person, each.primitive) not in with_leaf
            require(free, place, f"must be one of which person {each.person} has no leaf")
            last = int(each.numbers.max())
            require(
                last < self.n_seen,
                f"provisional[{k}].numbers",
                f"must be below {self.n_seen}, not {last}",
            )
        homes = {(each.person, each.primitive) for each in self.provisional}
        require(len(homes) == len(self.provisional), "provisional", "must differ")
        for name in ("together", "apart"):
            for k, pair in enumerate(getattr(self.constraints, name)):
                require(keys.issuperset(pair), f"constraints.{name}[{k}]", "must name leaves")
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

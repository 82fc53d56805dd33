"""Perform a primitive."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.execution.earliest_arrival import Arrival
from mplearn_envs.execution.sensors import Measured

from .base import Goal, GoalKind


@dataclass(frozen=True)
class PrimitiveGoal(Goal):
    """The end of a primitive.

    Attributes:
        id: The primitive.
        name: Its name.
        slot: Its slot; -1 if it has none.
        capacity: Number of slots.
    """

    id: int
    name: str
    slot: int
    capacity: int
    tolerance = 0.0

    def __str__(self) -> str:
        """Say what is wanted."""
        return f"primitive {self.name!r}"

    def show(self, now: Measured) -> FloatArray:
        """Return a 1 at the slot of the primitive, shape (C,)."""
        out = np.zeros(self.capacity)
        out[self.slot] = 1.0
        return out

    def gap(self, id: int | None, there: Measured) -> float:
        """Return 0 at the end of the primitive, infinity elsewhere."""
        return 0.0 if id == self.id else np.inf


@dataclass(frozen=True)
class PrimitiveGoals(GoalKind):
    """Goals of primitives.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> from mplearn_envs.robot import humanoid
        >>> from mplearn_envs.skills.repertoire import Repertoire
        >>> repertoire = Repertoire(LibrarySource(None).now(), humanoid())
        >>> goal = PrimitiveGoals(repertoire).given("squat down")
        >>> str(goal)
        "primitive 'squat down'"
    """

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the bounds of what goals show, shape (C,) each."""
        capacity = self.repertoire.capacity
        return np.zeros(capacity), np.ones(capacity)

    def given(self, target: Any) -> PrimitiveGoal:
        """Return the goal of an id or a name.

        Raises:
            UnknownPrimitiveError: The library does not hold it.
        """
        primitive = self.repertoire.library[target]
        slot = self.repertoire.slots.get(primitive.id, -1)
        return PrimitiveGoal(primitive.id, primitive.name, slot, self.repertoire.capacity)

    def at(self, id: int, there: Measured, start: Measured) -> Iterator[PrimitiveGoal]:
        """Yield the primitive."""
        yield self.given(id)

    def missed(self, goal: Goal, arrivals: dict[int, Arrival]) -> str:
        """Say why a primitive cannot be reached."""
        assert isinstance(goal, PrimitiveGoal)
        problems = self.repertoire.skills.feasibility(goal.id).problems
        return "; ".join(map(str, problems)) or "no way leads there"

"""What a goal is, and what a kind of goals is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from mplearn.recording import FloatArray
from mplearn_envs.execution.earliest_arrival import Arrival
from mplearn_envs.execution.sensors import Measured
from mplearn_envs.skills.repertoire import Repertoire


class Goal(ABC):
    """What shall be reached.

    Attributes:
        tolerance: The gap at which it is reached.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> from mplearn_envs.robot import humanoid
        >>> from mplearn_envs.skills.repertoire import Repertoire
        >>> from mplearn_envs.tasks.goals import PrimitiveGoals
        >>> library = LibrarySource(None).now()  # the built-in one
        >>> goal: Goal = PrimitiveGoals(Repertoire(library, humanoid())).given("squat down")
        >>> goal.gap(library["squat down"].id, None) <= goal.tolerance
        True
    """

    tolerance: float

    @abstractmethod
    def __str__(self) -> str:
        """Say what is wanted, for people."""

    @abstractmethod
    def show(self, now: Measured) -> FloatArray:
        """Return what the agent sees of it, fresh, within the bounds of `GoalKind.bounds`."""

    @abstractmethod
    def gap(self, id: int | None, there: Measured) -> float:
        """Return how far from it the robot is, after a primitive."""


@dataclass(frozen=True)
class GoalKind(ABC):
    """Goals of one kind, for one library.

    Attributes:
        repertoire: What the robot can perform.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> from mplearn_envs.robot import humanoid
        >>> from mplearn_envs.skills.repertoire import Repertoire
        >>> from mplearn_envs.tasks.goals import HandGoals
        >>> repertoire = Repertoire(LibrarySource(None).now(), humanoid())
        >>> kind: GoalKind = HandGoals(repertoire, tolerance_m=0.05, far_m=0.15)
        >>> low, high = kind.bounds()
        >>> low.shape
        (8,)
    """

    repertoire: Repertoire

    @abstractmethod
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the least and greatest values of what goals show, shape (D,) each."""

    @abstractmethod
    def given(self, target: Any) -> Goal:
        """Return the goal that a person gave.

        Raises:
            InvalidValueError: It is no target of this kind.
        """

    @abstractmethod
    def at(self, id: int, there: Measured, start: Measured) -> Iterator[Goal]:
        """Yield the goals that are reached at the end of a primitive, and not at the start."""

    def missed(self, goal: Goal, arrivals: dict[int, Arrival]) -> str:
        """Say why a goal cannot be reached."""
        gaps = {id: goal.gap(id, arrival.measured) for id, arrival in arrivals.items()}
        if not gaps:
            return "no primitive can be reached at all"
        nearest = min(gaps, key=lambda id: gaps[id])
        return (
            f"the nearest, at the end of {self.repertoire.library[nearest].name!r}, misses by "
            f"{gaps[nearest]:.3g}, allowed {goal.tolerance:.3g}"
        )

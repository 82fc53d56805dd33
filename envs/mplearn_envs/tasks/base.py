"""What a task is: rewards for what is chosen and for how it is performed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

from mplearn.recording import FloatArray
from mplearn_envs.simulation import Performance


class Choice(NamedTuple):
    """An action, as it was chosen.

    Attributes:
        primitive: Id of the primitive; None for hold.
        legal: Whether the mask allowed it.
        probability: How likely the transition prior makes it.
        history: Ids of the primitives performed before, the latest last.
    """

    primitive: int | None
    legal: bool
    probability: float
    history: tuple[int, ...]


class Task(ABC):
    """A reward.

    A macro step pays the bonuses at its start, and the rates integrated over its duration T with
    the discount gamma per second: R = sum of bonuses + integral over [0, T] of gamma^t rates(t) dt.
    Bonuses of a fall are discounted by gamma^T.
    """

    def reset(self) -> None:
        """Start an episode."""
        return

    @abstractmethod
    def bonuses(self, choice: Choice) -> dict[str, float]:
        """Return what a choice earns at once, by term."""

    @abstractmethod
    def rates(self, performance: Performance) -> dict[str, FloatArray]:
        """Return what each moment earns per second, by term, shape (S,) each."""

    @abstractmethod
    def fall(self) -> float:
        """Return what a fall earns."""

"""How long each state lasts, and which state each frame of a path is in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from ..hmm import LeftRightHMM
from ..recording import FloatArray, IntArray
from .dynamics import Dynamics


class GenerativePrimitive(Protocol):
    """What a primitive must offer to be generated; `mplearn.library.Primitive` does."""

    @property
    def id(self) -> int:
        """Identity of the primitive."""

    @property
    def hmm(self) -> LeftRightHMM:
        """Its model."""

    @property
    def mean_duration_s(self) -> float:
        """How long it lasts on average [s]."""

    @property
    def exemplars(self) -> tuple[FloatArray, ...]:
        """Stored demonstrations, shape (T, D) each, finite."""

    @property
    def dynamics(self) -> Dynamics:
        """Its position, velocity and acceleration per state."""


class Schedule(NamedTuple):
    """The timing of a path.

    Attributes:
        starts: First frame of each primitive, shape (P,).
        positions: Which primitive of the path each frame is in, shape (T,).
        states: Which of that primitive's states, shape (T,).
    """

    starts: IntArray
    positions: IntArray
    states: IntArray


def state_durations_s(primitive: GenerativePrimitive, model_rate_hz: float) -> FloatArray:
    """Return the expected time in each state, shape (N,) [s].

    1 / (1 - a_ii) frames each [Kulic2007]; the last state, which nothing leaves, lasts for what
    remains of the primitive's mean duration, one frame at least.
    """
    leading = primitive.hmm.durations_frames / model_rate_hz
    rest = max(primitive.mean_duration_s - leading.sum(), 1.0 / model_rate_hz)
    return np.append(leading, rest)


def schedule(path: Sequence[GenerativePrimitive], model_rate_hz: float, rate_hz: float) -> Schedule:
    """Return which state of which primitive each frame is in, at any frame rate."""
    states = []
    for primitive in path:
        ends = np.cumsum(state_durations_s(primitive, model_rate_hz)) * rate_hz
        n_frames = max(round(ends[-1]), 1)
        middle = np.arange(n_frames) + 0.5
        states.append(np.minimum(np.searchsorted(ends, middle), len(ends) - 1))
    lengths = [len(part) for part in states]
    return Schedule(
        starts=np.cumsum([0, *lengths[:-1]]),
        positions=np.repeat(np.arange(len(path)), lengths),
        states=np.concatenate(states),
    )

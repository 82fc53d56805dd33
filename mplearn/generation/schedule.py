"""How long each state lasts, and which state each frame of a path is in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from ..errors import InvalidValueError
from ..hmm import LeftRightHMM
from ..recording import FloatArray, IntArray
from .dynamics import Dynamics
from .trajectory import MAX_FRAMES


class GenerativePrimitive(Protocol):
    """What a primitive must offer to be generated; `mplearn.library.Primitive` does.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> from mplearn.library import Primitive
        >>> swing = np.sin(np.linspace(0, np.pi, 50))[:, None]
        >>> model = fit([swing], n_states=6, variance_floor=1e-3)
        >>> primitive: GenerativePrimitive = Primitive.from_exemplars(1, model, [swing], 50.0)
        >>> primitive.id, primitive.mean_duration_s, len(primitive.exemplars)
        (1, 1.0, 1)
    """

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


def state_durations_s(primitive: GenerativePrimitive) -> FloatArray:
    """Return the expected time in each state, shape (N,) [s], summing to the mean duration.

    In a model fitted by maximum likelihood this is 1 / (1 - a_ii) frames [Kulic2007]. It is taken
    from the aligned exemplars, as the model says nothing about its last, absorbing state, and a
    prior on its stays biases the others.
    """
    durations = primitive.dynamics.durations_s
    return np.asarray(durations * (primitive.mean_duration_s / durations.sum()))


def schedule(path: Sequence[GenerativePrimitive], rate_hz: float) -> Schedule:
    """Return which state of which primitive each frame is in, at any frame rate.

    Raises:
        InvalidValueError: These are more than `MAX_FRAMES`.
    """
    n_in_all = rate_hz * sum(primitive.mean_duration_s for primitive in path)
    if n_in_all > MAX_FRAMES:
        raise InvalidValueError(
            f"a path of {len(path)} primitives at {rate_hz:g} Hz has {n_in_all:.3g} frames, "
            f"more than {MAX_FRAMES}"
        )
    states = []
    for primitive in path:
        ends = np.cumsum(state_durations_s(primitive)) * rate_hz
        n_frames = max(round(ends[-1]), 1)
        middle = np.arange(n_frames) + 0.5
        states.append(np.minimum(np.searchsorted(ends, middle), len(ends) - 1))
    lengths = [len(part) for part in states]
    return Schedule(
        starts=np.cumsum([0, *lengths[:-1]]),
        positions=np.repeat(np.arange(len(path)), lengths),
        states=np.concatenate(states),
    )

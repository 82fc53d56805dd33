"""Additive sufficient statistics: a group's model is a sum over its exemplars."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import ModelError
from ..recording import FloatArray
from . import em
from .model import LeftRightHMM
from .sequences import SequenceBatch


class Statistics(NamedTuple):
    """Expected statistics of some sequences under a model of N states over D channels.

    Adding a sequence, removing one, or merging two groups is addition and subtraction.

    Attributes:
        mass: Posterior-weighted count of measurements, shape (N, D).
        first: Sum of the measurements, shape (N, D).
        second: Sum of their squares, shape (N, D).
        stays: Expected transitions n -> n, shape (N,).
        moves: Expected transitions n -> n + 1, shape (N,).
        log_likelihood: Of all the sequences.
        n_sequences: How many.
    """

    mass: FloatArray
    first: FloatArray
    second: FloatArray
    stays: FloatArray
    moves: FloatArray
    log_likelihood: float = 0.0
    n_sequences: int = 0

    @classmethod
    def zeros(cls, n_states: int, n_channels: int) -> Statistics:
        """Return the statistics of no sequence at all."""
        mass, first, second = np.zeros((3, n_states, n_channels))
        stays, moves = np.zeros((2, n_states))
        return cls(mass, first, second, stays, moves)

    def plus(self, other: Statistics) -> Statistics:
        """Return the statistics of both groups of sequences together."""
        return self._combined(other, 1)

    def minus(self, other: Statistics) -> Statistics:
        """Return the statistics without those of ``other``, a part of this group."""
        return self._combined(other, -1)

    def _combined(self, other: Statistics, sign: int) -> Statistics:
        return Statistics(
            self.mass + sign * other.mass,
            self.first + sign * other.first,
            self.second + sign * other.second,
            self.stays + sign * other.stays,
            self.moves + sign * other.moves,
            self.log_likelihood + sign * other.log_likelihood,
            self.n_sequences + sign * other.n_sequences,
        )

    @classmethod
    def equal_split(
        cls,
        sequences: Sequence[FloatArray],
        n_states: int,
        weights: Sequence[FloatArray] | None = None,
    ) -> Statistics:
        """Return the statistics where each sequence is cut into ``n_states`` equal parts.

        Raises:
            ModelError: A sequence has fewer frames than there are states.
        """
        batch = SequenceBatch.of(sequences, weights)
        check_lengths(batch, n_states)
        total = cls.zeros(n_states, batch.n_channels)
        em.equal_split(batch.frames, batch.weights, batch.offsets, tuple(total[:5]))
        return total._replace(n_sequences=batch.n_sequences)

    @classmethod
    def expected(
        cls,
        model: LeftRightHMM,
        sequences: Sequence[FloatArray],
        weights: Sequence[FloatArray] | None = None,
        *,
        complete: bool = True,
    ) -> Statistics:
        """Return the expected statistics of sequences under a model: the E-step.

        Raises:
            ModelError: A complete sequence has fewer frames than the model has states, or is
                impossible under it.
        """
        batch = SequenceBatch.of(sequences, weights)
        if complete:
            check_lengths(batch, model.n_states)
        total = cls.zeros(model.n_states, model.n_channels)
        parameters = (model.means, model.variances, model.log_stay, model.log_next)
        likelihood = em.expectation(*batch, parameters, complete, tuple(total[:5]))
        if not np.isfinite(likelihood):
            raise ModelError("a sequence is impossible under the model: its likelihood is 0")
        return total._replace(log_likelihood=likelihood, n_sequences=batch.n_sequences)

    def to_model(
        self, variance_floor: float | FloatArray = 1e-6, duration_prior: float = 1.0
    ) -> LeftRightHMM:
        """Return the most probable model: the M-step.

        A channel that a state never saw takes the mean that lies between its neighbours'.

        Args:
            variance_floor: Smallest variance, one for all channels or one each, shape (D,).
            duration_prior: Transitions of either kind added to each state's count, so that no
                state becomes of a fixed duration.

        Raises:
            ModelError: A channel was never measured, or the floor is not positive.
        """
        parameters = empty_parameters(*self.mass.shape)
        floor = as_floor(variance_floor, self.mass.shape[1])
        em.maximisation(tuple(self[:5]), floor, duration_prior, parameters)
        return as_model(parameters)


def empty_parameters(n_states: int, n_channels: int) -> tuple[FloatArray, ...]:
    """Return arrays for the kernels to write means, variances, log_stay and log_next into."""
    shapes = (n_states, n_channels), (n_states, n_channels), (n_states,), (n_states,)
    return tuple(np.zeros(shape) for shape in shapes)


def as_model(parameters: tuple[FloatArray, ...]) -> LeftRightHMM:
    """Return the model of what the kernels wrote.

    Raises:
        ModelError: A channel was never measured.
    """
    unknown = np.flatnonzero(np.isnan(parameters[0][0]))
    if len(unknown):
        raise ModelError(f"channels {unknown.tolist()} were never measured")
    return LeftRightHMM(*parameters[:3])


def as_floor(variance_floor: float | FloatArray, n_channels: int) -> FloatArray:
    """Return the smallest variance of each channel, shape (D,).

    Raises:
        ModelError: It is not positive, or of another shape.
    """
    floor = np.asarray(variance_floor, dtype=np.float64)
    if floor.shape not in ((), (n_channels,)) or not np.isfinite(floor).all() or (floor <= 0).any():
        raise ModelError(
            f"variance_floor must be positive, one value or ({n_channels},), not {variance_floor}"
        )
    return np.full(n_channels, 1.0) * floor


def check_lengths(batch: SequenceBatch, n_states: int) -> None:
    """Raise a ModelError where a sequence has fewer frames than there are states."""
    shortest = int(np.diff(batch.offsets).min())
    if shortest < n_states:
        raise ModelError(
            f"{n_states} states need sequences of at least {n_states} frames, not {shortest}"
        )

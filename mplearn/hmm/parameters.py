"""What the kernels of EM take and leave: floors, arrays to write into, models."""

from __future__ import annotations

import numpy as np

from ..errors import ModelError
from ..recording import FloatArray
from .em import Parameters
from .model import LeftRightHMM
from .sequences import SequenceBatch


def empty_parameters(n_states: int, n_channels: int) -> Parameters:
    """Return arrays for the kernels to write into."""
    shapes = (n_states, n_channels), (n_states, n_channels), (n_states,), (n_states,)
    return Parameters(*(np.zeros(shape) for shape in shapes))


def as_model(parameters: Parameters) -> LeftRightHMM:
    """Return the model of what the kernels wrote.

    Raises:
        ModelError: A channel was never measured.
    """
    unknown = np.flatnonzero(np.isnan(parameters.means[0]))
    if len(unknown):
        raise ModelError(f"channels {unknown.tolist()} were never measured")
    return LeftRightHMM(parameters.means, parameters.variances, parameters.log_stay)


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

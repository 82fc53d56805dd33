"""Fitting of left-right HMMs: equal-length initial split, then expectation maximisation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InvalidValueError, ModelError
from ..recording import FloatArray
from .em import em
from .model import LeftRightHMM
from .parameters import as_floor, as_model, check_lengths, empty_parameters
from .sequences import SequenceBatch


def fit(
    sequences: Sequence[FloatArray],
    n_states: int = 8,
    *,
    weights: Sequence[FloatArray] | None = None,
    n_steps: int = 5,
    tolerance: float = 1e-4,
    variance_floor: float | FloatArray = 1e-6,
    duration_prior: float = 1.0,
    complete: bool = True,
) -> LeftRightHMM:
    """Fit a left-right HMM to demonstrations of one motion.

    Args:
        sequences: The demonstrations, shape (T_s, D) each; NaN where a measurement is missing.
        n_states: Number of states N.
        weights: How much each frame counts, shape (T_s,) each; 1 by default.
        n_steps: Largest number of EM steps; 0 leaves the equal-length split.
        tolerance: EM ends when a step gains less than this log-likelihood per frame [nat].
        variance_floor: Smallest variance, one for all channels or one each, shape (D,), in squared
            units of the channels.
        duration_prior: Transitions of either kind added to each state's count.
        complete: Whether each sequence is a whole motion that ends in the last state.

    Raises:
        ModelError: A sequence has fewer frames than there are states, or a channel is never
            measured.
        InvalidValueError: ``n_states`` or ``n_steps`` is out of range.

    Example:
        >>> import numpy as np
        >>> swing = [np.sin(np.linspace(0, np.pi, n))[:, None] for n in (40, 44, 48)]
        >>> model = fit(swing, n_states=4, variance_floor=1e-3)
        >>> model.means.round(1).ravel().tolist()
        [0.3, 0.8, 0.9, 0.4]
        >>> model.score(swing[0]) > model.score(-swing[0])
        True
    """
    if n_states < 1 or n_steps < 0:
        raise InvalidValueError(f"n_states >= 1 and n_steps >= 0, not {n_states} and {n_steps}")
    batch = SequenceBatch.of(sequences, weights)
    check_lengths(batch, n_states)
    floor = as_floor(variance_floor, batch.n_channels)
    parameters = empty_parameters(n_states, batch.n_channels)
    gain = tolerance * len(batch.frames)
    likelihood = em(batch, floor, duration_prior, complete, n_steps, gain, parameters)
    if n_steps and not np.isfinite(likelihood):
        raise ModelError("a sequence became impossible: check its values and the variance floor")
    return as_model(parameters)

"""Choice of the number of states by an information criterion [Kulic2012, 2.2]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray
from .fit import fit
from .model import LeftRightHMM
from .stack import score_batch

CRITERIA = ("aic", "bic")


class SizeSelection(NamedTuple):
    """Which size an information criterion prefers.

    Attributes:
        n_states: The best number of states.
        model: The model of that size.
        criterion: Value of the criterion for each size tried; smaller is better.

    Example:
        >>> import numpy as np
        >>> swing = [np.sin(np.linspace(0, np.pi, n))[:, None] for n in (40, 44)]
        >>> chosen = select_size(swing, (2, 6), variance_floor=1e-3)
        >>> chosen.n_states, bool(chosen.criterion[6] < chosen.criterion[2])
        (6, True)
    """

    n_states: int
    model: LeftRightHMM
    criterion: dict[int, float]


def n_parameters(n_states: int, n_channels: int) -> int:
    """Return the free parameters of a left-right diagonal model: 2 N D + (N - 1)."""
    return 2 * n_states * n_channels + n_states - 1


def select_size(
    sequences: Sequence[FloatArray],
    sizes: Sequence[int] = (2, 4, 6, 8, 10, 12),
    *,
    criterion: str = "bic",
    n_steps: int = 10,
    variance_floor: float | FloatArray = 1e-6,
) -> SizeSelection:
    """Fit a model of each size and return the best by AIC or BIC.

    Args:
        sequences: Demonstrations, shape (T_s, D) each.
        sizes: Numbers of states to try; those larger than the shortest sequence are left out.
        criterion: "aic" (2 k - 2 log L) or "bic" (k log n - 2 log L), n frames in all.
        n_steps: EM steps of each fit.
        variance_floor: As in `fit`.

    Raises:
        InvalidValueError: The criterion is unknown, or no size is left.

    Example:
        >>> still = [np.full((30, 1), k / 100) for k in range(3)]
        >>> select_size(still, (1, 2, 4), variance_floor=1e-2).n_states
        1
    """
    if criterion not in CRITERIA:
        raise InvalidValueError(f"criterion must be one of {CRITERIA}, not {criterion!r}")
    shortest = min((len(frames) for frames in sequences), default=0)
    n_frames = sum(len(frames) for frames in sequences)
    values: dict[int, float] = {}
    models: dict[int, LeftRightHMM] = {}
    for size in sizes:
        if not 1 <= size <= shortest:
            continue
        model = fit(sequences, size, n_steps=n_steps, variance_floor=variance_floor)
        likelihood = float(score_batch([model], sequences).sum())
        penalty = 2.0 if criterion == "aic" else np.log(n_frames)
        values[size] = penalty * n_parameters(size, model.n_channels) - 2 * likelihood
        models[size] = model
    if not values:
        raise InvalidValueError(f"sizes must hold one in [1, {shortest}], not {tuple(sizes)}")
    best = min(values, key=lambda size: (values[size], size))
    return SizeSelection(best, models[best], values)

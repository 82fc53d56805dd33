"""Fitting of factorial HMMs, and chains added where they are needed.

After [Kulic2008b]: a motion starts as one chain; where two neighbouring nodes cannot be told apart
a chain is added, fitted to what the others leave unexplained.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import InvalidValueError, ModelError
from ...recording import FloatArray
from ..fit import fit
from ..model import LeftRightHMM
from ..motion_model import MotionModel
from ..parameters import as_floor
from ..sequences import as_frames, as_weights
from .model import FactorialHMM
from .posterior import Moments


def fit_factorial(
    sequences: Sequence[FloatArray],
    sizes: Sequence[int] = (8, 8),
    *,
    weights: Sequence[FloatArray] | None = None,
    n_steps: int = 5,
    variance_floor: float | FloatArray = 1e-6,
    duration_prior: float = 1.0,
    exact: bool | None = None,
) -> FactorialHMM:
    """Fit a factorial HMM to demonstrations of one motion, chain after chain.

    Args:
        sequences: The demonstrations, whole motions, shape (T_s, D) each; NaN where missing.
        sizes: Number of states of each chain.
        weights: How much each frame counts, shape (T_s,) each; 1 by default.
        n_steps: EM steps over all chains after each chain that is added.
        variance_floor: Smallest variance, one for all channels or one each, shape (D,).
        duration_prior: Transitions of either kind added to each state's count.
        exact: As in `FactorialHMM.moments`.

    Raises:
        ModelError: A sequence has fewer frames than there are states, or a channel is never
            measured.
        InvalidValueError: There is no chain, or a number is out of range.

    Example:
        >>> import numpy as np
        >>> t = np.linspace(0, 1, 60)
        >>> two = np.stack((np.sin(np.pi * t), np.sin(3 * np.pi * t)), axis=1)
        >>> model = fit_factorial([two], (3, 4), variance_floor=1e-3)
        >>> [chain.n_states for chain in model.chains], model.mean_motion().shape[1]
        ([3, 4], 2)
    """
    if not len(sizes):
        raise InvalidValueError("sizes must name at least one chain")
    first = fit(
        sequences,
        sizes[0],
        weights=weights,
        variance_floor=variance_floor,
        duration_prior=duration_prior,
    )
    model = FactorialHMM((first.means,), (first.log_stay,), first.variances.mean(axis=0))
    for i, size in enumerate(sizes):
        if i > 0:
            model = add_chain(model, sequences, size, weights=weights, exact=exact)
        for _ in range(n_steps):
            model = em_step(
                model,
                sequences,
                weights=weights,
                variance_floor=variance_floor,
                duration_prior=duration_prior,
                exact=exact,
            )
    return model


def add_chain(
    model: LeftRightHMM | FactorialHMM,
    sequences: Sequence[FloatArray],
    n_states: int = 8,
    *,
    weights: Sequence[FloatArray] | None = None,
    exact: bool | None = None,
) -> FactorialHMM:
    """Add a chain fitted to what the others leave unexplained of a motion's demonstrations.

    It alone does not make them likelier yet: `em_step` fits all chains together.

    Raises:
        ModelError: A sequence has fewer frames than there are states.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> t = np.linspace(0, 1, 60)
        >>> two = np.stack((np.sin(np.pi * t), np.sin(3 * np.pi * t)), axis=1)
        >>> one_chain = fit([two], 3, variance_floor=1e-3)
        >>> both = add_chain(one_chain, [two], 4)
        >>> fitted = em_step(both, [two], variance_floor=1e-3)  # all chains together
        >>> fitted.score(two) > one_chain.score(two), len(both.chains)
        (True, 2)
    """
    if isinstance(model, LeftRightHMM):
        model = FactorialHMM((model.means,), (model.log_stay,), model.variances.mean(axis=0))
    means = np.concatenate(model.means)
    residuals = []
    for s, frames in enumerate(sequences):
        own = None if weights is None else weights[s]
        expected = model.moments(frames, own, exact=exact).marginals @ means
        residuals.append(np.asarray(frames, dtype=np.float64) - expected)
    added = fit(residuals, n_states, weights=weights, variance_floor=1e-3 * model.variances)
    return FactorialHMM(
        (*model.means, added.means), (*model.log_stays, added.log_stay), model.variances
    )


def em_step(
    model: FactorialHMM,
    sequences: Sequence[FloatArray],
    *,
    weights: Sequence[FloatArray] | None = None,
    variance_floor: float | FloatArray = 1e-6,
    duration_prior: float = 1.0,
    exact: bool | None = None,
) -> FactorialHMM:
    """Take one step of expectation and maximisation over all chains together.

    Raises:
        ModelError: A sequence is impossible, or too short.

    Example:
        >>> import numpy as np
        >>> t = np.linspace(0, 1, 60)
        >>> two = np.stack((np.sin(np.pi * t), np.sin(3 * np.pi * t)), axis=1)
        >>> model = fit_factorial([two], (3, 4), variance_floor=1e-3)
        >>> em_step(model, [two], variance_floor=1e-3).score(two) >= model.score(two) - 1e-6
        True
    """
    floor = as_floor(variance_floor, model.n_channels)
    moments, data, counts = [], [], []
    for s, frames in enumerate(sequences):
        frames = as_frames(frames, model.n_channels)
        weight = as_weights(None if weights is None else weights[s], len(frames))
        moments.append(model.moments(frames, weight, exact=exact))
        data.append(np.nan_to_num(frames, nan=0.0))
        counts.append(np.where(np.isnan(frames), 0.0, weight[:, None]))
    if not np.isfinite([each.log_likelihood for each in moments]).all():
        raise ModelError("a sequence is impossible under the model: its likelihood is 0")
    means, variances = _outputs(moments, np.concatenate(data), np.concatenate(counts), floor)
    bounds = np.cumsum([chain.n_states for chain in model.chains])[:-1]
    occupied = np.split(sum(each.marginals.sum(axis=0) for each in moments), bounds)
    stays = tuple(_log_stay(each, len(sequences), duration_prior) for each in occupied)
    return FactorialHMM(tuple(np.split(means, bounds)), stays, variances)


def needs_more_chains(
    model: MotionModel,
    sequences: Sequence[FloatArray],
    neighbour: MotionModel,
    neighbour_sequences: Sequence[FloatArray],
    *,
    separation: float = 2.0,
) -> bool:
    """Return whether two motions cannot be told apart by their models.

    Each sequence has a margin, the log-likelihood per frame by which its own model explains it
    better than the other does. They are told apart where the mean margin is at least ``separation``
    times its standard deviation over the sequences of both.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> up = [np.linspace(0, k, 40)[:, None] for k in (0.98, 1.0, 1.02)]
        >>> down = [-motion for motion in up]
        >>> models = [fit(motions, 4, variance_floor=1e-2) for motions in (up, down)]
        >>> needs_more_chains(models[0], up, models[1], down)  # one is enough to tell them apart
        False
    """
    each = margins(model, sequences, neighbour) + margins(neighbour, neighbour_sequences, model)
    return bool(np.mean(each) < separation * np.std(each))


def margins(own: MotionModel, sequences: Sequence[FloatArray], other: MotionModel) -> list[float]:
    """Return log P(O | own) - log P(O | other) per frame [nat] of each sequence."""
    return [(own.score(frames) - other.score(frames)) / len(frames) for frames in sequences]


def _outputs(
    moments: Sequence[Moments], data: FloatArray, counts: FloatArray, floor: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve for all chains' outputs, (S, D), and the variances, (D,): a regression a channel."""
    marginals = np.concatenate([each.marginals for each in moments])
    pairs = np.concatenate([each.pairs for each in moments])
    gram = np.einsum("td,tij->dij", counts, pairs, optimize=True)
    products = (counts * data).T @ marginals  # (D, S)
    inverse = np.linalg.pinv(gram, rcond=1e-10, hermitian=True)
    means = np.einsum("dij,dj->id", inverse, products)
    squares = (counts * data**2).sum(axis=0)
    explained = 2 * np.einsum("id,di->d", means, products)
    explained -= np.einsum("id,dij,jd->d", means, gram, means)
    mass = counts.sum(axis=0)
    if (mass <= 0).any():
        raise ModelError(f"channels {np.flatnonzero(mass <= 0).tolist()} were never measured")
    return means, np.maximum((squares - explained) / mass, floor)


def _log_stay(occupied: FloatArray, n_sequences: int, prior: float) -> FloatArray:
    """Most probable log_stay of a chain that each sequence ran through once, from its frames."""
    stays = np.maximum(occupied[:-1] - n_sequences, 0.0) + prior
    return np.append(np.log(stays / (stays + n_sequences + prior)), 0.0)

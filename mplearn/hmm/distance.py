"""The symmetric likelihood distance between motions [Kulic2012, eq. 5]."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..recording import FloatArray
from .model import LeftRightHMM
from .motion_model import MotionModel
from .sequences import SequenceBatch
from .stack import ModelStack, score_pairs


def distance(
    model_a: MotionModel,
    sequences_a: Sequence[FloatArray],
    model_b: MotionModel,
    sequences_b: Sequence[FloatArray],
    weights_a: Sequence[FloatArray] | None = None,
    weights_b: Sequence[FloatArray] | None = None,
) -> float:
    """Return how far two models are apart, per frame [nat], on the sequences they were trained on.

    Each direction is ``[log P(O | own) - log P(O | other)] / T``, averaged over the sequences of
    one model; the distance is the mean of both. Eq. 5 as printed has the opposite sign. Training
    sequences stand for generated ones: cheaper, and without sampling noise.

    Returns:
        About 0 for equal models; +inf where a sequence is shorter than the other's states.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> swing = np.sin(np.linspace(0, np.pi, 40))[:, None]
        >>> up, low = (fit([k * swing], n_states=4, variance_floor=1e-2) for k in (1.0, 0.5))
        >>> distance(up, [swing], up, [swing]) == 0.0 < distance(up, [swing], low, [0.5 * swing])
        True
    """
    directions = []
    for own, other, sequences, weights in (
        (model_a, model_b, sequences_a, weights_a),
        (model_b, model_a, sequences_b, weights_b),
    ):
        batch = SequenceBatch.of(sequences, weights)
        here, there = _scores(own, batch), _scores(other, batch)
        directions.append(np.mean((here - there) / batch.masses))
    return float(np.mean(directions))


def _scores(model: MotionModel, batch: SequenceBatch) -> FloatArray:
    """Return log P(O_s | model) of all sequences, shape (S,)."""
    if isinstance(model, LeftRightHMM):
        pairs = np.stack([np.zeros(batch.n_sequences), np.arange(batch.n_sequences)], axis=1)
        return score_pairs(ModelStack.of([model]), batch, pairs.astype(np.int64))
    stretches = [slice(a, b) for a, b in pairwise(batch.offsets)]
    return np.array([model.score(batch.frames[s], batch.weights[s]) for s in stretches])


def distance_matrix(
    models: Sequence[LeftRightHMM],
    sequences: Sequence[FloatArray],
    weights: Sequence[FloatArray] | None = None,
) -> FloatArray:
    """Return the distances [nat] of M motions of one sequence each, shape (M, M), symmetric.

    Model m is the one fitted to sequence m.

    Example:
        >>> from mplearn.hmm import fit
        >>> t = np.linspace(0.0, 1.0, 30)[:, None]
        >>> motions = [np.sin(3.0 * t), np.sin(3.0 * t) + 0.01, np.cos(3.0 * t)]
        >>> apart = distance_matrix([fit([motion], 5) for motion in motions], motions)
        >>> bool(apart[0, 1] < 0.1 * apart[0, 2])
        True
    """
    stack, batch = ModelStack.of(models), SequenceBatch.of(sequences, weights)
    pairs = np.indices((stack.n_models, batch.n_sequences)).reshape(2, -1).T
    scores = score_pairs(stack, batch, pairs).reshape(stack.n_models, -1)
    directed = (np.diag(scores)[None, :] - scores) / batch.masses[None, :]
    return np.asarray((directed + directed.T) / 2)

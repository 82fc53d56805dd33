"""The symmetric likelihood distance between motions [Kulic2012, eq. 5]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..recording import FloatArray
from .model import LeftRightHMM
from .sequences import SequenceBatch
from .stack import ModelStack, score_pairs


def distance(
    model_a: LeftRightHMM,
    sequences_a: Sequence[FloatArray],
    model_b: LeftRightHMM,
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
    """
    stack = ModelStack.of([model_a, model_b])
    directions = []
    for own, sequences, weights in ((0, sequences_a, weights_a), (1, sequences_b, weights_b)):
        batch = SequenceBatch.of(sequences, weights)
        each = np.arange(batch.n_sequences)
        pairs = np.stack([np.repeat([own, 1 - own], len(each)), np.tile(each, 2)], axis=1)
        here, there = score_pairs(stack, batch, pairs).reshape(2, -1)
        directions.append(np.mean((here - there) / batch.masses))
    return float(np.mean(directions))


def distance_matrix(
    models: Sequence[LeftRightHMM],
    sequences: Sequence[FloatArray],
    weights: Sequence[FloatArray] | None = None,
) -> FloatArray:
    """Return the distances [nat] of M motions of one sequence each, shape (M, M), symmetric.

    Model m is the one fitted to sequence m.
    """
    stack, batch = ModelStack.of(models), SequenceBatch.of(sequences, weights)
    pairs = np.indices((stack.n_models, batch.n_sequences)).reshape(2, -1).T
    scores = score_pairs(stack, batch, pairs).reshape(stack.n_models, -1)
    directed = (np.diag(scores)[None, :] - scores) / batch.masses[None, :]
    return np.asarray((directed + directed.T) / 2)

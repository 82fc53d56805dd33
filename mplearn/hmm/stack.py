"""Many models as one block of arrays, and the scores of all of them on all sequences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import ModelError
from ..recording import FloatArray, IntArray
from . import kernels
from .model import LeftRightHMM
from .sequences import SequenceBatch

# multiply-adds from which on waking the other cores is worth its cost
_WORTH_THREADS = 20_000_000


class ModelStack(NamedTuple):
    """Models side by side, padded to the largest.

    Attributes:
        means: Shape (M, N, D).
        variances: Shape (M, N, D).
        log_norms: -log(2 pi variance) / 2, shape (M, N, D).
        log_stay: Shape (M, N).
        log_next: Shape (M, N).
        n_states: States that are not padding, shape (M,).
        scales: -1 / (2 variance), shape (M, N, D).
        norms: Sums of ``log_norms`` over the channels, shape (M, N).

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> up = np.linspace(0.0, 1.0, 40)[:, None]
        >>> models = [fit([up], n_states, variance_floor=1e-2) for n_states in (4, 6)]
        >>> stack = ModelStack.of(models)
        >>> stack.n_models, stack.means.shape, stack.n_states.tolist()
        (2, (2, 6, 1), [4, 6])
    """

    means: FloatArray
    variances: FloatArray
    log_norms: FloatArray
    log_stay: FloatArray
    log_next: FloatArray
    n_states: IntArray
    scales: FloatArray
    norms: FloatArray

    @classmethod
    def of(cls, models: Sequence[LeftRightHMM]) -> ModelStack:
        """Stack models of any number of states over the same channels.

        Raises:
            ModelError: There is none, or their numbers of channels differ.
        """
        widths = sorted({model.n_channels for model in models})
        if len(widths) != 1:
            raise ModelError(f"models must share one number of channels, not {widths}")
        stack = cls.room(len(models), max(model.n_states for model in models), widths[0])
        for m, model in enumerate(models):
            stack.put(m, model)
        return stack

    @classmethod
    def room(cls, n_models: int, n_states: int, n_channels: int) -> ModelStack:
        """Return a stack with room for models of at most so many states."""
        shape = (n_models, n_states, n_channels)
        return cls(
            np.zeros(shape),
            np.ones(shape),
            np.zeros(shape),
            np.zeros(shape[:2]),
            np.full(shape[:2], -np.inf),
            np.zeros(n_models, np.int64),
            np.full(shape, -0.5),
            np.zeros(shape[:2]),
        )

    def put(self, row: int, model: LeftRightHMM) -> None:
        """Write a model into a row."""
        n = model.n_states
        self.means[row, :n] = model.means
        self.variances[row, :n] = model.variances
        self.log_norms[row, :n] = model.log_norms
        self.log_stay[row, :n] = model.log_stay
        self.log_next[row, :n] = model.log_next
        self.n_states[row] = n
        self.scales[row, :n] = -0.5 / model.variances
        self.norms[row, :n] = model.log_norms.sum(axis=1)

    @property
    def n_models(self) -> int:
        """Number of models M."""
        return len(self.n_states)


def score_batch(
    models: Sequence[LeftRightHMM],
    sequences: Sequence[FloatArray],
    weights: Sequence[FloatArray] | None = None,
    *,
    complete: bool = True,
) -> FloatArray:
    """Return log P(O_s | lambda_m) of every model on every sequence, shape (M, S).

    Runs on all cores where the work is large; the result does not depend on it.

    Args:
        models: M models over the same channels.
        sequences: S sequences of shape (T_s, D).
        weights: Weight of each frame, shape (T_s,) each.
        complete: Whether motions must end in the last state, see `LeftRightHMM`.

    Raises:
        ModelError: The models' widths differ from each other or from the sequences'.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> up = np.linspace(0.0, 1.0, 40)[:, None]
        >>> models = [fit([motion], 4, variance_floor=1e-2) for motion in (up, -up)]
        >>> score_batch(models, [up, -up]).argmax(axis=0).tolist()
        [0, 1]
    """
    stack, batch = ModelStack.of(models), SequenceBatch.of(sequences, weights)
    pairs = np.indices((stack.n_models, batch.n_sequences)).reshape(2, -1).T
    return score_pairs(stack, batch, pairs, complete=complete).reshape(stack.n_models, -1)


def score_pairs(
    stack: ModelStack, batch: SequenceBatch, pairs: IntArray, *, complete: bool = True
) -> FloatArray:
    """Return log P(O_s | lambda_m) of the pairs (m, s), shape (P, 2) -> (P,).

    Raises:
        ModelError: Models and sequences differ in their channels.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import SequenceBatch, fit
        >>> up = np.linspace(0.0, 1.0, 40)[:, None]
        >>> stack = ModelStack.of([fit([motion], 4, variance_floor=1e-2) for motion in (up, -up)])
        >>> own, other = score_pairs(stack, SequenceBatch.of([up, -up]), np.array([[0, 0], [0, 1]]))
        >>> bool(own > other)
        True
    """
    if stack.means.shape[2] != batch.n_channels:
        raise ModelError(
            f"models of {stack.means.shape[2]} channels cannot score {batch.n_channels}"
        )
    pairs = np.ascontiguousarray(pairs, dtype=np.int64)
    lengths = np.diff(batch.offsets)
    work = int(lengths[pairs[:, 1]].sum()) * stack.means[0].size
    kernel = kernels.score_pairs_parallel if work > _WORTH_THREADS else kernels.score_pairs
    return np.asarray(kernel(stack, batch, pairs, complete))

"""Log-space recursions of left-right HMMs with diagonal Gaussians, compiled.

Everything is in log space: scaled recursions are silently wrong in a left-right chain far from the
data. Densities are formed channel after channel with time innermost, (D, T) in and (N, T) out, so
that they vectorise without reordering any sum: a result depends neither on the number of threads
nor on what is scored beside it.

A chain starts in its first state; ``complete`` demands that it ends in its last one. A NaN channel
drops out of the density of its frame (it is marginalised); a frame of weight w counts as w frames.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import prange

from ..maths.compiling import njit
from ..recording import FloatArray, IntArray

# exp(-38) is less than half a unit in the last place of a sum whose larger term is 1
_NEGLIGIBLE = 38.0
_LOG_2PI = np.log(2 * np.pi)


class Gaussians(NamedTuple):
    """What a model's states emit.

    Attributes:
        means: Shape (N, D).
        variances: Shape (N, D).
        log_norms: `log_norms` of the variances, shape (N, D).
    """

    means: FloatArray
    variances: FloatArray
    log_norms: FloatArray


@njit(cache=True, inline="always")
def log_add(a: float, b: float) -> float:
    """Return log(exp(a) + exp(b))."""
    if a < b:
        a, b = b, a
    if a - b > _NEGLIGIBLE or b == -np.inf:
        return a
    return float(a + np.log1p(np.exp(b - a)))


@njit(cache=True)
def has_infinity(frames: FloatArray) -> bool:
    """Return whether any value is infinite."""
    found = False
    for value in frames.flat:
        found |= abs(value) == np.inf
    return found


@njit(cache=True)
def log_norms(variances: FloatArray) -> FloatArray:
    """Return the log of each Gaussian's normalisation, -log(2 pi variance) / 2."""
    return np.asarray(-0.5 * (_LOG_2PI + np.log(variances)))


@njit(cache=True)
def log_densities(
    columns: FloatArray,
    weights: FloatArray,
    begin: int,
    end: int,
    gaussians: Gaussians,
) -> FloatArray:
    """Return the weighted log-density of frames [begin, end) in each state, shape (N, T).

    Args:
        columns: Frames transposed, shape (D, at least ``end``), NaN where missing.
        weights: Shape (at least ``end``,).
        begin: First frame.
        end: One past the last.
        gaussians: Of the N states.
    """
    means, variances, norms = gaussians.means, gaussians.variances, gaussians.log_norms
    n_states, n_frames = len(means), end - begin
    out = np.zeros((n_states, n_frames))
    weight = weights[begin:end]
    for n in range(n_states):
        row = out[n]
        for d in range(columns.shape[0]):
            column = columns[d, begin:end]
            mean = means[n, d]
            norm = norms[n, d]
            scale = -0.5 / variances[n, d]
            for t in range(n_frames):
                offset = column[t] - mean
                term = norm + scale * offset * offset
                row[t] += term if term == term else 0.0
        for t in range(n_frames):
            row[t] *= weight[t]
    return out


@njit(cache=True)
def log_likelihood(
    densities: FloatArray, log_stay: FloatArray, log_next: FloatArray, complete: bool
) -> float:
    """Return log P(O) from log-densities (N, T), keeping one column of the forward variable."""
    n_states, n_frames = densities.shape
    alpha = np.full(n_states, -np.inf)
    alpha[0] = densities[0, 0]
    for t in range(1, n_frames):
        least = max(n_states - n_frames + t, 0) if complete else 0  # from below no end is reached
        for n in range(min(t, n_states - 1), max(least - 1, 0), -1):
            alpha[n] = densities[n, t] + log_add(
                alpha[n] + log_stay[n], alpha[n - 1] + log_next[n - 1]
            )
        if least == 0:
            alpha[0] += log_stay[0] + densities[0, t]
    if complete:
        return float(alpha[n_states - 1])
    total = -np.inf
    for n in range(n_states):
        total = log_add(total, alpha[n])
    return total


@njit(cache=True)
def forward(densities: FloatArray, log_stay: FloatArray, log_next: FloatArray) -> FloatArray:
    """Return the forward variable log P(o_1..o_t, s_t = n), shape (T, N)."""
    n_states, n_frames = densities.shape
    alpha = np.full((n_frames, n_states), -np.inf)
    alpha[0, 0] = densities[0, 0]
    for t in range(1, n_frames):
        alpha[t, 0] = alpha[t - 1, 0] + log_stay[0] + densities[0, t]
        for n in range(1, min(t, n_states - 1) + 1):
            alpha[t, n] = densities[n, t] + log_add(
                alpha[t - 1, n] + log_stay[n], alpha[t - 1, n - 1] + log_next[n - 1]
            )
    return alpha


@njit(cache=True)
def backward(
    densities: FloatArray, log_stay: FloatArray, log_next: FloatArray, complete: bool
) -> FloatArray:
    """Return the backward variable log P(o_t+1..o_T | s_t = n), shape (T, N)."""
    n_states, n_frames = densities.shape
    last = n_states - 1
    beta = np.empty((n_frames, n_states))
    beta[n_frames - 1] = -np.inf if complete else 0.0
    beta[n_frames - 1, last] = 0.0
    for t in range(n_frames - 2, -1, -1):
        beta[t, last] = log_stay[last] + densities[last, t + 1] + beta[t + 1, last]
        for n in range(last):
            beta[t, n] = log_add(
                log_stay[n] + densities[n, t + 1] + beta[t + 1, n],
                log_next[n] + densities[n + 1, t + 1] + beta[t + 1, n + 1],
            )
    return beta


@njit(cache=True)
def viterbi(
    densities: FloatArray, log_stay: FloatArray, log_next: FloatArray, complete: bool
) -> tuple[IntArray, float]:
    """Return the most probable state path, shape (T,), and its log-probability."""
    n_states, n_frames = densities.shape
    best = np.full((n_frames, n_states), -np.inf)
    best[0, 0] = densities[0, 0]
    for t in range(1, n_frames):
        best[t, 0] = best[t - 1, 0] + log_stay[0] + densities[0, t]
        for n in range(1, n_states):
            best[t, n] = densities[n, t] + max(
                best[t - 1, n] + log_stay[n], best[t - 1, n - 1] + log_next[n - 1]
            )
    path = np.empty(n_frames, np.int64)
    state = n_states - 1 if complete else np.argmax(best[n_frames - 1])
    score = best[n_frames - 1, state]
    for t in range(n_frames - 1, 0, -1):
        path[t] = state
        if state > 0:
            moved = best[t - 1, state - 1] + log_next[state - 1]
            if moved > best[t - 1, state] + log_stay[state]:
                state -= 1
    path[0] = state
    return path, score


@njit(cache=True)
def _score(models: Any, batch: Any, m: int, s: int, complete: bool) -> float:
    n = models.n_states[m]
    gaussians = Gaussians(models.means[m, :n], models.variances[m, :n], models.log_norms[m, :n])
    begin, end = batch.offsets[s], batch.offsets[s + 1]
    densities = log_densities(batch.columns, batch.weights, begin, end, gaussians)
    return log_likelihood(densities, models.log_stay[m], models.log_next[m], complete)


@njit(cache=True)
def score_frames(
    frames: FloatArray,
    weights: FloatArray,
    gaussians: Gaussians,
    log_stay: FloatArray,
    log_next: FloatArray,
    complete: bool,
) -> float:
    """Return log P(O) of frames (T, D) under one model: one call, since calls cost as much."""
    columns = frames.T.copy()
    densities = log_densities(columns, weights, 0, len(frames), gaussians)
    return float(log_likelihood(densities, log_stay, log_next, complete))


@njit(cache=True)
def score_pairs(models: Any, batch: Any, pairs: IntArray, complete: bool) -> FloatArray:
    """Return log P(O_s | lambda_m) for each pair (m, s), shape (P, 2) -> (P,), on one core.

    Args:
        models: A `ModelStack`.
        batch: A `SequenceBatch`.
        pairs: Model and sequence of each score.
        complete: Whether chains end in their last state.
    """
    scores = np.empty(len(pairs))
    for p in range(len(pairs)):
        scores[p] = _score(models, batch, pairs[p, 0], pairs[p, 1], complete)
    return scores


@njit(cache=True, parallel=True)
def score_pairs_parallel(models: Any, batch: Any, pairs: IntArray, complete: bool) -> FloatArray:
    """Return what `score_pairs` returns, to the bit, on all cores."""
    scores = np.empty(len(pairs))
    for p in prange(len(pairs)):
        scores[p] = _score(models, batch, pairs[p, 0], pairs[p, 1], complete)
    return scores

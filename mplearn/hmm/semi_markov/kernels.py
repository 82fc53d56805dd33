"""Recursions of left-right semi-Markov models in log space, compiled.

A state is entered once and left once, so that all is said by alpha[n, t], the log-probability of
the first t frames with state n ending there. Costs O(N T^2).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...maths.compiling import njit
from ...recording import FloatArray
from ..em import Emitted, accumulate
from ..kernels import Gaussians, log_densities
from ..sequences import SequenceBatch


class Statistics(NamedTuple):
    """Expected sufficient statistics.

    Attributes:
        emitted: What each state emitted.
        lengths: Sum of its durations [frame], shape (N,).
        squares: Sum of their squares, shape (N,).
    """

    emitted: Emitted
    lengths: FloatArray
    squares: FloatArray


@njit(cache=True)
def _log_sum(terms: FloatArray, n: int) -> float:
    """Return log sum exp of the first n terms."""
    most = -np.inf
    for i in range(n):
        most = max(most, terms[i])
    if most == -np.inf:
        return most
    total = 0.0
    for i in range(n):
        if terms[i] > most - 40.0:
            total += np.exp(terms[i] - most)
    return float(most + np.log(total))


@njit(cache=True)
def _running_sums(densities: FloatArray) -> FloatArray:
    """Return sums of the log-densities over the frames before t, shape (N, T + 1)."""
    n_states, n_frames = densities.shape
    sums = np.zeros((n_states, n_frames + 1))
    for n in range(n_states):
        for t in range(n_frames):
            sums[n, t + 1] = sums[n, t] + densities[n, t]
    return sums


@njit(cache=True)
def _stays(log_durations: FloatArray, sums: FloatArray, n: int, begin: int, end: int) -> float:
    """Return the log-probability of state n lasting over frames [begin, end) and what they show."""
    return float(log_durations[n, end - begin] + sums[n, end] - sums[n, begin])


@njit(cache=True)
def ends(log_durations: FloatArray, sums: FloatArray) -> FloatArray:
    """Return log P(first t frames, state n ends there), shape (N, T + 1).

    Args:
        log_durations: Log-probability of state n lasting d frames, shape (N, at least T + 1).
        sums: Running sums of the log-densities, shape (N, T + 1).
    """
    n_states, width = sums.shape
    alpha = np.full((n_states, width), -np.inf)
    terms = np.empty(width)
    for t in range(1, width):
        alpha[0, t] = _stays(log_durations, sums, 0, 0, t)
    for n in range(1, n_states):
        for t in range(n + 1, width):
            for begin in range(n, t):
                terms[begin] = alpha[n - 1, begin] + _stays(log_durations, sums, n, begin, t)
            alpha[n, t] = _log_sum(terms[n:], t - n)
    return alpha


@njit(cache=True)
def starts(log_durations: FloatArray, sums: FloatArray) -> FloatArray:
    """Return log P(frames from t on | state n starts there), shape (N, T + 1)."""
    n_states, width = sums.shape
    beta = np.full((n_states, width), -np.inf)
    terms = np.empty(width)
    last = n_states - 1
    for t in range(width - 1):
        beta[last, t] = _stays(log_durations, sums, last, t, width - 1)
    for n in range(last - 1, -1, -1):
        for t in range(width - 1):
            for end in range(t + 1, width):
                terms[end] = _stays(log_durations, sums, n, t, end) + beta[n + 1, end]
            beta[n, t] = _log_sum(terms[t + 1 :], width - 1 - t)
    return beta


@njit(cache=True)
def log_likelihood(
    densities: FloatArray, log_durations: FloatArray, log_survivals: FloatArray, complete: bool
) -> float:
    """Return log P(O) from log-densities (N, T).

    Args:
        densities: Shape (N, T).
        log_durations: Shape (N, at least T + 1).
        log_survivals: Log-probability of state n lasting d frames or more, likewise.
        complete: Whether the last state ends with the last frame; else any state is under way.
    """
    n_states, n_frames = densities.shape
    sums = _running_sums(densities)
    alpha = ends(log_durations, sums)
    if complete:
        return float(alpha[n_states - 1, n_frames])
    terms = np.full(n_states * n_frames, -np.inf)
    for n in range(n_states):
        for begin in range(n_frames):
            before = alpha[n - 1, begin] if n > 0 else (0.0 if begin == 0 else -np.inf)
            terms[n * n_frames + begin] = before + _stays(log_survivals, sums, n, begin, n_frames)
    return _log_sum(terms, len(terms))


@njit(cache=True)
def expectation(
    batch: SequenceBatch,
    gaussians: Gaussians,
    log_durations: FloatArray,
    statistics: Statistics,
) -> float:
    """Add the expected statistics of all sequences; return their log-likelihood."""
    frames, weights, offsets = batch.frames, batch.weights, batch.offsets
    lengths, squares, emitted = statistics.lengths, statistics.squares, statistics.emitted
    n_states = len(gaussians.means)
    likelihood = 0.0
    for s in range(len(offsets) - 1):
        begin, end = offsets[s], offsets[s + 1]
        n_frames = end - begin
        densities = log_densities(batch.columns, weights, begin, end, gaussians)
        sums = _running_sums(densities)
        alpha, beta = ends(log_durations, sums), starts(log_durations, sums)
        total = alpha[n_states - 1, n_frames]
        likelihood += total
        if total == -np.inf:
            continue
        change = np.zeros((n_states, n_frames + 1))  # of the state's probability, frame by frame
        for n in range(n_states):
            for a in range(n_frames):
                before = alpha[n - 1, a] if n > 0 else (0.0 if a == 0 else -np.inf)
                if before == -np.inf:
                    continue
                for b in range(a + 1, n_frames + 1):
                    after = beta[n + 1, b] if n + 1 < n_states else 0.0
                    if n + 1 == n_states and b < n_frames:
                        continue
                    log_share = before + _stays(log_durations, sums, n, a, b) + after - total
                    if log_share < -40.0:
                        continue
                    share = np.exp(log_share)
                    change[n, a] += share
                    change[n, b] -= share
                    lengths[n] += share * (b - a)
                    squares[n] += share * (b - a) ** 2
            occupied = 0.0
            for t in range(n_frames):
                occupied += change[n, t]
                if occupied > 1e-14:
                    row = begin + t
                    accumulate(frames, row, occupied * weights[row], n, emitted)
    return likelihood

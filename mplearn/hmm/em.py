"""Expectation and maximisation for left-right HMMs, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from ..recording import FloatArray, IntArray
from .kernels import backward, forward, log_add, log_densities, log_norms

# posterior weights below this cannot change a sum of order 1
_NEGLIGIBLE_SHARE = 1e-17


@njit(cache=True)
def equal_split(
    frames: FloatArray, weights: FloatArray, offsets: IntArray, statistics: Any
) -> None:
    """Add the statistics of each sequence cut into N equal parts."""
    mass, first, second, stays, moves = statistics
    n_states = len(mass)
    for s in range(len(offsets) - 1):
        n_frames = offsets[s + 1] - offsets[s]
        for t in range(n_frames):
            n = t * n_states // n_frames
            if t + 1 < n_frames:
                if (t + 1) * n_states // n_frames == n:
                    stays[n] += 1
                else:
                    moves[n] += 1
            row = offsets[s] + t
            accumulate(frames, row, weights[row], n, mass, first, second)


@njit(cache=True)
def expectation(
    frames: FloatArray,
    columns: FloatArray,
    weights: FloatArray,
    offsets: IntArray,
    model: Any,
    complete: bool,
    statistics: Any,
) -> float:
    """Add the expected sufficient statistics of all sequences, and return their log-likelihood.

    ``mass``, ``first`` and ``second`` (N, D) gain the posterior-weighted count, sum and sum of
    squares of each channel; ``stays`` and ``moves`` (N,) the expected transitions. An impossible
    sequence adds nothing but its likelihood, -inf.
    """
    means, variances, log_stay, log_next = model
    mass, first, second, stays, moves = statistics
    n_states = len(means)
    norms = log_norms(variances)
    likelihood = 0.0
    for s in range(len(offsets) - 1):
        begin, end = offsets[s], offsets[s + 1]
        densities = log_densities(columns, weights, begin, end, means, variances, norms, n_states)
        alpha = forward(densities, log_stay, log_next)
        beta = backward(densities, log_stay, log_next, complete)
        total = alpha[end - begin - 1, n_states - 1]
        if not complete:
            for n in range(n_states - 1):
                total = log_add(total, alpha[end - begin - 1, n])
        likelihood += total
        if total == -np.inf:
            continue
        for t in range(end - begin):
            for n in range(n_states):
                share = _exp(alpha[t, n] + beta[t, n] - total)
                if share < _NEGLIGIBLE_SHARE:
                    continue
                if t + 1 < end - begin:
                    arrival = alpha[t, n] - total
                    stays[n] += _exp(arrival + log_stay[n] + densities[n, t + 1] + beta[t + 1, n])
                    if n + 1 < n_states:
                        moves[n] += _exp(
                            arrival + log_next[n] + densities[n + 1, t + 1] + beta[t + 1, n + 1]
                        )
                accumulate(frames, begin + t, share * weights[begin + t], n, mass, first, second)
    return likelihood


@njit(cache=True)
def maximise_gaussians(
    mass: FloatArray,
    first: FloatArray,
    second: FloatArray,
    floor: FloatArray,
    means: FloatArray,
    variances: FloatArray,
) -> None:
    """Write the most probable Gaussians, a state's unseen channels taking its neighbours' mean."""
    n_states, n_channels = mass.shape
    for n in range(n_states):
        for d in range(n_channels):
            if mass[n, d] > 1e-9:
                means[n, d] = first[n, d] / mass[n, d]
                variance = second[n, d] / mass[n, d] - means[n, d] * means[n, d]
                variances[n, d] = max(variance, floor[d])
            else:
                means[n, d] = np.nan
                variances[n, d] = floor[d]
    for d in range(n_channels):
        _bridge(means, d)


@njit(cache=True)
def maximisation(statistics: Any, floor: FloatArray, duration_prior: float, model: Any) -> None:
    """Write the most probable model."""
    mass, first, second, stays, moves = statistics
    means, variances, log_stay, log_next = model
    n_states = len(mass)
    maximise_gaussians(mass, first, second, floor, means, variances)
    for n in range(n_states):
        stay, move = stays[n] + duration_prior, moves[n] + duration_prior
        log_stay[n] = np.log(stay / (stay + move))
        log_next[n] = np.log(move / (stay + move))
    log_stay[n_states - 1], log_next[n_states - 1] = 0.0, -np.inf


@njit(cache=True)
def em(
    frames: FloatArray,
    columns: FloatArray,
    weights: FloatArray,
    offsets: IntArray,
    floor: FloatArray,
    duration_prior: float,
    complete: bool,
    n_steps: int,
    gain: float,
    model: Any,
) -> float:
    """Fit ``model`` in place from the equal split; return the last log-likelihood seen.

    Ends early when a step gains less than ``gain``, or when a sequence is impossible.
    """
    n_states, n_channels = model[0].shape
    sums = np.zeros((3, n_states, n_channels))
    counts = np.zeros((2, n_states))
    statistics = (sums[0], sums[1], sums[2], counts[0], counts[1])
    equal_split(frames, weights, offsets, statistics)
    maximisation(statistics, floor, duration_prior, model)
    before = -np.inf
    for _ in range(n_steps):
        sums[:] = 0.0
        counts[:] = 0.0
        now = expectation(frames, columns, weights, offsets, model, complete, statistics)
        if now == -np.inf:
            return now
        maximisation(statistics, floor, duration_prior, model)
        if now - before < gain:
            return now
        before = now
    return before


@njit(cache=True, inline="always")
def _exp(x: float) -> float:
    """Return exp(x), or 0 where that is below what any sum here could notice."""
    return np.exp(x) if x > -40.0 else 0.0


@njit(cache=True)
def accumulate(
    frames: FloatArray,
    row: int,
    share: float,
    n: int,
    mass: FloatArray,
    first: FloatArray,
    second: FloatArray,
) -> None:
    """Add a frame of a certain share to the sums of state n, its missing channels left out."""
    for d in range(frames.shape[1]):
        x = frames[row, d]
        seen = share if x == x else 0.0
        x = x if x == x else 0.0
        mass[n, d] += seen
        first[n, d] += seen * x
        second[n, d] += seen * x * x


@njit(cache=True)
def _bridge(means: FloatArray, d: int) -> None:
    """Fill the NaN means of a channel linearly between the states that have one."""
    n_states = len(means)
    known = -1
    for n in range(n_states):
        if np.isnan(means[n, d]):
            continue
        for m in range(known + 1, n):
            start = means[known, d] if known >= 0 else means[n, d]
            means[m, d] = start + (means[n, d] - start) * (m - known) / (n - known)
        known = n
    if known >= 0:
        means[known + 1 :, d] = means[known, d]

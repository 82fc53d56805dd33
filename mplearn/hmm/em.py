"""Expectation and maximisation for left-right HMMs, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..maths.compiling import njit
from ..recording import FloatArray, IntArray
from .kernels import Gaussians, backward, forward, log_add, log_densities, log_norms
from .sequences import SequenceBatch

# posterior weights below this cannot change a sum of order 1
_NEGLIGIBLE_SHARE = 1e-17


class Parameters(NamedTuple):
    """A model under way: arrays that are written in place.

    Attributes:
        means: Shape (N, D).
        variances: Shape (N, D).
        log_stay: Shape (N,).
        log_next: Shape (N,).
    """

    means: FloatArray
    variances: FloatArray
    log_stay: FloatArray
    log_next: FloatArray


class Emitted(NamedTuple):
    """What each state emitted: posterior-weighted sums over frames.

    Attributes:
        mass: Of 1 where a channel was measured, shape (N, D).
        first: Of the channel, shape (N, D).
        second: Of its square, shape (N, D).
    """

    mass: FloatArray
    first: FloatArray
    second: FloatArray


class Statistics(NamedTuple):
    """Expected sufficient statistics.

    Attributes:
        emitted: What each state emitted.
        stays: How often it was stayed in, shape (N,).
        moves: How often it was left, shape (N,).
    """

    emitted: Emitted
    stays: FloatArray
    moves: FloatArray


@njit(cache=True)
def equal_split(
    frames: FloatArray, weights: FloatArray, offsets: IntArray, statistics: Statistics
) -> None:
    """Add the statistics of each sequence cut into N equal parts."""
    emitted, stays, moves = statistics.emitted, statistics.stays, statistics.moves
    n_states = len(stays)
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
            accumulate(frames, row, weights[row], n, emitted)


@njit(cache=True)
def expectation(
    batch: SequenceBatch, model: Parameters, complete: bool, statistics: Statistics
) -> float:
    """Add the expected sufficient statistics of all sequences, and return their log-likelihood.

    An impossible sequence adds nothing but its likelihood, -inf.
    """
    frames, weights, offsets = batch.frames, batch.weights, batch.offsets
    log_stay, log_next = model.log_stay, model.log_next
    emitted, stays, moves = statistics.emitted, statistics.stays, statistics.moves
    n_states = len(model.means)
    gaussians = Gaussians(model.means, model.variances, log_norms(model.variances))
    likelihood = 0.0
    for s in range(len(offsets) - 1):
        begin, end = offsets[s], offsets[s + 1]
        densities = log_densities(batch.columns, weights, begin, end, gaussians)
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
                row = begin + t
                accumulate(frames, row, share * weights[row], n, emitted)
    return likelihood


@njit(cache=True)
def maximise_gaussians(
    emitted: Emitted, floor: FloatArray, means: FloatArray, variances: FloatArray
) -> None:
    """Write the most probable Gaussians, a state's unseen channels taking its neighbours' mean."""
    mass, first, second = emitted.mass, emitted.first, emitted.second
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
def maximisation(
    statistics: Statistics, floor: FloatArray, duration_prior: float, model: Parameters
) -> None:
    """Write the most probable model."""
    log_stay, log_next = model.log_stay, model.log_next
    n_states = len(log_stay)
    maximise_gaussians(statistics.emitted, floor, model.means, model.variances)
    for n in range(n_states):
        stay = statistics.stays[n] + duration_prior
        move = statistics.moves[n] + duration_prior
        log_stay[n] = np.log(stay / (stay + move))
        log_next[n] = np.log(move / (stay + move))
    log_stay[n_states - 1], log_next[n_states - 1] = 0.0, -np.inf


@njit(cache=True)
def em(
    batch: SequenceBatch,
    floor: FloatArray,
    duration_prior: float,
    complete: bool,
    n_steps: int,
    gain: float,
    model: Parameters,
) -> float:
    """Fit ``model`` in place from the equal split; return the last log-likelihood seen.

    Ends early when a step gains less than ``gain``, or when a sequence is impossible.
    """
    n_states, n_channels = model.means.shape
    sums = np.zeros((3, n_states, n_channels))
    counts = np.zeros((2, n_states))
    statistics = Statistics(Emitted(sums[0], sums[1], sums[2]), counts[0], counts[1])
    equal_split(batch.frames, batch.weights, batch.offsets, statistics)
    maximisation(statistics, floor, duration_prior, model)
    before = -np.inf
    for _ in range(n_steps):
        sums[:] = 0.0
        counts[:] = 0.0
        now = expectation(batch, model, complete, statistics)
        if now == -np.inf:
            return now
        maximisation(statistics, floor, duration_prior, model)
        if now - before < gain:
            return now
        before = now
    return before


@njit(cache=True)
def em_of_each(
    frames: FloatArray,
    columns: FloatArray,
    weights: FloatArray,
    floor: FloatArray,
    duration_prior: float,
    models: Parameters,
) -> FloatArray:
    """Fit a model to each of many sequences by itself, in one step; return their log-likelihoods.

    Args:
        frames: Shape (S, T, D).
        columns: The same with frames along the last axis, shape (S, D, T).
        weights: Shape (T,).
        floor: Smallest variance of each channel, shape (D,).
        duration_prior: Transitions of either kind added to each state's count.
        models: Written in place, stacked: one more axis, of length S, in front.
    """
    offsets = np.array([0, frames.shape[1]])
    likelihoods = np.empty(len(frames))
    for s in range(len(frames)):
        batch = SequenceBatch(frames[s], columns[s], weights, offsets)
        own = Parameters(
            models.means[s], models.variances[s], models.log_stay[s], models.log_next[s]
        )
        likelihoods[s] = em(batch, floor, duration_prior, True, 1, 0.0, own)
    return likelihoods


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
    emitted: Emitted,
) -> None:
    """Add a frame of a certain share to the sums of state n, its missing channels left out."""
    mass, first, second = emitted.mass, emitted.first, emitted.second
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

"""Several left-right chains side by side as one chain over all combinations of their states."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from ...maths.compiling import njit
from ...recording import FloatArray, IntArray
from ..kernels import log_add


class ProductChain(NamedTuple):
    """The product of M chains; it starts in its first state and ends in its last.

    Attributes:
        states: State of each chain in each of the K combinations, shape (K, M).
        before: The combinations that may precede each, shape (K, 2^M); -1 where there is none.
        log_steps: Log-probability of that step, shape (K, 2^M).
    """

    states: IntArray
    before: IntArray
    log_steps: FloatArray

    @classmethod
    def of(cls, chains: Sequence[tuple[FloatArray, FloatArray]]) -> ProductChain:
        """Build the product of chains, each given by its ``log_stay`` and ``log_next``."""
        sizes = [len(log_stay) for log_stay, _ in chains]
        states = np.stack(np.unravel_index(np.arange(np.prod(sizes)), sizes), axis=1)
        moves = np.array(list(product((0, 1), repeat=len(sizes))))
        origins = states[:, None, :] - moves[None]
        possible = (origins >= 0).all(axis=2)
        log_steps = np.zeros(possible.shape)
        for m, (log_stay, log_next) in enumerate(chains):
            table = np.stack([log_stay, log_next])
            log_steps += table[moves[None, :, m], np.maximum(origins[:, :, m], 0)]
        before = np.ravel_multi_index(tuple(np.moveaxis(np.maximum(origins, 0), 2, 0)), sizes)
        log_steps[~possible] = -np.inf
        return cls(states, np.where(possible, before, -1), log_steps)


@njit(cache=True)
def forward(densities: FloatArray, before: IntArray, log_steps: FloatArray) -> FloatArray:
    """Return log P(o_1..o_t, combination k), shape (T, K), from log-densities (K, T)."""
    n_states, n_frames = densities.shape
    alpha = np.full((n_frames, n_states), -np.inf)
    alpha[0, 0] = densities[0, 0]
    for t in range(1, n_frames):
        for k in range(n_states):
            total = -np.inf
            for j in range(before.shape[1]):
                if before[k, j] >= 0:
                    total = log_add(total, alpha[t - 1, before[k, j]] + log_steps[k, j])
            alpha[t, k] = total + densities[k, t]
    return alpha


@njit(cache=True)
def backward(
    densities: FloatArray, before: IntArray, log_steps: FloatArray, complete: bool
) -> FloatArray:
    """Return log P(o_t+1..o_T | combination k), shape (T, K)."""
    n_states, n_frames = densities.shape
    beta = np.full((n_frames, n_states), -np.inf)
    beta[n_frames - 1] = -np.inf if complete else 0.0
    beta[n_frames - 1, n_states - 1] = 0.0
    for t in range(n_frames - 2, -1, -1):
        for k in range(n_states):
            later = densities[k, t + 1] + beta[t + 1, k]
            for j in range(before.shape[1]):
                i = before[k, j]
                if i >= 0:
                    beta[t, i] = log_add(beta[t, i], log_steps[k, j] + later)
    return beta

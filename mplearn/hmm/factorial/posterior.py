"""What is expected of the states of a factorial HMM: exactly, or by structured approximation.

In the structured variational approximation [GhahramaniJordan1997, appendix D] the chains are
independent given the data, and each sees what the others leave unexplained: forward and backward
run chain by chain, again and again, and each run raises a lower bound of the log-likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...recording import FloatArray
from .. import kernels
from ..model import LeftRightHMM
from . import product_chain
from .product_chain import ProductChain

SWEEPS = 50
GAIN = 1e-6  # of the bound per frame [nat], below which sweeping ends


class Moments(NamedTuple):
    """Expectations over the states of all chains, S = sum of the N_m in a row.

    Attributes:
        marginals: P(chain m is in state n), shape (T, S).
        pairs: P(two states at once), shape (T, S, S).
        log_likelihood: Of the sequence, or a lower bound of it.
    """

    marginals: FloatArray
    pairs: FloatArray
    log_likelihood: float


def exact_moments(
    chains: Sequence[LeftRightHMM],
    joint: ProductChain,
    frames: FloatArray,
    weights: FloatArray,
    complete: bool,
) -> Moments:
    """Return the moments by forward-backward over all combinations of states."""
    starts = np.cumsum([0, *(chain.n_states for chain in chains[:-1])])
    states = joint.states + starts
    means = np.concatenate([chain.means for chain in chains])[states].sum(axis=1)
    variances = np.tile(chains[0].variances[:1], (len(means), 1))
    densities = kernels.log_densities(
        np.ascontiguousarray(frames.T),
        weights,
        0,
        len(frames),
        kernels.Gaussians(means, variances, kernels.log_norms(variances)),
    )
    alpha = product_chain.forward(densities, joint.before, joint.log_steps)
    beta = product_chain.backward(densities, joint.before, joint.log_steps, complete)
    last = alpha[-1, -1:] if complete else alpha[-1]
    total = float(np.logaddexp.reduce(last))
    shares = np.exp(alpha + beta - total)
    indicator = np.zeros((len(means), int(starts[-1]) + chains[-1].n_states))
    indicator[np.arange(len(means))[:, None], states] = 1.0
    n_states = indicator.shape[1]
    both = (indicator[:, :, None] * indicator[:, None, :]).reshape(len(means), -1)
    return Moments(shares @ indicator, (shares @ both).reshape(-1, n_states, n_states), total)


def variational_moments(
    chains: Sequence[LeftRightHMM],
    frames: FloatArray,
    weights: FloatArray,
    complete: bool,
    sweeps: int = SWEEPS,
) -> Moments:
    """Return the moments by structured variational approximation, and the bound it reached."""
    seen = ~np.isnan(frames)
    data = np.where(seen, frames, 0.0)
    precision = np.where(seen, weights[:, None] / chains[0].variances[0], 0.0)  # (T, D)
    constant = float((weights[:, None] * np.where(seen, chains[0].log_norms[0], 0.0)).sum())
    progress = (np.arange(len(frames)) + 0.5) / len(frames)
    shares = [_spread_evenly(progress, chain.n_states) for chain in chains]
    outputs = [share @ chain.means for share, chain in zip(shares, chains, strict=True)]
    free = np.zeros(len(chains))  # log P of each chain's run, without its own evidence
    bound = -np.inf
    for _ in range(sweeps):
        for m, chain in enumerate(chains):
            rest = data - sum(output for k, output in enumerate(outputs) if k != m)
            evidence = (precision * rest) @ chain.means.T - 0.5 * precision @ (chain.means**2).T
            shares[m], total = _run(chain, evidence, complete)
            outputs[m] = shares[m] @ chain.means
            free[m] = total - (shares[m] * evidence).sum()
        spread = sum(
            share @ chain.means**2 - output**2
            for share, chain, output in zip(shares, chains, outputs, strict=True)
        )
        error = (data - sum(outputs)) ** 2 + spread
        now = constant - 0.5 * float((precision * error).sum()) + float(free.sum())
        done = now - bound < GAIN * len(frames)
        bound = now
        if done:
            break
    marginals = np.concatenate(shares, axis=1)
    pairs = marginals[:, :, None] * marginals[:, None, :]
    at = 0
    for share in shares:  # a chain is in one state at a time
        block = np.arange(at, at + share.shape[1])
        pairs[:, block[:, None], block] = 0.0
        pairs[:, block, block] = share
        at += share.shape[1]
    return Moments(marginals, pairs, bound)


def _run(chain: LeftRightHMM, evidence: FloatArray, complete: bool) -> tuple[FloatArray, float]:
    """Forward and backward on log-evidence (T, N): state probabilities (T, N), log normaliser."""
    densities = np.ascontiguousarray(evidence.T)
    alpha = kernels.forward(densities, chain.log_stay, chain.log_next)
    beta = kernels.backward(densities, chain.log_stay, chain.log_next, complete)
    last = alpha[-1, -1:] if complete else alpha[-1]
    total = float(np.logaddexp.reduce(last))
    return np.exp(alpha + beta - total), total


def _spread_evenly(progress: FloatArray, n_states: int) -> FloatArray:
    """State probabilities (T, N) that pass through all states at an even pace."""
    centres = (np.arange(n_states) + 0.5) / n_states
    shares = np.exp(-0.5 * ((progress[:, None] - centres) * n_states) ** 2)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))

"""Returns of macro steps, each discounted by its own duration, and so is what is learned of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def advantages(
    rewards: NDArray[np.float32],
    values: NDArray[np.float32],
    ends: NDArray[np.bool_],
    discounts: NDArray[np.float32],
    traces: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Return generalised advantage estimates of macro steps, shape (T, N).

    A_t = delta_t + d_t l_t A_(t+1), delta_t = r_t + d_t V_(t+1) - V_t, where what follows the end
    of an episode is 0 ([Schulman2016], with d_t in place of gamma and l_t of lambda). A lambda that
    counts per second, l_t = lambda^duration, looks as far ahead through many short steps, as they
    are made while waiting, as through one long step.

    Args:
        rewards: Of each step, shape (T, N).
        values: Of the state before each step, and after the last one, shape (T + 1, N).
        ends: Whether a step ended its episode, shape (T, N).
        discounts: Of each step, shape (T, N).
        traces: l_t of each step, shape (T, N).
    """
    out = np.zeros_like(rewards)
    after = np.zeros_like(rewards[0])
    keep = np.where(ends, 0.0, discounts).astype(np.float32)
    for t in range(len(rewards) - 1, -1, -1):
        delta = rewards[t] + keep[t] * values[t + 1] - values[t]
        after = delta + keep[t] * traces[t] * after
        out[t] = after
    return out

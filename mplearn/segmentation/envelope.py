"""The cost of a change of state, chosen by the data: the most stable number of segments.

The cost E_n of the cheapest path with exactly n segments falls with n. A switching cost C prefers
the n that minimises E_n + C (n - 1): a vertex of the lower convex envelope of (n, E_n), for all C
between the slopes of its two sides. The number that is preferred over the longest range of C is
the one that the data speak for [Kohlmorgen2003]. A single segment is preferred for all C above some
value; it is chosen where the first change would save next to nothing of E_1.

On-line it is found over the windows of the FIFO, thinned out to a fixed number, so that the work is
bounded at any frame rate.
"""

from __future__ import annotations

import math

import numpy as np

from ..maths.compiling import njit
from ..recording import FloatArray

MOST_SEGMENTS = 12
LEAST_SAVING = 0.05  # of the cost of a single segment
ROWS = 64


@njit(cache=True)
def costs_by_count(distances: FloatArray, most: int) -> FloatArray:
    """Return E_n, the cost of the cheapest path with exactly n segments, shape (most,).

    Args:
        distances: d(s, t) of state s at time t, shape (T, N).
        most: Largest number of segments; +inf where there are fewer times than segments.
    """
    steps, n_states = distances.shape
    costs = np.full((most, n_states), np.inf)  # of paths with k + 1 segments that end in s
    best = np.full(most, np.inf)
    costs[0] = distances[0]
    best[0] = costs[0].min()
    for t in range(1, steps):
        row = distances[t]
        for k in range(min(most - 1, t), -1, -1):
            switch = best[k - 1] if k > 0 else np.inf
            least = np.inf
            for s in range(n_states):
                cost = min(costs[k, s], switch) + row[s]
                costs[k, s] = cost
                least = min(least, cost)
            best[k] = least
    return best


@njit(cache=True)
def longest_range(costs: FloatArray) -> tuple[int, float, float]:
    """Return the number of segments preferred over the longest range of C, and that range.

    Args:
        costs: E_n for n = 1, 2, ..., shape (k,), not increasing.

    Returns:
        n, and the least and greatest C for which it is preferred; n = 0 where nothing is to choose.
    """
    most = costs.shape[0]
    best_n, best_low, best_high = 0, 0.0, 0.0
    n, high = 0, costs[0]
    while n < most - 1:
        step, low = n, 0.0  # the steepest way down from here is the next side of the envelope
        for m in range(n + 1, most):
            slope = (costs[n] - costs[m]) / (m - n)
            if slope > low:
                step, low = m, slope
        if step == n:
            break
        if n == 0 and low < LEAST_SAVING * costs[0]:
            return 1, low, costs[0]
        if n > 0 and high - low > best_high - best_low:
            best_n, best_low, best_high = n + 1, low, high
        n, high = step, low
    return best_n, best_low, best_high


@njit(cache=True)
def keep_row(matrix: FloatArray, distances: FloatArray, t: int, every: int) -> None:
    """Keep the distances of every so many-th window, in a ring of rows."""
    if t % every == 0:
        matrix[(t // every) % matrix.shape[0]] = distances


@njit(cache=True)
def switching_cost(matrix: FloatArray, oldest: int, t: int, every: int) -> float:
    """Return the geometric middle of the longest range of C over the FIFO; 0 where it is empty.

    Args:
        matrix: Rows as `keep_row` keeps them, shape (R, P).
        oldest: Oldest window.
        t: Newest window.
        every: Windows from one row to the next.
    """
    rows, size = matrix.shape
    last = t // every
    first = max((oldest + every - 1) // every, last - rows + 1)
    n = last - first + 1
    if n < 4:
        return 0.0
    thin = np.zeros((n, n))
    for i in range(n):
        row = matrix[(first + i) % rows]
        for j in range(i):
            thin[i, j] = thin[j, i] = row[((first + j) * every) % size]
    count, low, high = longest_range(costs_by_count(thin, min(MOST_SEGMENTS, n)))
    return float(every * math.sqrt(low * high)) if count > 0 else 0.0

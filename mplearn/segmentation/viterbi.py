"""The cheapest sequence of window states: on-line, or exactly over the FIFO.

Every window is a state. Being in state s while window t is observed costs d(s, t); a change of
state costs C. With eq. 3-4 of [Kulic2012], C = 2 zeta^2 ln k; nothing else of zeta and k matters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..maths.compiling import njit
from ..recording import FloatArray, IntArray


class Path(NamedTuple):
    """The best sequences of states, in a ring of P: time t, and the state born then, at ``t % P``.

    Attributes:
        costs: c_s(t), of the best path that ends in state s, shape (P,).
        entered: When that path changed into s, shape (P,); -1: before the FIFO.
        best_costs: o(t), the least of the costs at time t, shape (P,).
        best_entered: `entered` of the state that is best at time t, shape (P,).
        switch_costs: C, as it was at time t, shape (P,).
    """

    costs: FloatArray
    entered: IntArray
    best_costs: FloatArray
    best_entered: IntArray
    switch_costs: FloatArray


def new_path(size: int) -> Path:
    """Allocate what `extend_path` works on, for a ring of `size` slots."""
    never = np.full(size, -1)
    return Path(np.zeros(size), never, np.zeros(size), never.copy(), np.zeros(size))


@njit(cache=True)
def extend_path(t: int, first: int, oldest: int, distances: FloatArray, path: Path) -> None:
    """Add window t, at once an observation and a state, to the best paths.

    The on-line recursion of Kohlmorgen and Lemm (2001): the new state first runs over the past, and
    lowers o where it does better than the states known then; afterwards all states see window t.
    States leave first in, first out (Janus 2006); a path starts free of charge at the FIFO's edge.

    Args:
        t: Time of the new window.
        first: Time of the first window of the stream.
        oldest: Oldest state that is still kept.
        distances: d(s, t), shape (P,).
        path: The best paths; C of time t is set.
    """
    costs, entered, best_costs, best_entered, switch_costs = path
    size = distances.shape[0]
    base = best_costs[(oldest - 1) % size] if oldest > first else 0.0
    running, since = base, -1
    for u in range(oldest, t):
        i = u % size
        if u > oldest and best_costs[(u - 1) % size] + switch_costs[i] < running:
            running, since = best_costs[(u - 1) % size] + switch_costs[i], u
        running += distances[i]
        if running < best_costs[i]:
            best_costs[i] = running
            best_entered[i] = since
    switch = best_costs[(t - 1) % size] + switch_costs[t % size] if t > first else 0.0
    least, least_entered = running, since
    if t > oldest and switch < running:
        least, least_entered = switch, t
    costs[t % size] = least
    entered[t % size] = least_entered
    for s in range(oldest, t):
        i = s % size
        if switch < costs[i]:
            costs[i] = switch
            entered[i] = t
        costs[i] += distances[i]
        if costs[i] < least:
            least, least_entered = costs[i], entered[i]
    best_costs[t % size] = least
    best_entered[t % size] = least_entered
    if base > 1e4:  # costs grow for ever; only their differences matter
        for u in range(oldest, t + 1):
            costs[u % size] -= base
            best_costs[u % size] -= base
        best_costs[(oldest - 1) % size] -= base


@njit(cache=True)
def last_changes(t: int, oldest: int, best_entered: IntArray, changes: IntArray) -> int:
    """Write the times of change on the best path up to t into `changes`, latest first.

    Returns how many there are; what does not fit, or lies before `oldest`, is left out.
    """
    n = 0
    at = best_entered[t % best_entered.shape[0]]
    while at > oldest and n < changes.shape[0]:
        changes[n] = at
        n += 1
        at = best_entered[(at - 1) % best_entered.shape[0]]
    return n


@njit(cache=True)
def exact_path(distances: FloatArray, switch_costs: FloatArray, states: IntArray) -> float:
    """Find the cheapest sequence of states by dynamic programming over all of them.

    Args:
        distances: d(s, t) of state s at time t, shape (T, N).
        switch_costs: Cost C of a change of state at each time, shape (T,).
        states: Receives the best state at each time, shape (T,).

    Returns:
        The cost of the best path.
    """
    steps, n = distances.shape
    costs = distances[0].copy()
    changed = np.zeros((steps, n), dtype=np.bool_)
    best = np.zeros(steps, dtype=np.int64)
    best[0] = np.argmin(costs)
    for t in range(1, steps):
        switch = costs[best[t - 1]] + switch_costs[t]
        row = distances[t]
        for s in range(n):
            if switch < costs[s]:
                costs[s] = switch
                changed[t, s] = True
            costs[s] += row[s]
        best[t] = np.argmin(costs)
    state = best[steps - 1]
    total = costs[state]
    for t in range(steps - 1, -1, -1):
        states[t] = state
        if t > 0 and changed[t, state]:
            state = best[t - 1]
    return float(total)


@njit(cache=True)
def exact_changes(
    matrix: FloatArray, switch_costs: FloatArray, oldest: int, t: int, changes: IntArray
) -> int:
    """Write the times of change on the exact path over the windows [oldest, t], latest first.

    Args:
        matrix: d(s, t) of the windows at slots s and t of a ring, shape (P, P).
        switch_costs: Cost C of a change of state at each slot, shape (P,).
        oldest: Oldest window.
        t: Newest window.
        changes: Receives the times; what does not fit is left out.
    """
    size = matrix.shape[0]
    slots = np.arange(oldest, t + 1) % size
    states = np.empty(slots.shape[0], dtype=np.int64)
    exact_path(matrix[slots][:, slots], switch_costs[slots], states)
    n = 0
    for i in range(slots.shape[0] - 1, 0, -1):
        if states[i] != states[i - 1] and n < changes.shape[0]:
            changes[n] = oldest + i
            n += 1
    return n

"""The most that can be earned in the long run where every action takes a time of its own.

A semi-Markov decision problem without chance is a graph: an action leads from a state to another,
pays, and takes a while. The greatest reward per second is that of its best cycle (the maximum
ratio of sums, by policy iteration [Dasdan1999]); the greatest discounted sum is the
fixed point of value iteration [Puterman1994].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.maths.compiling import njit
from mplearn.recording import FloatArray, IntArray

_LEAST_GAIN = 1e-10  # of a policy's improvement, relative to the largest reward


class Actions(NamedTuple):
    """What can be done in each of S states: E actions, in the order of their states.

    Attributes:
        start: Where each state's actions begin, and E, shape (S + 1,); every state has some.
        to: State that each leads to, shape (E,).
        reward: What each earns, shape (E,).
        time_s: How long each takes, above 0, shape (E,) [s].
    """

    start: IntArray
    to: IntArray
    reward: FloatArray
    time_s: FloatArray

    @classmethod
    def of(cls, state: IntArray, to: IntArray, reward: FloatArray, time_s: FloatArray) -> Actions:
        """Return actions from a list in any order, shape (E,) each.

        Raises:
            InvalidValueError: A state leads nowhere, or an action takes no time.
        """
        n_states = 1 + int(max(state.max(initial=-1), to.max(initial=-1)))
        counts = np.bincount(state, minlength=n_states)
        if n_states == 0 or (counts == 0).any() or not (time_s > 0).all():
            raise InvalidValueError("every state needs an action, and every action takes time")
        order = np.argsort(state, kind="stable")
        start = np.concatenate(([0], np.cumsum(counts)))
        return cls(start, to[order], reward[order], time_s[order])


def best_rate(actions: Actions) -> float:
    """Return the greatest reward per second of any cycle; every state must reach all that counts.

    Args:
        actions: What can be done.

    Example:
        >>> import numpy as np
        >>> there_and_back = Actions.of(
        ...     np.array([0, 1, 1]), np.array([1, 0, 1]), np.array([1.0, 2.0, 0.5]), np.ones(3)
        ... )
        >>> best_rate(there_and_back)
        1.5
    """
    least = _LEAST_GAIN * max(float(np.abs(actions.reward).max()), 1e-300)
    return float(_improve(*actions, least))


def best_values(actions: Actions, discount: float, tolerance: float = 1e-9) -> FloatArray:
    """Return the greatest discounted sum of rewards from each state on, shape (S,).

    A reward counts from where its action begins; what is earned within an action is discounted in
    it already.

    Args:
        actions: What can be done.
        discount: Per second, below 1.
        tolerance: How far the values may be off, relative to the largest.
    """
    worth = discount**actions.time_s
    values = np.zeros(len(actions.start) - 1)
    change, most = np.inf, float(worth.max())
    while change * most > tolerance * (1.0 - most) * max(np.abs(values).max(), 1e-300):
        after = np.maximum.reduceat(actions.reward + worth * values[actions.to], actions.start[:-1])
        change, values = float(np.abs(after - values).max()), after
    return values


@njit(cache=True, nogil=True)
def _improve(
    start: IntArray, to: IntArray, reward: FloatArray, time_s: FloatArray, least: float
) -> float:
    """Return the best cycle's reward per second, by policy iteration."""
    n = len(start) - 1
    policy = start[:-1].copy()  # the action taken in each state
    value = np.zeros(n)
    best = -np.inf
    while True:
        rate, on_it = _best_cycle(policy, to, reward, time_s)
        best = max(best, rate)
        _evaluate(policy, to, reward, time_s, best, on_it, value)
        better = False
        for s in range(n):
            for e in range(start[s], start[s + 1]):
                worth = reward[e] - best * time_s[e] + value[to[e]]
                if worth > value[s] + least:
                    value[s], policy[s], better = worth, e, True
        if not better:
            return float(best)


@njit(cache=True, nogil=True)
def _best_cycle(
    policy: IntArray, to: IntArray, reward: FloatArray, time_s: FloatArray
) -> tuple[float, int]:
    """Return reward per second, and a state, of the best cycle that a policy runs into."""
    n = len(policy)
    seen = np.full(n, -1)
    best, where = -np.inf, 0
    for first in range(n):
        s = first
        while seen[s] < 0:
            seen[s] = first
            s = to[policy[s]]
        if seen[s] == first:  # a cycle that was not there before
            earned, lasted, t = 0.0, 0.0, s
            while True:
                earned, lasted = earned + reward[policy[t]], lasted + time_s[policy[t]]
                t = to[policy[t]]
                if t == s:
                    break
            if earned / lasted > best:
                best, where = earned / lasted, s
    return best, where


@njit(cache=True, nogil=True)
def _evaluate(
    policy: IntArray,
    to: IntArray,
    reward: FloatArray,
    time_s: FloatArray,
    rate: float,
    end: int,
    value: FloatArray,
) -> None:
    """Write what each state that runs into a cycle earns on the way to it, above the rate."""
    n = len(policy)
    first = np.full(n + 1, 0)  # who comes from where: states in the order of their successors
    for s in range(n):
        first[to[policy[s]] + 1] += 1
    first = np.cumsum(first)
    place, before = first[:-1].copy(), np.empty(n, np.int64)
    for s in range(n):
        before[place[to[policy[s]]]] = s
        place[to[policy[s]]] += 1
    queue = np.empty(n, np.int64)
    queue[0], head, tail = end, 0, 1
    while head < tail:
        t = queue[head]
        head += 1
        for k in range(first[t], first[t + 1]):
            s = before[k]
            if s != end:
                value[s] = reward[policy[s]] - rate * time_s[policy[s]] + value[t]
                queue[tail] = s
                tail += 1

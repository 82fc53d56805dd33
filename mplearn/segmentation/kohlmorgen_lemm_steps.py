"""The compiled steps of Kohlmorgen-Lemm segmentation, over directions and over postures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from ..recording import FloatArray, IntArray
from .envelope import keep_row, switching_cost
from .speed import all_low, close, readiness, running_speed, take_speed
from .viterbi import exact_changes, extend_path, last_changes
from .watch import watch
from .windows import push_point

N_CHANGES = 16
PLAIN, EXACT, ENVELOPE = 0, 1, 2


@njit(cache=True)
def _oldest(t: int, length: int, size: int) -> int:
    return max(length - 1, t - size + length + 1)


@njit(cache=True)
def _observe(x: FloatArray, t: int, q: Any, sigma: float, weights: FloatArray, kit: Any) -> None:
    """Add a point; keep its distances where the exact path or the envelope will need them."""
    windows, distances, _, matrix = kit
    points, kernel_rows, row_sums, self_sums, squared = windows
    push_point(x, weights, t, sigma, points, kernel_rows, row_sums, self_sums, squared, distances)
    size = points.shape[1]
    if t < q.window - 1:
        return
    if q.mode == EXACT:
        for s in range(_oldest(t, q.window, size), t + 1):
            matrix[s % size, t % size] = distances[s % size]
            matrix[t % size, s % size] = distances[s % size]
    elif q.mode == ENVELOPE:
        keep_row(matrix, distances, t, q.every)


@njit(cache=True)
def _changes(t: int, q: Any, ready: float, kit: Any, spread: FloatArray, changes: IntArray) -> int:
    """Extend the best path by window t and write when it changes state, latest first."""
    _, distances, path, matrix = kit
    costs, entered, best_costs, best_entered, switch_costs = path
    size = distances.shape[0]
    oldest = _oldest(t, q.window, size)
    if q.mode == ENVELOPE:
        if t % (8 * q.every) == 0 and t >= size:
            found = switching_cost(matrix, oldest, t, q.every)
            if found > 0.0:
                known = spread[3] > 0.0
                spread[3] = spread[3] ** 0.8 * found**0.2 if known else found
        cost = spread[3] if spread[3] > 0.0 else q.cost
    else:
        cost = q.cost
    switch_costs[t % size] = cost / ready
    if q.mode == EXACT:
        return exact_changes(matrix, switch_costs, oldest, t, changes)
    extend_path(
        t,
        q.window - 1,
        oldest,
        switch_costs,
        distances,
        costs,
        entered,
        best_costs,
        best_entered,
    )
    return last_changes(t, oldest, best_entered, changes)


@njit(cache=True)
def step_direction(
    frame: FloatArray,
    watcher: Any,
    model: Any,
    kit: Any,
    history: FloatArray,
    spread: FloatArray,
    out: FloatArray,
) -> int:
    """Take one frame; densities over the direction of motion support the minima of the speed."""
    filter_, settings, memory, state, speeds = watcher
    m, p, q = state[0], settings[0], model[0]
    s = take_speed(frame, filter_, memory, m, p, speeds)
    if s < 0.0:
        return -1
    t = m.frames - 1
    slow = q.still_direction * running_speed(m)
    norm = math.sqrt(s * s + slow * slow)
    x = memory[3] / norm if norm > 0.0 else np.zeros(frame.shape[0])
    _observe(x, t, q, q.sigma, memory[4], kit)
    ready = readiness(m, p)
    hysteresis = q.hysteresis
    if t >= q.window - 1:
        changes = np.empty(N_CHANGES, dtype=np.int64)
        n = _changes(t, q, ready, kit, spread, changes)
        for j in range(n):
            if abs(changes[j] - q.window // 2 - m.valley_frame) <= q.tolerance:
                hysteresis = q.hysteresis_turned
    return int(watch(m, p, s, min(0.95, hysteresis * ready), speeds, out))


@njit(cache=True)
def _update_sigma(q: Any, t: int, squared: FloatArray, spread: FloatArray) -> bool:
    """Take point t into the running distance to nearest neighbours; True if sigma has to change.

    The running distance is averaged as `running_speed` is, so that pauses hardly lower it.
    """
    size = squared.shape[0]
    known = min(t, size - 1)
    n = min(q.neighbours, known)
    if n == 0:
        return False
    others = np.empty(known)
    for i in range(known):
        others[i] = squared[(t - 1 - i) % size]
    nearest = np.sort(np.partition(others, n - 1)[:n])
    mean = 0.0
    for i in range(n):
        mean += math.sqrt(nearest[i])
    mean /= n
    if spread[2] > 0.0:
        mean = min(mean, 20.0 * spread[2] / q.sigma)  # a jump of the signal is no spread
    weight = max(q.forget, 1.0 / t)
    spread[0] += weight * (mean - spread[0])
    spread[1] += weight * (math.sqrt(mean) - spread[1])
    if spread[1] <= 0.0:
        return False
    wanted = q.sigma * (spread[0] / spread[1]) ** 2
    if spread[2] > 0.0 and 0.8 * spread[2] < wanted < 1.25 * spread[2]:
        return False
    spread[2] = wanted
    return True


@njit(cache=True)
def _replay(t: int, q: Any, sigma: float, weights: FloatArray, kit: Any) -> None:
    """Compute everything anew with another sigma, from the points that are kept."""
    points, kernel_rows, row_sums, _, _ = kit[0]
    size = points.shape[1]
    kernel_rows[:] = 0.0
    row_sums[:] = 0.0
    x = np.empty(points.shape[0])
    for u in range(max(0, t - size + 1), t + 1):
        x[:] = points[:, u % size]
        _observe(x, u, q, sigma, weights, kit)


@njit(cache=True)
def step_posture(
    frame: FloatArray,
    watcher: Any,
    model: Any,
    kit: Any,
    history: FloatArray,
    spread: FloatArray,
    out: FloatArray,
) -> int:
    """Take one frame; a change of state between densities of embedded postures is a boundary."""
    filter_, settings, memory, state, speeds = watcher
    m, p, q = state[0], settings[0], model[0]
    if take_speed(frame, filter_, memory, m, p, speeds) < 0.0:
        return -1
    t = m.frames - 1
    span, width = history.shape
    if t == 0:
        history[:] = frame
    history[t % span] = frame
    x = np.empty(kit[0][0].shape[0])
    for k in range(x.shape[0] // width):
        x[k * width : (k + 1) * width] = history[(t - k * q.delay) % span]
    _observe(x, t, q, max(spread[2], 1e-150), memory[4], kit)
    if _update_sigma(q, t, kit[0][4], spread):
        _replay(t, q, spread[2], memory[4], kit)
    end, confidence = -1, 0.0
    if t >= q.window - 1:
        changes = np.empty(N_CHANGES, dtype=np.int64)
        shift = q.window // 2 + (span - 1) // 2 - p.lag
        n = _changes(t, q, readiness(m, p), kit, spread, changes)
        for j in range(n):  # the earliest that is settled and long enough after the last
            if changes[j] <= t - 2 * q.window and changes[j] - shift - m.start >= p.shortest:
                end = changes[j] - shift
                confidence = _certainty(t, changes[j], q, kit[2])
    if end < 0 and t - m.start >= p.longest:
        end = t
    if end < 0:
        return 0
    low = p.still_share * running_speed(m)
    return int(close(m, p, end, confidence, all_low(m, end, low, speeds), out))


@njit(cache=True)
def _certainty(t: int, change: int, q: Any, path: Any) -> float:
    """How much dearer the best path without this change is, as a share of C."""
    costs, entered, best_costs, _, switch_costs = path
    size = costs.shape[0]
    without = math.inf
    for s in range(_oldest(t, q.window, size), t + 1):
        if entered[s % size] < change:
            without = min(without, costs[s % size])
    excess = (without - best_costs[t % size]) / switch_costs[change % size]
    return float(min(1.0, max(0.0, excess)))

"""The compiled steps of Kohlmorgen-Lemm segmentation, over directions and over postures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from ..recording import FloatArray, IntArray
from .kernels import all_finite, smooth_velocity
from .speed import close, running_speed, see_speed, watch
from .viterbi import exact_changes, extend_path, last_changes
from .windows import push_point

N_CHANGES = 16


@njit(cache=True)
def _oldest(t: int, length: int, size: int) -> int:
    return max(length - 1, t - size + length + 1)


@njit(cache=True)
def _observe(
    x: FloatArray, t: int, sigma: float, windows: Any, distances: FloatArray, matrix: FloatArray
) -> None:
    """Add a point; for the exact path also keep its distances to all windows of the FIFO."""
    points, kernel_rows, row_sums, self_sums, squared = windows
    push_point(x, t, sigma, points, kernel_rows, row_sums, self_sums, squared, distances)
    size, length = points.shape[1], kernel_rows.shape[0]
    if matrix.shape[0] == size and t >= length - 1:
        for s in range(_oldest(t, length, size), t + 1):
            matrix[s % size, t % size] = distances[s % size]
            matrix[t % size, s % size] = distances[s % size]


@njit(cache=True)
def _changes(
    t: int, q: Any, distances: FloatArray, path: Any, matrix: FloatArray, changes: IntArray
) -> int:
    """Extend the best path by window t and write when it changes state, latest first."""
    costs, entered, best_costs, best_entered = path
    size = distances.shape[0]
    oldest = _oldest(t, q.window, size)
    if matrix.shape[0] == size:
        return exact_changes(matrix, oldest, t, q.cost, changes)
    extend_path(
        t, q.window - 1, oldest, q.cost, distances, costs, entered, best_costs, best_entered
    )
    return last_changes(t, oldest, best_entered, changes)


@njit(cache=True)
def step_direction(
    frame: FloatArray,
    filter_: FloatArray,
    model: Any,
    settings: Any,
    memory: FloatArray,
    state: Any,
    windows: Any,
    distances: FloatArray,
    path: Any,
    matrix: FloatArray,
    history: FloatArray,
    speeds: FloatArray,
    spread: FloatArray,
    out: FloatArray,
) -> int:
    """Take one frame; densities over the direction of motion support the minima of the speed."""
    m, p, q = state[0], settings[0], model[0]
    if not all_finite(frame):
        return -1
    s = smooth_velocity(frame, filter_, memory, m.frames == 0)
    see_speed(m, p, s)
    t = m.frames - 1
    slow = q.still_direction * running_speed(m)
    norm = math.sqrt(s * s + slow * slow)
    x = memory[3] / norm if norm > 0.0 else np.zeros(frame.shape[0])
    _observe(x, t, q.sigma, windows, distances, matrix)
    hysteresis = q.hysteresis
    if t >= q.window - 1:
        changes = np.empty(N_CHANGES, dtype=np.int64)
        n = _changes(t, q, distances, path, matrix, changes)
        for j in range(n):
            if abs(changes[j] - q.window // 2 - m.valley_frame) <= q.tolerance:
                hysteresis = q.hysteresis_turned
    return int(watch(m, p, s, hysteresis, out))


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
def _replay(t: int, sigma: float, windows: Any, distances: FloatArray, matrix: FloatArray) -> None:
    """Compute everything anew with another sigma, from the points that are kept."""
    points, kernel_rows, row_sums, _, _ = windows
    size = points.shape[1]
    kernel_rows[:] = 0.0
    row_sums[:] = 0.0
    x = np.empty(points.shape[0])
    for u in range(max(0, t - size + 1), t + 1):
        x[:] = points[:, u % size]
        _observe(x, u, sigma, windows, distances, matrix)


@njit(cache=True)
def step_posture(
    frame: FloatArray,
    filter_: FloatArray,
    model: Any,
    settings: Any,
    memory: FloatArray,
    state: Any,
    windows: Any,
    distances: FloatArray,
    path: Any,
    matrix: FloatArray,
    history: FloatArray,
    speeds: FloatArray,
    spread: FloatArray,
    out: FloatArray,
) -> int:
    """Take one frame; a change of state between densities of embedded postures is a boundary."""
    m, p, q = state[0], settings[0], model[0]
    if not all_finite(frame):
        return -1
    s = smooth_velocity(frame, filter_, memory, m.frames == 0)
    see_speed(m, p, s)
    t = m.frames - 1
    speeds[t % speeds.shape[0]] = s
    span = history.shape[0]
    if t == 0:
        history[:] = frame
    history[t % span] = frame
    x = np.empty(windows[0].shape[0])
    width = frame.shape[0]
    for k in range(x.shape[0] // width):
        x[k * width : (k + 1) * width] = history[(t - k * q.delay) % span]
    _observe(x, t, max(spread[2], 1e-150), windows, distances, matrix)
    if _update_sigma(q, t, windows[4], spread):
        _replay(t, spread[2], windows, distances, matrix)
    end, confidence = -1, 0.0
    if t >= q.window - 1:
        changes = np.empty(N_CHANGES, dtype=np.int64)
        shift = q.window // 2 + (span - 1) // 2 - p.lag
        n = _changes(t, q, distances, path, matrix, changes)
        for j in range(n):  # the earliest that is settled and long enough after the last
            if changes[j] <= t - 2 * q.window and changes[j] - shift - m.start >= p.shortest:
                end = changes[j] - shift
                confidence = _certainty(t, changes[j], q, path)
    if end < 0 and t - m.start >= p.longest:
        end = t
    if end < 0:
        return 0
    still = True
    low = p.still_share * running_speed(m)
    for u in range(max(m.start, t - speeds.shape[0] + 1), end):
        still = still and speeds[u % speeds.shape[0]] <= low
    return int(close(m, p, end, confidence, still, out))


@njit(cache=True)
def _certainty(t: int, change: int, q: Any, path: Any) -> float:
    """How much dearer the best path without this change is, as a share of C."""
    costs, entered, best_costs, _ = path
    size = costs.shape[0]
    without = math.inf
    for s in range(_oldest(t, q.window, size), t + 1):
        if entered[s % size] < change:
            without = min(without, costs[s % size])
    return float(min(1.0, max(0.0, (without - best_costs[t % size]) / q.cost)))

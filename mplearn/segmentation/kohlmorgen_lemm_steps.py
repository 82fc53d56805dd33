"""The compiled steps of Kohlmorgen-Lemm segmentation, over directions and over postures."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..maths.compiling import njit
from ..recording import FloatArray, IntArray
from .envelope import keep_row, switching_cost
from .speed import (
    CHANGE,
    LENGTH,
    STILL,
    Watched,
    all_low,
    close,
    readiness,
    running_speed,
    take_speed,
)
from .turns import Trail, drop_candidate, follow_axis, look_for_turn, near_turn
from .viterbi import Path, exact_changes, extend_path, last_changes
from .watch import watch
from .windows import Windows, push_point

N_CHANGES = 16
PLAIN, EXACT, ENVELOPE = 0, 1, 2


@njit(cache=True)
def _oldest(t: int, length: int, size: int) -> int:
    return max(length - 1, t - size + length + 1)


SCALES = np.dtype(
    [
        ("mean", "f8"),  # forgetful means of the distance to nearest neighbours, and of its root
        ("mean_root", "f8"),
        ("sigma", "f8"),  # in use; 0 before it is known
        ("cost", "f8"),  # C that the envelope chose; 0 before it is known
    ]
)


class States(NamedTuple):
    """Windows of the stream as states.

    Attributes:
        windows: The windows, and the distances between them.
        path: The best sequence of states.
        matrix: Distances as the exact path or the envelope need them.
        history: The latest frames, a ring, that postures are embedded from.
        scales: Shape (1,), of `SCALES`.
    """

    windows: Windows
    path: Path
    matrix: FloatArray
    history: FloatArray
    scales: Any


@njit(cache=True)
def _observe(
    x: FloatArray, t: int, q: Any, sigma: float, weights: FloatArray, states: States
) -> None:
    """Add a point; keep its distances where the exact path or the envelope will need them."""
    windows, matrix = states.windows, states.matrix
    distances = windows.distances
    push_point(x, weights, t, sigma, windows)
    size = distances.shape[0]
    if t < q.window - 1:
        return
    if q.mode == EXACT:
        for s in range(_oldest(t, q.window, size), t + 1):
            matrix[s % size, t % size] = distances[s % size]
            matrix[t % size, s % size] = distances[s % size]
    elif q.mode == ENVELOPE:
        keep_row(matrix, distances, t, q.every)


@njit(cache=True)
def _changes(t: int, q: Any, ready: float, states: States, changes: IntArray) -> int:
    """Extend the best path by window t and write when it changes state, latest first."""
    distances, path, matrix = states.windows.distances, states.path, states.matrix
    scales = states.scales[0]
    size = distances.shape[0]
    oldest = _oldest(t, q.window, size)
    cost = q.cost
    if q.mode == ENVELOPE:
        if t % (8 * q.every) == 0 and t >= size:
            found = switching_cost(matrix, oldest, t, q.every)
            if found > 0.0:
                scales.cost = scales.cost**0.8 * found**0.2 if scales.cost > 0.0 else found
        if scales.cost > 0.0:
            cost = scales.cost
    path.switch_costs[t % size] = cost / ready
    if q.mode == EXACT:
        return exact_changes(matrix, path.switch_costs, oldest, t, changes)
    extend_path(t, q.window - 1, oldest, distances, path)
    return last_changes(t, oldest, path.best_entered, changes)


@njit(cache=True)
def steps_direction(
    frames: FloatArray,
    watched: Watched,
    model: Any,
    states: States,
    turns: Any,
    trail: Trail,
    out: Any,
) -> tuple[int, int]:
    """Take frames until some end segments; see `SpeedSegmenter`.

    Densities over the direction of motion support minima and turns.
    """
    for k in range(len(frames)):
        s = take_speed(frames[k], watched)
        if s < 0.0:
            return k, -1
        m, p, q, r = watched.state[0], watched.settings[0], model[0], turns[0]
        smooth = watched.smooth
        t = m.frames - 1
        slow = q.still_direction * running_speed(m)
        norm = math.sqrt(s * s + slow * slow)
        x = smooth.velocity / norm if norm > 0.0 else np.zeros(frames.shape[1])
        _observe(x, t, q, q.sigma, smooth.weights, states)
        ready = readiness(m, p)
        hysteresis = q.hysteresis
        if t >= q.window - 1:
            changes = np.empty(N_CHANGES, dtype=np.int64)
            n = _changes(t, q, ready, states, changes)
            for j in range(n):
                if abs(changes[j] - q.window // 2 - m.valley_frame) <= q.tolerance:
                    hysteresis = q.hysteresis_turned
        follow_axis(t, s, smooth, r, trail)
        if near_turn(m.valley_frame, r, trail):
            hysteresis = max(hysteresis, r.hysteresis)
        start, mode = m.start, m.mode
        n = watch(m, p, s, hysteresis, ready, watched.speeds, out)
        if m.start != start or m.mode != mode:
            drop_candidate(m.start, t, smooth.weights, trail)
        elif m.mode != STILL:
            n = look_for_turn(m, p, r, ready, smooth, watched.speeds, trail, out)
        if n > 0:
            return k + 1, int(n)
    return len(frames), 0


@njit(cache=True)
def _update_sigma(q: Any, t: int, squared: FloatArray, scales: Any) -> bool:
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
    if scales.sigma > 0.0:
        mean = min(mean, 20.0 * scales.sigma / q.sigma)  # a jump of the signal is no spread
    weight = max(q.forget, 1.0 / t)
    scales.mean += weight * (mean - scales.mean)
    scales.mean_root += weight * (math.sqrt(mean) - scales.mean_root)
    if scales.mean_root <= 0.0:
        return False
    wanted = q.sigma * (scales.mean / scales.mean_root) ** 2
    if scales.sigma > 0.0 and 0.8 * scales.sigma < wanted < 1.25 * scales.sigma:
        return False
    scales.sigma = wanted
    return True


@njit(cache=True)
def _replay(t: int, q: Any, sigma: float, weights: FloatArray, states: States) -> None:
    """Compute everything anew with another sigma, from the points that are kept."""
    windows = states.windows
    size = windows.points.shape[1]
    windows.kernel_rows[:] = 0.0
    windows.row_sums[:] = 0.0
    x = np.empty(windows.points.shape[0])
    for u in range(max(0, t - size + 1), t + 1):
        x[:] = windows.points[:, u % size]
        _observe(x, u, q, sigma, weights, states)


@njit(cache=True)
def steps_posture(
    frames: FloatArray,
    watched: Watched,
    model: Any,
    states: States,
    turns: Any,
    trail: Trail,
    out: Any,
) -> tuple[int, int]:
    """Take frames until some end segments; see `SpeedSegmenter`.

    A change of state between densities of embedded postures is a boundary.
    """
    for k in range(len(frames)):
        frame = frames[k]
        if take_speed(frame, watched) < 0.0:
            return k, -1
        m, p, q = watched.state[0], watched.settings[0], model[0]
        weights, history, scales = watched.smooth.weights, states.history, states.scales[0]
        t = m.frames - 1
        span, width = history.shape
        if t == 0:
            history[:] = frame
        history[t % span] = frame
        x = np.empty(states.windows.points.shape[0])
        for j in range(x.shape[0] // width):
            x[j * width : (j + 1) * width] = history[(t - j * q.delay) % span]
        _observe(x, t, q, max(scales.sigma, 1e-150), weights, states)
        if _update_sigma(q, t, states.windows.squared, scales):
            _replay(t, q, scales.sigma, weights, states)
        end, confidence, cause = -1, 0.0, LENGTH
        if t >= q.window - 1:
            changes = np.empty(N_CHANGES, dtype=np.int64)
            shift = q.window // 2 + (span - 1) // 2 - p.lag
            n = _changes(t, q, readiness(m, p), states, changes)
            for j in range(n):  # the earliest that is settled and long enough after the last
                if changes[j] <= t - 2 * q.window and changes[j] - shift - m.start >= p.shortest:
                    end = changes[j] - shift
                    confidence = _certainty(t, changes[j], q, states.path)
                    cause = CHANGE
        if end < 0 and t - m.start >= p.longest:
            end = t
        if end < 0:
            continue
        low = p.still_share * running_speed(m)
        still = all_low(m, end, low, watched.speeds)
        return k + 1, int(close(m, p, end, confidence, still, cause, out, 0))
    return len(frames), 0


@njit(cache=True)
def _certainty(t: int, change: int, q: Any, path: Path) -> float:
    """How much dearer the best path without this change is, as a share of C."""
    size = path.costs.shape[0]
    without = math.inf
    for s in range(_oldest(t, q.window, size), t + 1):
        if path.entered[s % size] < change:
            without = min(without, path.costs[s % size])
    excess = (without - path.best_costs[t % size]) / path.switch_costs[change % size]
    return float(min(1.0, max(0.0, excess)))

"""Distances between markers on one segment of the body: what a person cannot change by moving."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit

from mplearn.recording import FloatArray, IntArray

from .markers import find_marker_set

FIRM = {"head": 0.003, "hand_l": 0.004, "hand_r": 0.004, "foot_l": 0.004, "foot_r": 0.004}
SOFT = 0.008  # how much skin and straps give elsewhere [m]


def rigid_pairs(marker_names: Sequence[str]) -> tuple[IntArray, FloatArray]:
    """Return the pairs of markers that sit on one segment, and how much their distance varies.

    Args:
        marker_names: Names of the markers, of a known set.

    Returns:
        Places of the two markers, shape (K, 2); usual variation with posture, shape (K,) [m].

    Raises:
        BodyError: The markers belong to no known set.
    """
    markers = find_marker_set(marker_names)
    known = [i for i, knows in enumerate(markers.knows(marker_names)) if knows]
    bodies = markers.select([marker_names[i] for i in known]).bodies
    pairs = [
        (known[i], known[j]) for j in range(len(known)) for i in range(j) if bodies[i] == bodies[j]
    ]
    firm = dict(zip(known, bodies, strict=True))
    give = [FIRM.get(firm[i], SOFT) for i, _ in pairs]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2), np.array(give)


@njit(cache=True)
def distances_of(markers: FloatArray, pairs: IntArray) -> FloatArray:
    """Return the distances of pairs of markers, (M, 3) and (K, 2) to (K,) [m]; NaN if unseen."""
    out = np.empty(len(pairs))
    for k in range(len(pairs)):
        total = 0.0
        for axis in range(3):
            total += (markers[pairs[k, 0], axis] - markers[pairs[k, 1], axis]) ** 2
        out[k] = np.sqrt(total)
    return out


@njit(cache=True)
def follow_steadily(
    seen: FloatArray,
    last: FloatArray,
    near: FloatArray,
    steps: FloatArray,
    spread: FloatArray,
    quick: float,
    slow: float,
) -> bool:
    """Hold a frame's distances against their short memory; take them up unless most have changed.

    Args:
        seen: Distances, shape (K,); NaN where unseen.
        last: As last seen, shape (K,); NaN where never. Changed in place, like what follows.
        near: Short running mean of each, shape (K,).
        steps: Running variance of the change from one frame to the next, shape (K,).
        spread: Running variance about the running mean, shape (K,).
        quick: Share of the mean that a frame renews.
        slow: Share of the variances that it renews.

    Returns:
        Whether most have changed: nothing was taken up then.
    """
    off, known = 0, 0
    for k in range(len(seen)):
        if not (np.isnan(seen[k]) or np.isnan(near[k])):
            known += 1
            off += (seen[k] - near[k]) ** 2 > FAR**2 * spread[k]
    if 2 * off > known:
        return True
    for k in range(len(seen)):
        if np.isnan(seen[k]):
            continue
        if np.isnan(near[k]):
            near[k] = last[k] = seen[k]
            continue
        step, deviation = seen[k] - last[k], seen[k] - near[k]
        steps[k] += slow * (min(step**2, 16 * steps[k]) - steps[k])
        spread[k] += slow * (min(deviation**2, 16 * spread[k]) - spread[k])
        steps[k], spread[k] = max(steps[k], NOISE**2), max(spread[k], NOISE**2)
        near[k] += quick * deviation
        last[k] = seen[k]
    return False


FAR = 2.0  # standard deviations
NOISE = 0.0005  # smallest of them [m]

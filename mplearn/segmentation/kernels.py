"""The numerical work that segmenters share: low-pass velocity, compiled with numba."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..maths.compiling import njit
from ..recording import FloatArray

ROUNDING = 4e-15  # of a place, by which a filter may go on moving for ever


class Smooth(NamedTuple):
    """What the filter keeps of each channel, and what it made of the newest frame; each (D,).

    Attributes:
        delay_1: First delay line of the filter.
        delay_2: Second delay line.
        place: The newest frame, filtered.
        velocity: Its velocity.
        weights: How much each channel counts in the speed, and in distances.
    """

    delay_1: FloatArray
    delay_2: FloatArray
    place: FloatArray
    velocity: FloatArray
    weights: FloatArray


@njit(cache=True)
def all_finite(frame: FloatArray) -> bool:
    """Whether no value is NaN or infinite."""
    for i in range(frame.shape[0]):  # noqa: SIM110 (numba)
        if not math.isfinite(frame[i]):
            return False
    return True


@njit(cache=True)
def smooth_velocity(frame: FloatArray, c: FloatArray, smooth: Smooth, first: bool) -> float:
    """Filter one frame, and return the norm of its velocity, the speed.

    Args:
        frame: The new measurement, shape (D,).
        c: ``b0, b1, b2, a1, a2`` of the filter and the frame rate [1/s], shape (6,).
        smooth: What the filter keeps; receives the filtered frame and its velocity.
        first: Whether this is the first frame; the filter starts as if it had always been there.

    Where frames are identical the filter may go on in a cycle of the last bits: that is rest.
    """
    b0, b1, b2, a1, a2, rate = c[0], c[1], c[2], c[3], c[4], c[5]
    delay_1, delay_2, place, velocity, weights = smooth
    total = 0.0
    for i in range(frame.shape[0]):
        x = frame[i]
        if first:
            delay_1[i] = (1.0 - b0) * x
            delay_2[i] = (b2 - a2) * x
            place[i] = x
        y = b0 * x + delay_1[i]
        delay_1[i] = b1 * x - a1 * y + delay_2[i]
        delay_2[i] = b2 * x - a2 * y
        v = (y - place[i]) * rate if abs(y - place[i]) > ROUNDING * abs(y) else 0.0
        place[i] = y
        velocity[i] = v
        total += weights[i] * v * v
    return math.sqrt(total)


@njit(cache=True)
def distance(a: FloatArray, b: FloatArray, weights: FloatArray) -> float:
    """Return the weighted Euclidean distance between two frames, shape (D,) each."""
    total = 0.0
    for i in range(a.shape[0]):
        total += weights[i] * (a[i] - b[i]) ** 2
    return math.sqrt(total)

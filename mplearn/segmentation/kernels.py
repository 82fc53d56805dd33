"""The numerical work that segmenters share: low-pass velocity, compiled with numba."""

from __future__ import annotations

import math

from numba import njit

from ..recording import FloatArray


@njit(cache=True)
def all_finite(frame: FloatArray) -> bool:
    """Whether no value is NaN or infinite."""
    for i in range(frame.shape[0]):  # noqa: SIM110 (numba)
        if not math.isfinite(frame[i]):
            return False
    return True


@njit(cache=True)
def smooth_velocity(frame: FloatArray, c: FloatArray, memory: FloatArray, first: bool) -> float:
    """Filter one frame, leave its velocity in ``memory[3]`` and return its norm, the speed.

    Args:
        frame: The new measurement, shape (D,).
        c: ``b0, b1, b2, a1, a2`` of the filter and the frame rate [1/s], shape (6,).
        memory: Two delay lines, the last filtered frame, the velocity, and how much each channel
            counts in the speed, shape (5, D).
        first: Whether this is the first frame; the filter starts as if it had always been there.
    """
    b0, b1, b2, a1, a2, rate = c[0], c[1], c[2], c[3], c[4], c[5]
    total = 0.0
    for i in range(frame.shape[0]):
        x = frame[i]
        if first:
            memory[0, i] = (1.0 - b0) * x
            memory[1, i] = (b2 - a2) * x
            memory[2, i] = x
        y = b0 * x + memory[0, i]
        memory[0, i] = b1 * x - a1 * y + memory[1, i]
        memory[1, i] = b2 * x - a2 * y
        v = (y - memory[2, i]) * rate
        memory[2, i] = y
        memory[3, i] = v
        total += memory[4, i] * v * v
    return math.sqrt(total)

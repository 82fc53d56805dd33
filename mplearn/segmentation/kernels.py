"""The numerical work that segmenters share: low-pass velocity, compiled with numba."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from ..recording import FloatArray


class LowPass(NamedTuple):
    """A second-order Butterworth low-pass followed by a difference.

    Attributes:
        coefficients: ``b0, b1, b2, a1, a2`` and the frame rate [1/s], shape (6,).
        lag_frames: How late the filtered velocity is, for slow motion.
    """

    coefficients: FloatArray
    lag_frames: float


def design_low_pass(cutoff_hz: float, rate_hz: float) -> LowPass:
    """Design the filter by the bilinear transform; the cutoff is kept below 0.4 of the rate."""
    k = math.tan(math.pi * min(cutoff_hz, 0.4 * rate_hz) / rate_hz)
    norm = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
    b0 = k * k * norm
    a1 = 2.0 * (k * k - 1.0) * norm
    a2 = (1.0 - math.sqrt(2.0) * k + k * k) * norm
    lag = math.sqrt(0.5) / k + 0.5
    return LowPass(np.array([b0, 2.0 * b0, b0, a1, a2, rate_hz]), lag)


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
        c: `LowPass.coefficients`.
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

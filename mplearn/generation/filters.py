"""The zero-phase low-pass filter for trajectories and exemplars."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..errors import InvalidValueError
from ..recording import FloatArray


def lowpass(frames: FloatArray, rate_hz: float, cutoff_hz: float) -> FloatArray:
    """Return frames without what is faster than a cut-off, without delay.

    A Butterworth filter of second order, run forwards and backwards; the ends are continued by
    point reflection, so that they stay where they are as nearly as possible.

    Args:
        frames: Shape (T, D), finite.
        rate_hz: Frames per second [1/s].
        cutoff_hz: Where the amplitude has fallen to one half [1/s]. At or beyond half the frame
            rate, infinity included, there is nothing to take away.

    Raises:
        InvalidValueError: The cut-off is not positive, or a frame is not finite.
    """
    if not cutoff_hz > 0:
        raise InvalidValueError(f"cutoff_hz must be positive, not {cutoff_hz}")
    if not np.isfinite(frames).all():
        raise InvalidValueError("frames to be filtered must be finite")
    motion = np.array(frames, dtype=np.float64)
    if cutoff_hz >= rate_hz / 2 or len(motion) < 3:
        return motion
    settling = math.ceil(2 * rate_hz / cutoff_hz)
    pad = min(len(motion) - 1, settling)
    before, after = 2 * motion[0] - motion[pad:0:-1], 2 * motion[-1] - motion[-2 : -pad - 2 : -1]
    continued = np.concatenate([before, motion, after])
    # the bilinear transform of 1 / (s^2 + sqrt(2) s + 1), its cut-off kept where it is
    k = math.tan(math.pi * cutoff_hz / rate_hz)
    scale = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
    both_ways(
        continued,
        scale * k * k,
        scale * 2.0 * (k * k - 1.0),
        scale * (1.0 - math.sqrt(2.0) * k + k * k),
    )
    return continued[pad : pad + len(motion)].copy()


@njit(cache=True)
def both_ways(x: FloatArray, gain: float, a1: float, a2: float) -> None:
    """Filter in place by gain (1 + z)^2 / (1 + a1 z + a2 z^2), forwards, then backwards.

    Args:
        x: Shape (T, D). Each channel begins as if it had always been what it is at first.
        gain: See above; z is a delay by one frame.
        a1: See above.
        a2: See above.
    """
    n, n_channels = x.shape
    first, second = np.empty(n_channels), np.empty(n_channels)  # the past in the next two frames
    for way in (1, -1):
        begin = 0 if way == 1 else n - 1
        for d in range(n_channels):
            first[d] = (1.0 - gain) * x[begin, d]
            second[d] = (gain - a2) * x[begin, d]
        for i in range(n):
            t = begin + way * i
            for d in range(n_channels):
                value = x[t, d]
                out = gain * value + first[d]
                first[d] = 2.0 * gain * value - a1 * out + second[d]
                second[d] = gain * value - a2 * out
                x[t, d] = out

"""Butterworth's low-pass filter of second order: its design, and a run without delay.

scipy.signal makes the same numbers (the tests compare); to import it takes longer than to learn
some minutes of motion, and for a short motion its filter takes ten times as long.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray
from .compiling import njit


class Butterworth(NamedTuple):
    """The filter gain (1 + z)^2 / (1 + a1 z + a2 z^2); z is a delay by one frame.

    Attributes:
        gain: See above.
        a1: See above.
        a2: See above.
        delay_frames: How late it is for slow motion.
    """

    gain: float
    a1: float
    a2: float
    delay_frames: float


def butterworth(cutoff_hz: float, rate_hz: float) -> Butterworth:
    """Design the low-pass filter of second order.

    By the bilinear transform of 1 / (s^2 + sqrt(2) s + 1), its cut-off kept where it is.

    Args:
        cutoff_hz: Where half of the power passes, below half the frame rate [1/s].
        rate_hz: Frames per second [1/s].

    Example:
        >>> at_quarter = butterworth(25.0, 100.0)
        >>> round(at_quarter.gain, 4), round(at_quarter.delay_frames, 4)
        (0.2929, 0.7071)
    """
    k = math.tan(math.pi * cutoff_hz / rate_hz)
    norm = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
    return Butterworth(
        k * k * norm,
        2.0 * (k * k - 1.0) * norm,
        (1.0 - math.sqrt(2.0) * k + k * k) * norm,
        math.sqrt(0.5) / k,
    )


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

    Example:
        >>> shaking = np.array([[0.0], [1.0]] * 50)
        >>> lowpass(shaking, 100.0, 5.0)[40:43].round(2)
        array([[0.5],
               [0.5],
               [0.5]])
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
    own = butterworth(cutoff_hz, rate_hz)
    both_ways(continued, own.gain, own.a1, own.a2)
    return continued[pad : pad + len(motion)].copy()


@njit(cache=True)
def both_ways(x: FloatArray, gain: float, a1: float, a2: float) -> None:
    """Filter in place, forwards, then backwards.

    Args:
        x: Shape (T, D). Each channel begins as if it had always been what it is at first.
        gain: See `Butterworth`.
        a1: See there.
        a2: See there.
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

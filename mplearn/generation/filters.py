"""The zero-phase low-pass filter for trajectories and exemplars."""

from __future__ import annotations

import math

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray

_ORDER = 2


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
    if cutoff_hz >= rate_hz / 2 or len(frames) < 3:
        return np.array(frames, dtype=np.float64)
    from scipy.signal import butter, sosfiltfilt

    sections = butter(_ORDER, cutoff_hz, fs=rate_hz, output="sos")
    settling = math.ceil(2 * rate_hz / cutoff_hz)
    pad = min(len(frames) - 1, settling)
    return np.asarray(sosfiltfilt(sections, frames, axis=0, padtype="odd", padlen=pad))

"""A recording at another rate, without aliasing, with its gaps and labels."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidValueError
from ..maths.resampling import bridge_gaps
from ..recording import FloatArray, LabelledSegment, Recording

if TYPE_CHECKING:
    from scipy import sparse

_ZERO_CROSSINGS = 24  # of the sinc on each side: a transition band of 10 % of the Nyquist frequency
_KAISER_BETA = 8.0  # about 80 dB of stop-band attenuation
_CUTOFF = 0.95  # of the lower of the two Nyquist frequencies


def resample(recording: Recording, rate_hz: float) -> Recording:
    """Return a recording at another rate.

    A zero-phase low-pass filter (a sinc in a Kaiser window, cut at the lower Nyquist frequency) is
    evaluated at the new times, which start at the first frame's. Gaps are bridged for the filter,
    and a new frame whose nearest old frame is missing is missing too.

    Args:
        recording: At any rate.
        rate_hz: The new rate [1/s], 1 to 10,000.

    Returns:
        ``floor((T - 1) * rate_hz / recording.rate_hz) + 1`` frames; labels cover the same times.

    Raises:
        InvalidValueError: The rate lies outside its range.

    Example:
        >>> import numpy as np
        >>> slow = Recording(np.arange(6.0)[:, None], 50.0, ("x",))
        >>> fast = resample(slow, 100.0)
        >>> len(fast), float(fast.frames[5, 0].round(2))
        (11, 2.5)
    """
    if not 1.0 <= rate_hz <= 10_000.0:
        raise InvalidValueError(f"rate_hz must lie in [1, 10000] 1/s, not {rate_hz}")
    ratio = rate_hz / recording.rate_hz
    if ratio == 1.0 or len(recording) < 2:
        return replace(recording, rate_hz=rate_hz)
    n_new = int(np.floor((len(recording) - 1) * ratio + 1e-9)) + 1
    places = np.arange(n_new) / ratio  # in old frames
    missing = np.isnan(recording.frames)
    filled = np.nan_to_num(bridge_gaps(recording.frames))
    pad = int(np.ceil(_ZERO_CROSSINGS / (min(1.0, ratio) * _CUTOFF))) + 1
    frames = _kernel(places + pad, len(filled) + 2 * pad, min(1.0, ratio) * _CUTOFF) @ _extended(
        filled, pad
    )
    nearest = np.minimum(np.rint(places).astype(np.int64), len(recording) - 1)
    frames[missing[nearest]] = np.nan
    return replace(
        recording, frames=frames, rate_hz=rate_hz, labels=_moved(recording.labels, ratio, n_new)
    )


def _kernel(places: FloatArray, n_old: int, cutoff: float) -> sparse.csr_array:
    """Return the filter at fractional places, shape (len(places), n_old); rows sum to 1."""
    from scipy import sparse

    reach = _ZERO_CROSSINGS / cutoff
    taps = np.ceil(places - reach).astype(np.int64)[:, None] + np.arange(int(2 * reach) + 1)
    away = taps - places[:, None]
    window = np.i0(_KAISER_BETA * np.sqrt(np.clip(1.0 - (away / reach) ** 2, 0.0, None)))
    weights = np.sinc(cutoff * away) * window * (np.abs(away) <= reach)
    weights /= weights.sum(axis=1, keepdims=True)
    starts = np.arange(0, taps.size + 1, taps.shape[1])
    return sparse.csr_array(
        (weights.ravel(), np.clip(taps, 0, n_old - 1).ravel(), starts), (len(places), n_old)
    )


def _extended(frames: FloatArray, pad: int) -> FloatArray:
    """Continue both ends by point reflection, which keeps level and slope."""
    return np.pad(frames, ((pad, pad), (0, 0)), mode="reflect", reflect_type="odd")


def _moved(
    labels: tuple[LabelledSegment, ...], ratio: float, n_new: int
) -> tuple[LabelledSegment, ...]:
    """Return the new frames whose times lie in each segment; one too short for any falls away."""
    moved = []
    for label in labels:
        start, end = (min(int(np.ceil(x * ratio - 1e-9)), n_new) for x in (label.start, label.end))
        if start < end:
            moved.append(replace(label, start=start, end=end))
    return tuple(moved)

"""Frame numbers from a column of times, which tools round and from which frames may be dropped."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..recording import FloatArray, IntArray
from .files import bad_file


def frame_numbers(path: Path, times_s: FloatArray) -> tuple[IntArray, float]:
    """Return the number of each frame on an even clock, and the clock's rate.

    Args:
        path: The file, for messages.
        times_s: Time of each frame, shape (T,) [s].

    Returns:
        Numbers, shape (T,), from 0, with a step above 1 where frames were dropped; and the rate
        [1/s], NaN for a single frame.

    Raises:
        RecordingError: The times do not increase, or fit no even rate.
    """
    if np.isnan(times_s).any():
        raise bad_file(path, "a time is missing", "a time in every row")
    if len(times_s) == 1:
        return np.zeros(1, np.int64), np.nan
    steps = np.diff(times_s)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0)) + 1
        raise bad_file(path, f"time goes back at frame {row}", "increasing times [s]")
    whole = np.rint(steps / np.median(steps))
    if whole.sum() > 10 * len(times_s) + 1000:
        raise bad_file(
            path, "most of the time has no frames", "an even rate with few dropped frames"
        )
    index = np.concatenate([[0], np.cumsum(whole)]).astype(np.int64)
    rate_hz = float(index[-1] / (times_s[-1] - times_s[0]))
    off = np.abs((times_s - times_s[0]) * rate_hz - index)
    if (whole < 1).any() or off.max() > 0.5:
        raise bad_file(
            path,
            f"frame {int(off.argmax())} lies {off.max():.2f} frames off an even rate",
            "evenly spaced times (a dropped frame leaves a gap of whole frames)",
        )
    return index, rate_hz

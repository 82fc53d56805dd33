"""An even clock from a column of times, which tools round and from which frames may be dropped."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..recording import FloatArray
from .files import bad_file
from .findings import Findings

# steps between frames from which on times count less than seconds: 2 ms are 500 Hz
_FINER = ((1e-3, "milliseconds", 2.0), (1e-6, "microseconds", 2e3), (1e-9, "nanoseconds", 2e6))
_TICKS = (1.2e17, 9e17)  # what .NET and Windows count in our days; nanoseconds are 1.7e18
_EVEN = 0.3  # of a frame: what rounding leaves
_ROUNDED = 0.6  # of the last decimal: rounding leaves a half, the line through all is not exact
_OFTEN = 5  # frames that would be missing: where they lie as evenly as rounding has it, none is
_OFF = 0.75  # of a frame, that the jitter of a clock leaves; where one is missing it is more
_UNEVEN, _MANY = 0.1, 0.2  # a clock jitters if such a share of its steps is off by such a share


@dataclass(frozen=True, eq=False)
class Clock:
    """Where the frames of a file lie on an even clock.

    Attributes:
        rate_hz: Frames per second [1/s]; NaN for a single frame.
        places: Place of each frame, shape (T,), from 0, with a step above 1 where frames were
            dropped; whole numbers unless the times jitter.
        jitters: Whether the times are off an even clock by more than rounding leaves.
    """

    rate_hz: float
    places: FloatArray
    jitters: bool

    def even(self, values: FloatArray) -> FloatArray:
        """Return values at even times, shape (T, D) to (T', D); NaN where frames were dropped.

        Values that were taken at uneven times are interpolated linearly.
        """
        if not self.jitters:
            index = self.places.astype(np.int64)
            frames = np.full((index[-1] + 1, values.shape[1]), np.nan)
            frames[index] = values
            return frames
        at = np.arange(int(np.floor(self.places[-1] + 1e-9)) + 1)
        after = np.clip(np.searchsorted(self.places, at, side="left"), 1, len(values) - 1)
        gap = self.places[after] - self.places[after - 1]
        share = np.clip((at - self.places[after - 1]) / gap, 0.0, 1.0)[:, None]
        frames = (1.0 - share) * values[after - 1] + share * values[after]
        exact = np.where(share == 0.0, values[after - 1], values[after])  # spares NaN beside it
        frames = np.where((share == 0.0) | (share == 1.0), exact, frames)
        near = np.where(share[:, 0] < 0.5, after - 1, after)
        frames[(gap >= 1.5) & (np.abs(self.places[near] - at) > _OFF)] = np.nan
        return frames


def even_clock(path: Path, times_s: FloatArray) -> Clock:
    """Return the even clock that times belong to.

    Args:
        path: The file, for messages.
        times_s: Time of each frame, shape (T,) [s].

    Raises:
        RecordingError: The times do not increase, or fit no even rate.
    """
    if np.isnan(times_s).any():
        raise bad_file(path, "a time is missing", "a time in every row")
    if len(times_s) == 1:
        return Clock(np.nan, np.zeros(1), False)
    steps = np.diff(times_s)
    if steps.min() == 0:  # coarse decimals repeat a time
        rounded_s = _rounded_step(times_s)
        if rounded_s is not None and rounded_s > 0:
            return Clock(1.0 / rounded_s, np.arange(len(times_s), dtype=np.float64), False)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0)) + 1
        raise bad_file(path, f"time goes back at frame {row}", "increasing times [s]")
    whole = np.rint(steps / np.median(steps))
    if whole.sum() > 10 * len(times_s) + 1000:
        raise bad_file(
            path, "most of the time has no frames", "an even rate with few dropped frames"
        )
    coarse = (whole < 1).any() or (whole.max() == 2 and (whole == 2).sum() >= _OFTEN)
    rounded_s = _rounded_step(times_s) if coarse else None
    if rounded_s is not None:
        return Clock(1.0 / rounded_s, np.arange(len(times_s), dtype=np.float64), False)
    if (whole < 1).any() and _jitters(times_s):
        rate_hz = (len(times_s) - 1) / (times_s[-1] - times_s[0])
        return Clock(float(rate_hz), (times_s - times_s[0]) * rate_hz, True)
    index = np.concatenate([[0.0], np.cumsum(whole)])
    rate_hz = float(index[-1] / (times_s[-1] - times_s[0]))
    places = (times_s - times_s[0]) * rate_hz
    off = np.abs(places - index)
    if (whole < 1).any():
        row = int(np.argmax(whole < 1)) + 1
        raise bad_file(
            path,
            f"frame {row} lies {off[row]:.2f} frames off an even rate",
            "evenly spaced times (a dropped frame leaves a gap of whole frames)",
        )
    if off.max() <= _EVEN:
        return Clock(rate_hz, index, False)
    return Clock(rate_hz, places, True)


def _rounded_step(times_s: FloatArray) -> float | None:
    """Return the step of even times that were rounded to coarse decimals [s]; None for others."""
    decimals = next((k for k in range(4) if _whole(times_s * 10.0**k)), None)
    if decimals is None or len(times_s) < 3:
        return None
    index = np.arange(len(times_s), dtype=np.float64)
    step_s, start_s = np.polyfit(index, times_s - times_s[0], 1)
    off = np.abs(times_s - times_s[0] - start_s - step_s * index).max()
    return float(step_s) if off <= _ROUNDED * 10.0**-decimals else None


def _whole(values: FloatArray) -> bool:
    return bool(np.abs(values - np.rint(values)).max() < 1e-6)


def _jitters(times_s: FloatArray) -> bool:
    """Whether times lie around an even clock of which no frame is missing, many of them off it."""
    steps = np.diff(times_s)
    uneven = np.abs(steps / np.median(steps) - 1.0) > _UNEVEN
    index = np.arange(len(times_s), dtype=np.float64)
    even = np.polyval(np.polyfit(index, times_s - times_s[0], 1), index)
    off = np.abs(times_s - times_s[0] - even).max() / steps.mean()
    return bool(uneven.mean() >= _MANY and off < _OFF and steps.max() < 2.5 * steps.mean())


def in_seconds(times: FloatArray, unit_s: float | None, findings: Findings) -> FloatArray:
    """Return times in seconds.

    Args:
        times: Time of each frame, shape (T,).
        unit_s: Their unit [s]; None where it is not said and their steps must tell.
        findings: Where to tell which unit was taken.
    """
    if unit_s is not None:
        return times * unit_s
    if len(times) < 2 or np.isnan(times).any():
        return times
    step = float(np.median(np.diff(times)))
    if _TICKS[0] < np.median(times) < _TICKS[1]:
        findings.note("times are taken as ticks of 100 ns, since the year 1 or 1601")
        return np.asarray((times - times[0]) * 1e-7)
    for unit, name, least in _FINER:
        if least <= step < 500.0 * least:
            findings.note(f"times are taken as {name}: their steps are {step:.6g}")
            return times * unit
    return times

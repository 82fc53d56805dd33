"""Where frames lie on an even clock, by the sender's numbers or times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..recording import FloatArray
from .source import RATES_HZ

USUAL_HZ = (
    *(15.0, 20.0, 24.0, 25.0, 30.0, 40.0, 48.0, 50.0, 60.0, 72.0, 75.0, 80.0, 90.0, 100.0, 120.0),
    *(125.0, 144.0, 150.0, 160.0, 180.0, 200.0, 240.0, 250.0, 300.0, 360.0, 480.0, 500.0, 1000.0),
)
NEAR = 0.012  # share by which a measured rate may be off a usual one
EVEN = 0.3  # of a frame: what rounding leaves of an even clock
FOLLOW = 0.05  # share of its error by which the clock follows the sender's
INTERPOLATED = 2.5  # frames between two samples, from which on something is missing


@dataclass(frozen=True)
class Pace:
    """How the frames of a stream follow each other.

    Attributes:
        rate_hz: Frames per second [1/s].
        stride: By how much the sender's numbers differ from frame to frame.
        even: Whether times lie on an even clock, but for rounding.
    """

    rate_hz: float
    stride: int = 1
    even: bool = True


def measured_pace(numbers: Sequence[int | None], times_s: Sequence[float]) -> Pace | None:
    """Return the pace of the first samples of a stream that does not say it; None for none.

    Args:
        numbers: The sender's numbers, or None.
        times_s: The sender's times, or those of arrival [s].
    """
    times = np.asarray(times_s, dtype=np.float64)
    steps = np.diff(times)
    counts: FloatArray = np.ones(len(steps))
    stride = 1
    known = [n for n in numbers if n is not None]
    if len(known) == len(times):
        jumps = np.diff(np.array(known, dtype=np.int64))
        if not (jumps > 0).any():
            return None
        values, often = np.unique(jumps[jumps > 0], return_counts=True)
        stride = int(values[often.argmax()])
        counts = jumps.astype(np.float64) / stride
    fine = (steps > 0) & (counts > 0)
    if fine.sum() < 3:
        return None
    step_s = float(np.median(steps[fine] / counts[fine]))
    whole = np.maximum(np.rint(steps[fine] / step_s), 1.0)
    mean_s = float(steps[fine].sum() / whole.sum())
    off = np.cumsum(steps[fine] / mean_s - whole)
    rate_hz = 1.0 / mean_s
    usual = min(USUAL_HZ, key=lambda hz: abs(hz / rate_hz - 1.0))
    if abs(usual / rate_hz - 1.0) < NEAR:
        rate_hz = usual
    if not RATES_HZ[0] <= rate_hz <= RATES_HZ[1]:
        return None
    return Pace(rate_hz, stride, bool(np.ptp(off) <= 2.0 * EVEN))


class EvenClock:
    """Says which frame a time belongs to; it follows a sender's clock that goes a little wrong.

    Args:
        rate_hz: Frames per second [1/s].
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._start_s: float | None = None

    def ahead(self, time_s: float, place: int) -> float:
        """Return how many frames a time is ahead of a frame's."""
        if self._start_s is None:
            self.restart(time_s, place)
            return 0.0
        return (time_s - self._start_s) * self._rate_hz - place

    def follow(self, ahead: float) -> None:
        """Take in that the time of a frame was ahead of where it should be."""
        if self._start_s is not None:
            self._start_s += FOLLOW * ahead / self._rate_hz

    def restart(self, time_s: float, place: int) -> None:
        """Let a time belong to a frame, whatever was before."""
        self._start_s = time_s - place / self._rate_hz


class Interpolation:
    """Samples at uneven times, as frames of an even clock, by lines between them.

    Args:
        rate_hz: Frames per second [1/s].
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._start_s = 0.0
        self._place = 0.0  # of the last sample [frames]
        self._values: FloatArray | None = None

    def take(self, time_s: float, values: FloatArray) -> list[tuple[int, FloatArray]]:
        """Take the next sample; return the frames that are known by it, with their places.

        Empty where it is no later than the one before.
        """
        if self._values is None:
            self._values = values
            return [(round(self._place), values)]
        place = (time_s - self._start_s) * self._rate_hz
        before, earlier = self._place, self._values
        if place <= before:
            return []
        self._place, self._values = place, values
        frames = []
        for number in range(int(np.floor(before)) + 1, int(np.floor(place)) + 1):
            if place - before >= INTERPOLATED and min(number - before, place - number) > 0.5:
                continue  # nothing is known of it
            share = (number - before) / (place - before)
            frames.append((number, earlier + share * (values - earlier)))
        return frames

    def restart(self, time_s: float, place: int) -> None:
        """Let a time belong to a frame, whatever was before."""
        self._values, self._place = None, float(place)
        self._start_s = time_s - place / self._rate_hz

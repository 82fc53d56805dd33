"""A stream at another rate, on-line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..arguments import require_number
from ..errors import InvalidValueError
from ..recording import BoolArray, FloatArray
from .source import Block, Change, Source, Stream

SAME = 1e-3  # rates that differ by a smaller share are one


class ResampledSource(Source):
    """A source at one rate, whatever comes.

    Each new frame is the mean of the frames around its time, weighted by a triangle as wide as two
    steps of the slower rate: lines between frames where the new rate is higher, a low-pass filter
    where it is lower. It is as late as that filter is long: a step of the slower rate. Files are
    resampled more sharply (`mplearn.mocap.resample`), with frames from after a moment too.

    Args:
        source: The stream.
        rate_hz: The new rate [1/s], or what gives it for the first rate of the stream.

    Raises:
        InvalidValueError: The rate lies outside 1 to 10,000.
    """

    def __init__(self, source: Source, rate_hz: float | Callable[[float], float]) -> None:
        if not callable(rate_hz):
            require_number("rate_hz", rate_hz)
        if not callable(rate_hz) and not 1.0 <= rate_hz <= 10_000.0:
            raise InvalidValueError(f"rate_hz must lie in [1, 10000] 1/s, not {rate_hz}")
        self.name, self.tally = source.name, source.tally
        self._source, self._choose = source, rate_hz
        self._rate_hz: float | None = None
        self._raw: Stream | None = None
        self._out: Stream | None = None
        self._frames: FloatArray = np.zeros((0, 0))  # that are still needed
        self._arrived: FloatArray = np.zeros(0)
        self._first = 0  # place of the first of them since the stretch began
        self._next = 0  # place of the next new frame
        self._start_s = 0.0  # when the stretch began
        self._joins = False

    @property
    def ended(self) -> bool:
        """Whether nothing more will come."""
        return self._source.ended

    def close(self) -> None:
        """End it."""
        self._source.close()

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        """Return what came; see `Source.read`."""
        out: list[Block | Change] = []
        for item in self._source.read(timeout_s):
            if isinstance(item, Change) or self._keeps(item):
                out.append(item)
            else:
                out += self._take(item)
        return out

    # ---- inside

    def _keeps(self, block: Block) -> bool:
        """Say whether a block has the right rate as it is."""
        if self._rate_hz is None:
            choose = self._choose
            self._rate_hz = choose(block.rate_hz) if callable(choose) else choose
        return abs(block.rate_hz / self._rate_hz - 1.0) <= SAME

    def _take(self, block: Block) -> list[Block]:
        assert self._rate_hz is not None
        if block.stream is not self._raw or not block.joins:
            if self._raw is None or self._raw.rate_hz != block.rate_hz or not block.joins:
                self._start_s, self._first, self._next = float(block.times_s[0]), 0, 0
                self._frames = np.zeros((0, len(block.channels)))
                self._arrived, self._joins = np.zeros(0), False
            self._raw = block.stream
            self._out = replace(block.stream, rate_hz=self._rate_hz)
        assert self._out is not None
        self._frames = np.concatenate([self._frames, block.frames])
        self._arrived = np.concatenate([self._arrived, block.arrived_s])
        step = block.rate_hz / self._rate_hz  # of a new frame, in old ones
        width = max(1.0, step)
        known = self._first + len(self._frames)
        end = int(np.floor((known - width) / step + 1e-9)) + 1
        if end <= self._next:
            return []
        numbers = np.arange(self._next, end, dtype=np.float64)
        frames, missing = _smoothed(self._frames, self._first, numbers * step, width)
        newest = np.ceil(numbers * step + width - 1e-9).astype(np.int64) - 1 - self._first
        arrived = self._arrived[np.clip(newest, 0, len(self._arrived) - 1)]
        arrived = np.where(
            missing, np.nan, np.where(np.isnan(arrived), block.arrived_s[-1], arrived)
        )
        self._next = end
        needed = max(int(np.floor(end * step - width)), self._first)
        self._frames = self._frames[needed - self._first :]
        self._arrived = self._arrived[needed - self._first :]
        self._first = needed
        joins, self._joins = self._joins, True
        times = self._start_s + numbers / self._rate_hz
        return [
            replace(
                block,
                stream=self._out,
                frames=frames,
                times_s=times,
                arrived_s=arrived,
                joins=joins,
            )
        ]


def _smoothed(
    frames: FloatArray, first: int, places: FloatArray, width: float
) -> tuple[FloatArray, BoolArray]:
    """Return frames at places between those given, and which are missing as a whole.

    Args:
        frames: Shape (T, D).
        first: Place of the first of them.
        places: Shape (n,).
        width: Half of the triangle's width [frames].
    """
    taps = np.floor(places - width).astype(np.int64)[:, None] + np.arange(int(2 * width) + 3)
    weights = np.clip(1.0 - np.abs(taps - places[:, None]) / width, 0.0, None)  # (n, k)
    weights[weights < 1e-9] = 0.0  # what rounding leaves of frames that may not be there yet
    taps -= first
    weights[(taps < 0) | (taps >= len(frames))] = 0.0
    taps = np.clip(taps, 0, len(frames) - 1)
    seen = ~np.isnan(frames)
    filled, known = np.where(seen, frames, 0.0), seen.astype(np.float64)
    total, of = np.zeros((2, len(places), frames.shape[1]))
    for tap, weight in zip(taps.T, weights.T, strict=True):  # in one order, whatever the shape
        total += weight[:, None] * filled[tap]
        of += weight[:, None] * known[tap]
    nearest = np.clip(np.rint(places).astype(np.int64) - first, 0, len(frames) - 1)
    there = seen[nearest]
    smoothed = np.full(total.shape, np.nan)
    np.divide(total, of, out=smoothed, where=there)
    return smoothed, np.asarray(~there.any(axis=1))

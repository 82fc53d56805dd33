"""A slow stream cut as finely as a fast one: what lies between its frames is put in.

At 20 to 60 frames a second the speed, a difference of two frames, misses its own minima, and a turn
lies anywhere between two frames: many a boundary is lost that 100 frames a second show. So the
parabola through the latest three frames is drawn up to the newest one, at once, and a segmenter
takes its points for frames. What it finds is told in frames of the stream.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..errors import FrameError
from ..maths.compiling import njit
from ..recording import FloatArray, Segment
from ..state import require, validated
from .base import Segmenter, SegmenterState, as_frames, check_array, require_finite
from .kernels import all_finite

LEAST_HZ = 100.0
"""Slower streams are upsampled, by a whole number, to at least this rate [1/s]."""

_AT_ONCE = 64  # frames that are upsampled together
_LATEST = "latest"  # array of a state; a stream that began without upsampling has none


def upsampled(make: Callable[[int, float], Segmenter]) -> Callable[[int, float], Segmenter]:
    """Return what makes the same segmenter, and upsamples slow streams for it.

    Args:
        make: Called with the width of a frame and the rate [1/s]; a class will do.

    Example:
        >>> from mplearn.segmentation import ZeroVelocity
        >>> type(upsampled(ZeroVelocity)(2, 120.0)).__name__
        'ZeroVelocity'
        >>> upsampled(ZeroVelocity)(2, 30.0).step_hz
        120.0
    """

    def made(n_channels: int, rate_hz: float) -> Segmenter:
        if rate_hz >= LEAST_HZ or not rate_hz > 0.0:  # of the latter, `make` complains
            return make(n_channels, rate_hz)
        return Upsampled(n_channels, rate_hz, make)

    return made


class Upsampled(Segmenter):
    """A segmenter of a slow stream, by one of a stream of at least `LEAST_HZ`.

    Args:
        n_channels: Width D of a frame.
        rate_hz: Frames per second, below `LEAST_HZ` [1/s].
        make: Makes the segmenter, of a width and a rate [1/s].

    Raises:
        InvalidValueError: An argument is out of range.

    Example:
        >>> import numpy as np
        >>> from mplearn.segmentation import KohlmorgenLemm, KohlmorgenLemmConfig
        >>> patient = KohlmorgenLemmConfig(hysteresis_turned=0.3)
        >>> slow = Upsampled(1, 20.0, lambda width, hz: KohlmorgenLemm(width, hz, patient))
        >>> swings = np.sin(np.pi * np.arange(160) / 20.0)[:, None]  # turns each second
        >>> [cut.end for cut in slow.segment(swings)][2:5]
        [50, 70, 90]
    """

    def __init__(
        self, n_channels: int, rate_hz: float, make: Callable[[int, float], Segmenter]
    ) -> None:
        self.n_channels = n_channels
        self.rate_hz = rate_hz
        self._make = make
        make(n_channels, rate_hz)  # it says what is out of range
        self._upsampling = int(np.ceil(LEAST_HZ / rate_hz))
        self._start()

    @property
    def step_hz(self) -> float:
        """How many steps a second the segmenter takes [1/s]."""
        return self.rate_hz * self._factor

    def _start(self) -> None:
        """Return to the state before the first frame."""
        self._factor = self._upsampling
        self._inner = self._make(self.n_channels, self.step_hz)
        self._n_frames = 0
        self._latest = np.zeros((2, self.n_channels))

    def update(self, frame: FloatArray) -> list[Segment]:
        """Take one frame, shape (D,), and return the segments that are closed by now (often none).

        Raises:
            FrameError: The frame has the wrong width, or is not finite; nothing has changed then.
        """
        return self._take(as_frames(frame, (self.n_channels,))[None])[1]

    def advance(self, frames: FloatArray) -> tuple[int, list[Segment]]:
        """Take frames until one closes segments; see `Segmenter.advance`."""
        frames = as_frames(frames, (-1, self.n_channels))
        taken = 0
        while taken < len(frames):
            try:
                n, closed = self._take(frames[taken : taken + _AT_ONCE])
            except FrameError:
                if taken == 0:
                    raise
                break
            taken += n
            if closed:
                return taken, closed
        return taken, []

    def _take(self, frames: FloatArray) -> tuple[int, list[Segment]]:
        """Take frames until one closes segments, or is not finite: how many, and which."""
        first = self._n_frames == 0  # as if it had always been there
        latest = frames[[0, 0]] if first else self._latest
        points = _points(latest, frames, self._factor)
        if not len(points):
            require_finite(frames[0])
        skipped = self._factor - 1 if first else 0
        n, closed = self._inner.advance(points[skipped:])
        taken = -(-(n + skipped) // self._factor)
        n += skipped
        while n < taken * self._factor:  # the rest of what leads to that frame
            more, others = self._inner.advance(points[n : taken * self._factor])
            n, closed = n + more, closed + others
        self._n_frames += taken
        self._latest = np.concatenate([latest, frames[max(0, taken - 2) : taken]])[-2:]
        return taken, [self._told(segment) for segment in closed] if closed else closed

    def _told(self, segment: Segment, end: int | None = None) -> Segment:
        """Return a segment in frames of the stream, now that it is closed."""
        return replace(
            segment,
            start=nearest(segment.start, self._factor),
            end=nearest(segment.end, self._factor) if end is None else end,
            decided_at=self._n_frames - 1,
        )

    def flush(self) -> list[Segment]:
        """Close what is open, as at the end of a stream, and start afresh at frame 0."""
        n_frames = self._n_frames
        closed = [
            self._told(each, n_frames)
            for each in self._inner.flush()
            if nearest(each.start, self._factor) < n_frames
        ]
        self._start()
        return closed

    def scaffold(self, weights: FloatArray | None = None, ending: float = 0.5) -> None:
        """Tell the segmenter what is known about the motion now; see `Segmenter.scaffold`."""
        self._inner.scaffold(weights, ending)

    def state(self) -> SegmenterState:
        """Return the whole state; `load_state` resumes bit for bit."""
        state = self._inner.state()
        arrays = dict(state.arrays)
        if self._factor > 1:
            arrays[_LATEST] = self._latest.copy()
        return replace(state, rate_hz=self.rate_hz, n_frames=self._n_frames, arrays=arrays)

    def load_state(self, state: SegmenterState) -> None:
        """Resume from what `state` returned.

        A stream that began before streams were upsampled goes on without, up to its end.

        Raises:
            StateError: The state is damaged, or belongs to another kind, rate or width of
                segmenter; nothing has changed then.
        """
        state = validated(state)
        require(
            state.rate_hz == self.rate_hz, "rate_hz", f"must be {self.rate_hz}, not {state.rate_hz}"
        )
        arrays = dict(state.arrays)
        latest = arrays.pop(_LATEST, None)
        factor = 1 if latest is None else self._upsampling
        steps = max(0, (state.n_frames - 1) * factor + 1)
        inner = self._make(self.n_channels, self.rate_hz * factor)
        inner.load_state(
            replace(state, rate_hz=self.rate_hz * factor, n_frames=steps, arrays=arrays)
        )
        if latest is None:
            latest = np.zeros((2, self.n_channels))
        check_array(latest, np.zeros((2, self.n_channels)), f"arrays.{_LATEST}")
        self._factor, self._inner, self._n_frames = factor, inner, state.n_frames
        self._latest = latest.copy()


@njit(cache=True)
def _points(latest: FloatArray, frames: FloatArray, factor: int) -> FloatArray:
    """Return frames, each after what lies before it, up to the first that is not finite.

    Args:
        latest: The two frames before them, shape (2, D).
        frames: Shape (T, D).
        factor: How many points a frame becomes, itself the last.

    Returns:
        Shape (T * factor, D), or less.
    """
    points = np.empty((len(frames) * factor, frames.shape[1]))
    before, last = latest[0], latest[1]
    for t in range(len(frames)):
        new = frames[t]
        if not all_finite(new):
            return points[: t * factor]
        for i in range(factor - 1):
            share = (i + 1) / factor
            for j in range(len(new)):
                bend = new[j] - 2.0 * last[j] + before[j]
                ahead = new[j] - before[j] + share * bend
                points[t * factor + i, j] = last[j] + 0.5 * share * ahead
        points[(t + 1) * factor - 1] = new
        before, last = last, new
    return points


def nearest(number: int, factor: int) -> int:
    """Return the whole number nearest to a fraction, the lower of two.

    Example:
        >>> [nearest(number, 4) for number in (5, 6, 7)]
        [1, 1, 2]
    """
    return (2 * number + factor - 1) // (2 * factor)

"""A session as a tree sees it, segmented once for several experiments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...body import view_of
from ...errors import InvalidValueError
from ...recording import FloatArray, LabelledSegment, Recording, Segment
from ...segmentation import make_segmenter
from ..matching import match_segments
from ..observing import observe


@dataclass(frozen=True, eq=False)
class Seen:
    """A session as a tree sees it.

    Attributes:
        frames: What the view shows, shape (T, V).
        segments: What moved, and where nothing did.
        truth: What was performed.
        rate_hz: Frames per second [1/s].

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> session = demonstrate(["BAR", "BAL"] * 3, seed=1, rate_hz=50.0).recording
        >>> seen = Seen.of(session)
        >>> sorted(set(seen.labels) - {""}), len(seen.twice().segments) == 2 * len(seen.segments)
        (['BAL', 'BAR'], True)
    """

    frames: FloatArray
    segments: tuple[Segment, ...]
    truth: tuple[LabelledSegment, ...]
    rate_hz: float

    @classmethod
    def of(cls, recording: Recording, truth: Sequence[LabelledSegment] | None = None) -> Seen:
        """Observe and segment a session; its own labels are the truth where none is given.

        Raises:
            InvalidValueError: Fewer than four segments are found: they cannot be halved.
        """
        features = observe(recording)
        frames = view_of(features.channels).see(features.frames)
        segmenter = make_segmenter("kohlmorgen-lemm", frames.shape[1], recording.rate_hz)
        truth = recording.labels if truth is None else truth
        segments = tuple(segmenter.segment(frames))
        if len(segments) < 4:
            raise InvalidValueError(
                f"session {recording.name!r} has {len(segments)} segments; 4 are needed"
            )
        return cls(frames, segments, tuple(truth), recording.rate_hz)

    @property
    def labels(self) -> tuple[str, ...]:
        """Class that each segment shows; empty for none."""
        return match_segments(self.truth, self.segments, self.rate_hz).labels

    def part(self, first: int, last: int) -> Seen:
        """Return the segments from one on up to before another, and their part of the truth."""
        chosen = self.segments[first:last]
        start, end = chosen[0].start, chosen[-1].end
        truth = tuple(t for t in self.truth if start <= (t.start + t.end) // 2 < end)
        return replace(self, segments=chosen, truth=truth)

    def twice(self) -> Seen:
        """Return the session and the same again, as one."""
        n = len(self.frames)
        again = (
            replace(s, start=s.start + n, end=s.end + n, decided_at=s.decided_at + n)
            for s in self.segments
        )
        truth = (replace(t, start=t.start + n, end=t.end + n) for t in self.truth)
        return replace(
            self,
            frames=np.concatenate([self.frames, self.frames]),
            segments=(*self.segments, *again),
            truth=(*self.truth, *truth),
        )

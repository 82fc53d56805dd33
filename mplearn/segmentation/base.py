"""What every segmenter is: it takes one frame at a time and returns the segments just closed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from ..recording import FloatArray, Segment


class Segmenter(ABC):
    """Cuts a stream of frames into segments, on-line.

    Every frame belongs to exactly one segment: segments follow each other without gap or overlap,
    starting at frame 0. Pauses are segments with ``still=True``.
    """

    @abstractmethod
    def update(self, frame: FloatArray) -> list[Segment]:
        """Take one frame, shape (D,), and return the segments that are closed by now (often none).

        Raises:
            FrameError: The frame has the wrong width, or is not finite; nothing has changed then.
        """

    @abstractmethod
    def flush(self) -> list[Segment]:
        """Close what is open, as at the end of a stream, and start afresh at frame 0."""

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """Return the whole state as plain values and arrays; `load_state` resumes bit for bit."""

    @abstractmethod
    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned.

        Raises:
            InvalidValueError: The state belongs to another kind or width of segmenter.
        """

    def segment(self, frames: FloatArray) -> list[Segment]:
        """Segment a whole recording, shape (T, D), as the on-line loop does, and flush."""
        closed: list[Segment] = []
        for frame in frames:
            closed.extend(self.update(frame))
        closed.extend(self.flush())
        return closed


def frames_of(seconds: float, rate_hz: float) -> int:
    """Return a duration [s] as a number of frames, at least one."""
    return max(1, round(seconds * rate_hz))

"""What every segmenter is: it takes one frame at a time and returns the segments just closed."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any

from ..errors import InvalidValueError
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

    @abstractmethod
    def scaffold(self, weights: FloatArray | None = None, ending: float = 0.5) -> None:
        """Tell the segmenter what is known about the motion now; it holds until told otherwise.

        Known primitives modify the distance, by the joints that are active in them, and the cost
        of a boundary ([Kulic2012], end of 2.1).

        Args:
            weights: How much each channel counts, shape (D,), at least 0; only ratios matter. All
                alike by default.
            ending: Probability that the motion is in its last phase; 0.5 where nothing is known.

        Raises:
            InvalidValueError: An argument is out of range.
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


def check_positive(config: object, *names: str) -> None:
    """Raise an InvalidValueError where a setting is not positive and finite."""
    for name in names:
        value = getattr(config, name)
        if not (math.isfinite(value) and value > 0):
            raise InvalidValueError(f"{name} must be positive, not {value}")


def check_share(config: object, *names: str) -> None:
    """Raise an InvalidValueError where a setting does not lie strictly between 0 and 1."""
    for name in names:
        value = getattr(config, name)
        if not 0 < value < 1:
            raise InvalidValueError(f"{name} must lie in (0, 1), not {value}")

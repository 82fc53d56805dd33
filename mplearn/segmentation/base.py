"""What every segmenter is: it takes one frame at a time and returns the segments just closed."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FrameError, InvalidValueError
from ..recording import FloatArray, Segment
from ..state import LARGEST, Count, State, require

AT_ONCE = 256  # frames of a recording that are handed on together


@dataclass(frozen=True, eq=False)
class SegmenterState(State):
    """What a segmenter remembers.

    Attributes:
        segmenter: Name of its class.
        rate_hz: Frames per second [1/s].
        n_frames: Frames since the start of the stream.
        arrays: Its arrays by name; each field of a record is one, as ``record.field``.

    Example:
        >>> from mplearn.segmentation import make_segmenter
        >>> half = make_segmenter("zero-velocity", 1, 100.0)
        >>> cuts = [half.update([0.01 * k]) for k in range(50)]
        >>> later = make_segmenter("zero-velocity", 1, 100.0)
        >>> later.load_state(half.state())  # goes on in the same segment
        >>> half.state().n_frames, later.state() == half.state()
        (50, True)
    """

    segmenter: str
    rate_hz: float
    n_frames: Count
    arrays: dict[str, NDArray[Any]]


class Segmenter(ABC):
    """Cuts a stream of frames into segments, on-line.

    Every frame belongs to exactly one segment: segments follow each other without gap or overlap,
    starting at frame 0. Pauses are segments with ``still=True``.

    Example:
        >>> import numpy as np
        >>> from mplearn.segmentation import make_segmenter
        >>> t = np.arange(600) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)
        >>> segmenter = make_segmenter("zero-velocity", 1, 100.0)
        >>> segments = segmenter.segment(swing[:, None])
        >>> [(s.start, s.end, s.still) for s in segments[:3]]  # up, down, a rest
        [(0, 50, False), (50, 100, False), (100, 201, True)]
    """

    @abstractmethod
    def update(self, frame: FloatArray) -> list[Segment]:
        """Take one frame, shape (D,), and return the segments that are closed by now (often none).

        Raises:
            FrameError: The frame has the wrong width, or is not finite; nothing has changed then.
        """

    def advance(self, frames: FloatArray) -> tuple[int, list[Segment]]:
        """Take frames, shape (T, D), until one closes segments: as `update` in a loop.

        Returns:
            How many frames were taken, at least one, and the segments that the last of them closed.

        Raises:
            FrameError: The first frame has the wrong width, or is not finite; nothing has changed
                then. Where a later one is, those before it are taken.

        Example:
            >>> import numpy as np
            >>> from mplearn.segmentation import make_segmenter
            >>> lifts = np.sin(np.pi * np.arange(400) / 100.0)[:, None]  # turns each second
            >>> segmenter = make_segmenter("zero-velocity", 1, 100.0)
            >>> taken, cuts = segmenter.advance(lifts)
            >>> taken < 100, cuts[0].decided_at == taken - 1
            (True, True)
        """
        for taken, frame in enumerate(frames):
            try:
                closed = self.update(frame)
            except FrameError:
                if taken == 0:
                    raise
                return taken, []
            if closed:
                return taken + 1, closed
        return len(frames), []

    @abstractmethod
    def flush(self) -> list[Segment]:
        """Close what is open, as at the end of a stream, and start afresh at frame 0."""

    @abstractmethod
    def state(self) -> SegmenterState:
        """Return the whole state; `load_state` resumes bit for bit."""

    @abstractmethod
    def load_state(self, state: SegmenterState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: The state is damaged, or belongs to another kind, rate or width of
                segmenter; nothing has changed then.
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

        Example:
            >>> import numpy as np
            >>> from mplearn.segmentation import make_segmenter
            >>> segmenter = make_segmenter("zero-velocity", 1, 100.0)
            >>> for frame in np.linspace(0.0, 1.0, 80)[:, None]:
            ...     cuts = segmenter.update(frame)
            >>> segmenter.scaffold(ending=0.05)  # a known motion is under way, and far from its end
        """

    def segment(self, frames: FloatArray) -> list[Segment]:
        """Segment a whole recording, shape (T, D), as the on-line loop does, and flush.

        Example:
            >>> import numpy as np
            >>> from mplearn.segmentation import make_segmenter
            >>> lifts = np.sin(np.pi * np.arange(400) / 100.0)[:, None]  # turns each second
            >>> cuts = make_segmenter("zero-velocity", 1, 100.0).segment(lifts)
            >>> cuts[0].start, cuts[-1].end
            (0, 400)
        """
        closed: list[Segment] = []
        taken = 0
        while taken < len(frames):
            n, segments = self.advance(frames[taken : taken + AT_ONCE])
            closed.extend(segments)
            taken += n
        closed.extend(self.flush())
        return closed


def as_frames(given: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Return numbers of a shape, (D,) a frame or (-1, D) any frames.

    Raises:
        FrameError: They have another shape, or are no numbers.

    Example:
        >>> as_frames([1, 2], (3,))
        Traceback (most recent call last):
        mplearn.errors.FrameError: a frame must have shape (3,), not (2,)
    """
    width = shape[-1]
    try:
        frames = np.ascontiguousarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise FrameError(f"a frame must be {width} numbers: {error}") from None
    if frames.ndim == len(shape) and frames.shape[-1] == width:
        return frames
    if len(shape) == 1:
        raise FrameError(f"a frame must have shape ({width},), not {frames.shape}")
    raise FrameError(f"frames must have shape (T, {width}), not {frames.shape}")


def require_finite(frame: FloatArray) -> None:
    """Check a frame, shape (D,).

    Raises:
        FrameError: Channels are not finite.

    Example:
        >>> import numpy as np
        >>> require_finite(np.array([0.0, np.nan]))
        Traceback (most recent call last):
        mplearn.errors.FrameError: 1 of 2 channels are not finite (the first is channel 1: nan); ...
    """
    bad = np.flatnonzero(~np.isfinite(frame))
    if len(bad):
        raise FrameError(
            f"{len(bad)} of {len(frame)} channels are not finite (the first is channel "
            f"{bad[0]}: {frame[bad[0]]}); fill gaps before segmenting"
        )


def check_array(value: Any, own: Any, place: str) -> None:
    """Check that a stored array is like one's own.

    Raises:
        StateError: It has another shape or type, or numbers out of range.

    Example:
        >>> import numpy as np
        >>> check_array(np.zeros(2), np.zeros(3), "place")
        Traceback (most recent call last):
        mplearn.errors.StateError: place: must have shape (3,) of float64, not (2,) of float64
    """
    require(
        value.dtype == own.dtype and value.shape == own.shape,
        place,
        f"must have shape {own.shape} of {own.dtype}, not {value.shape} of {value.dtype}",
    )
    least = -1 if own.dtype.kind == "i" else -LARGEST
    fine = bool(((value >= least) & (value <= LARGEST)).all())  # NaN fails too
    require(fine, place, f"must hold numbers in [{least:g}, {LARGEST:g}]")


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

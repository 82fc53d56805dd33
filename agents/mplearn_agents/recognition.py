"""What a library recognises in recordings: their segments, each with its primitive and p-value."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from mplearn.errors import RecordingError
from mplearn.learner import Event, LearnerConfig, MotionLearner
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray, Recording, Segment

_AT_ONCE = 50  # frames between two looks at how far it is


class RecognisedSegment(NamedTuple):
    """A segment of a recording, and what a library says of it.

    Attributes:
        take: Name of the recording.
        start_s: When it begins [s].
        end_s: When it ends [s].
        primitive: Id of the primitive that it is an execution of; None where none is like it.
        name: The primitive's name; "" where there is none.
        nearest: Name of the nearest primitive, recognised or not; "" where there is none.
        distance: To the nearest primitive [nats a frame]; NaN where there is none.
        p_value: Share of what was learned that is at least as far out, in (0, 1]; NaN as above.
    """

    take: str
    start_s: float
    end_s: float
    primitive: int | None
    name: str
    nearest: str
    distance: float
    p_value: float

    def as_dict(self) -> dict[str, Any]:
        """Return it as values that JSON has; NaN is None."""
        return {
            key: None if isinstance(value, float) and math.isnan(value) else value
            for key, value in self._asdict().items()
        }


class Recognising(MotionLearner):
    """A learner that learns nothing, and looks at each segment with a library.

    Args:
        library: What is known.
        channels: Of the recordings.
    """

    def __init__(self, library: PrimitiveLibrary, channels: tuple[str, ...]) -> None:
        observe = "robot" if library.body else "markers"
        super().__init__(LearnerConfig(channels, library.rate_hz, observe=observe))  # type: ignore[arg-type]
        self.pause()
        self.library = library
        self._seen: list[tuple[Segment, FloatArray]] = []

    def _look(self, segment: Segment, frames: FloatArray) -> list[Event]:
        self._seen.append((segment, self._view.read(frames)))
        return []

    def judged(self, recording: Recording) -> Iterator[RecognisedSegment]:
        """Yield what the library says of the segments closed since the last call."""
        library, rate_hz = self.library, recording.rate_hz
        for segment, features in self._seen:
            found = library.recognise(features)
            nearest, distance, p_value = "", np.nan, np.nan
            if found.alternatives:
                nearest = _name(library, found.alternatives[0].node)
                distance, p_value = found.distance, library.score_motion(features).p_value
            yield RecognisedSegment(
                recording.name,
                segment.start / rate_hz,
                segment.end / rate_hz,
                found.primitive,
                "" if found.primitive is None else _name(library, found.primitive),
                nearest,
                float(distance),
                float(p_value),
            )
        self._seen.clear()


def recognise_recording(
    library: PrimitiveLibrary,
    recording: Recording,
    progress: Callable[[int], object] = lambda frames: None,
) -> Iterator[RecognisedSegment]:
    """Yield the moving segments of a recording, as they are closed.

    Args:
        library: What is known.
        recording: At the library's rate: a body's points for a library with a body, else all the
            library's channels.
        progress: Called with a number of frames that have been looked at since the last call.

    Raises:
        RecordingError: The recording lacks channels of the library.
    """
    reader = Recognising(library, recording.channels)
    if not library.body and recording.channels != library.channels:
        raise RecordingError(f"{recording.name} has not the channels of the library")
    looked = 0
    for k, _ in enumerate(reader.learn_recording(recording), start=1):
        if k % _AT_ONCE == 0:
            progress(_AT_ONCE)
            looked += _AT_ONCE
        yield from reader.judged(recording)
    progress(max(0, len(recording.frames) - looked))
    yield from reader.judged(recording)


def _name(library: PrimitiveLibrary, id: int) -> str:
    return library[id].name if id in library else str(id)


def as_csv(segments: Iterable[RecognisedSegment]) -> str:
    """Return segments as a table with commas and a head."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(RecognisedSegment._fields)
    for segment in segments:
        writer.writerow("" if value is None else value for value in segment.as_dict().values())
    return out.getvalue()

"""What a library recognises in recordings: their segments, each with its primitive and p-value."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..anatomy import recognise
from ..errors import RecordingError
from ..learner import Event, LearnerConfig, MotionLearner
from ..library import PrimitiveLibrary, RecognisedSegment, SegmentTable
from ..mocap import resample, with_channels
from ..recording import FloatArray, Recording, Segment

_AT_ONCE = 50  # frames taken at once


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
                distance, p_value = found.distance, library.score_recognised(found).p_value
            yield RecognisedSegment(
                recording.name,
                segment.start / rate_hz,
                segment.end / rate_hz,
                found.primitive,
                "" if found.primitive is None else _name(library, found.primitive),
                nearest,
                float(distance),
                float(p_value),
                recording.person,
                float(segment.confidence),
            )
        self._seen.clear()


def segments_of(library: PrimitiveLibrary, recording: Recording) -> SegmentTable:
    """Return the segments of a recording of any rate; see `PrimitiveLibrary.segments`.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner, Recording
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> take = Recording(swing, 100.0, ("elbow",), name="swings")
        >>> learner = MotionLearner(LearnerConfig(take.channels, segmenter="zero-velocity"))
        >>> events = list(learner.learn_recording(take))
        >>> segments_of(learner.snapshot(), take).column("name")[:4]
        ['P1', 'P2', 'P1', 'P2']
    """
    return SegmentTable(recognise_recording(library, seen_by(library, recording)))


def seen_by(library: PrimitiveLibrary, recording: Recording) -> Recording:
    """Return a recording as a library sees it: a body's points, or its own channels, at its rate.

    Raises:
        RecordingError: It lacks channels of the library.
        BodyError: There is no body in it.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner, Recording
        >>> library = MotionLearner(LearnerConfig(("elbow",), rate_hz=50.0)).snapshot()
        >>> take = Recording(np.zeros((200, 2)), 100.0, ("elbow", "lamp"))
        >>> seen = seen_by(library, take)
        >>> seen.channels, seen.rate_hz
        (('elbow',), 50.0)
    """
    if recording.channels != library.channels:
        if library.body and recording.is_markers:
            recording = recognise(recording).apply(recording)
        else:
            recording = with_channels(recording, library.channels)
    same = recording.rate_hz == library.rate_hz
    return recording if same else resample(recording, library.rate_hz)


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

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner, Recording
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> take = Recording(swing, 100.0, ("elbow",), name="swings")
        >>> learner = MotionLearner(LearnerConfig(take.channels, segmenter="zero-velocity"))
        >>> events = list(learner.learn_recording(take))
        >>> segment = next(recognise_recording(learner.snapshot(), take))
        >>> segment.take, segment.start_s, segment.name
        ('swings', 0.0, 'P1')
    """
    reader = Recognising(library, recording.channels)
    if not library.body and recording.channels != library.channels:
        raise RecordingError(f"{recording.name} has not the channels of the library")
    left = len(recording.frames)
    for _ in reader.learn_recording(recording, _AT_ONCE):
        looked = min(left, _AT_ONCE)
        left -= looked
        progress(looked)
        yield from reader.judged(recording)


def _name(library: PrimitiveLibrary, id: int) -> str:
    return library[id].name if id in library else str(id)

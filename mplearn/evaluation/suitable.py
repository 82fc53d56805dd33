"""What the labels of some recordings are, and which of the recordings can be evaluated together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Literal, TypeAlias

import numpy as np

from ..errors import RecordingError
from ..mocap import resample
from ..recording import Recording

LabelKind: TypeAlias = Literal["repetitions", "primitives", "activities", "contents"]
SHOWN = 4  # times that a class comes in a recording whose labels are primitives, in the median
_SHORTEST = 10  # frames of a repetition
_SAME_RATE = 1e-3  # share by which clocks may differ


def kind_of_labels(recordings: Iterable[Recording]) -> LabelKind:
    """Return what the labels of recordings are.

    Repetitions of one movement a recording, if those of most are; else primitives in a session, if
    classes come again and again in a recording; else activities, coarser than primitives.

    Raises:
        RecordingError: No recording has labels.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> again = tuple(LabelledSegment(100 * k, 100 * k + 100, "squat") for k in range(4))
        >>> take = Recording(np.zeros((400, 1)), 100.0, ("knee",), labels=again)
        >>> kind_of_labels([take])
        'repetitions'
    """
    counts = [Counter(label.label for label in each.labels) for each in recordings if each.labels]
    if not counts:
        raise RecordingError("no recording has labels")
    repeated = sum(len(each) == 1 and each.total() > 1 for each in counts)
    if 2 * repeated > len(counts):
        return "repetitions"
    usual = float(np.median([number for each in counts for number in each.values()]))
    return "primitives" if usual >= SHOWN else "activities"


def repeating(recordings: Iterable[Recording]) -> tuple[Recording, ...]:
    """Return the recordings that hold at least two labelled repetitions of one movement.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> frames = np.zeros((200, 1))
        >>> twice = (LabelledSegment(0, 100, "squat"), LabelledSegment(100, 200, "squat"))
        >>> takes = [Recording(frames, 50.0, ("x",), name="squats", labels=twice)]
        >>> takes.append(Recording(frames, 50.0, ("x",), name="walk"))
        >>> [take.name for take in repeating(takes)]
        ['squats']
    """
    return tuple(
        each
        for each in recordings
        if len(each.labels) > 1
        and len({label.label for label in each.labels}) == 1
        and min(label.end - label.start for label in each.labels) >= _SHORTEST
    )


def lost_throughout(recording: Recording) -> str:
    """Return the name of a channel of which a recording holds no measurement; empty where none.

    Example:
        >>> import numpy as np
        >>> from mplearn import Recording
        >>> frames = np.stack((np.zeros(50), np.full(50, np.nan)), axis=1)
        >>> lost_throughout(Recording(frames, 50.0, ("hip", "knee")))
        'knee'
    """
    lost = np.isnan(recording.frames).all(axis=0)
    return recording.channels[int(lost.argmax())] if lost.any() else ""


def alike(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Return the recordings of the channels that most have, all at the lowest of their rates.

    Example:
        >>> import numpy as np
        >>> from mplearn import Recording
        >>> quick = Recording(np.zeros((100, 2)), 100.0, ("x", "y"))
        >>> slow = Recording(np.zeros((50, 2)), 50.0, ("x", "y"))
        >>> [take.rate_hz for take in alike([quick, slow])]
        [50.0, 50.0]
    """
    if not recordings:
        return ()
    channels, _ = Counter(each.channels for each in recordings).most_common(1)[0]
    chosen = [each for each in recordings if each.channels == channels]
    lowest = min(each.rate_hz for each in chosen)
    return tuple(_at(each, lowest) for each in chosen)


def _at(recording: Recording, rate_hz: float) -> Recording:
    if recording.rate_hz < (1 + _SAME_RATE) * rate_hz:
        return replace(recording, rate_hz=rate_hz)
    return resample(recording, rate_hz)

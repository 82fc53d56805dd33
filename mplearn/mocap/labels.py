"""Labels that lie in a file beside a recording.

* ``13_29.txt`` beside ``13_29.amc``: a class number for each tenth of a second; CMU's subject 13
  does the exercises 1 to 12, elsewhere the label is the number itself.
* ``labels_parsed.json``: ``{"86_01": [{"label": "walk", "end_nominal": 550}, ...], ...}``: segments
  that follow each other from frame 0 on, each up to its nominal end in frames of the file.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ..recording import LabelledSegment, Recording
from .files import bad_file, cmu_subject, is_file, read_text, stem

# fmt: off
CMU13_EXERCISES = (
    "JumpJack", "Jog", "Squat", "KneeRaise", "ArmCircle", "Twist",
    "SideReach", "Box", "UpDown", "ToeTouchOneHand", "SideBend", "ToeTouchTwoHands",
)
# fmt: on
"""The exercises of CMU's subject 13, number 1 first."""

_STEP_S = 0.1


def labels_beside(path: Path, recording: Recording) -> tuple[LabelledSegment, ...]:
    """Return what lies beside a recording's file about its segments; empty where nothing does.

    Args:
        path: The recording's file.
        recording: What it holds, at its own rate.

    Raises:
        RecordingError: The labels are damaged, or reach beyond the recording.
    """
    track = path.parent / f"{stem(path)}.txt"
    if cmu_subject(stem(path)) and track != path and is_file(track):
        return _class_track(track, recording)
    table = path.parent / "labels_parsed.json"
    if is_file(table):
        return _table(table, recording)
    return ()


def _class_track(path: Path, recording: Recording) -> tuple[LabelledSegment, ...]:
    words = read_text(path).split()
    if not all(word.isdecimal() for word in words):
        raise bad_file(path, "words that are no class numbers", "a class number each 0.1 s")
    if abs(len(words) * _STEP_S - recording.duration_s) > 2 * _STEP_S:
        raise bad_file(
            path,
            f"{len(words)} labels of {_STEP_S} s for {recording.duration_s:.1f} s",
            "one for each 0.1 s of the recording",
        )
    classes = np.array([int(word[:9]) for word in words])
    cuts = [0, *(np.flatnonzero(np.diff(classes)) + 1).tolist(), len(classes)]
    frames = np.rint(np.array(cuts) * _STEP_S * recording.rate_hz).astype(int)
    frames = np.minimum(frames, len(recording))
    frames[-1] = len(recording)
    known = CMU13_EXERCISES if recording.person == "13" else ()
    return tuple(
        LabelledSegment(
            int(start),
            int(end),
            known[number - 1] if 1 <= number <= len(known) else str(number),
            recording.person,
        )
        for start, end, number in zip(frames, frames[1:], classes[cuts[:-1]].tolist(), strict=False)
        if end > start
    )


def _table(path: Path, recording: Recording) -> tuple[LabelledSegment, ...]:
    expected = '{"NAME": [{"label": "walk", "end_nominal": 550}, ...], ...}'
    try:
        table = json.loads(read_text(path))
        entries = [(str(e["label"]), int(e["end_nominal"])) for e in table.get(recording.name, [])]
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise bad_file(path, f"not a table of labels ({error!r})", expected) from error
    ends = [0, *(end for _, end in entries)]
    if any(np.diff(ends) <= 0) or ends[-1] > len(recording):
        raise bad_file(
            path,
            f"ends {ends[1:]} of {recording.name!r}",
            f"increasing frames up to its last, {len(recording)}",
        )
    return tuple(
        LabelledSegment(start, end, label, recording.person)
        for start, (label, end) in zip(ends, entries, strict=False)
    )

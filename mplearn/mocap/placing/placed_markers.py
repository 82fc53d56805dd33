"""A recording of markers, once they are where the person was."""

from __future__ import annotations

from pathlib import Path

from ...recording import FloatArray, LabelledSegment, Recording, marker_channels
from ..files import stem
from ..findings import Findings
from ..reader import Hints
from .space import Space, placed


def placed_markers(
    path: Path,
    points: FloatArray,
    names: tuple[str, ...],
    rate_hz: float,
    space: Space,
    hints: Hints,
    findings: Findings,
    *,
    person: str = "",
    labels: tuple[LabelledSegment, ...] = (),
) -> Recording:
    """Return a file's points as a recording of markers, `placed`, with what was found as a report.

    Args:
        path: The file, whose stem names the recording.
        points: In the file's unit and axes, shape (T, M, 3); NaN where missing.
        names: Names of the points, length M.
        rate_hz: Frames per second [1/s].
        space: What the file or its format says.
        hints: What the caller says.
        findings: What was found so far, and what is found here.
        person: Who moves, where the file says so.
        labels: Its segments, where the file has them.

    Raises:
        RecordingError: No person can be meant by the points.
    """
    at = placed(path, points, names, rate_hz, space, hints, findings)
    return Recording(
        at.points.reshape(len(points), -1),
        rate_hz,
        marker_channels(names),
        stem(path),
        person,
        labels,
        report=findings.report(rate_hz, at.unit_m, at.up),
    )

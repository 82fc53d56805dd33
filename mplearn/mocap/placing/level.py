"""Whether people lean because the camera that saw them was tilted, and how to set them upright.

Who stands straight, with legs and trunk in one line, stands along gravity. How such frames lean,
always to the same side of the room, is how far the file's vertical is off.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...option_names import option
from ...recording import FloatArray, Recording
from ..files import bad_file
from .part_names import place_of

_LOOK = 400  # frames
_PARTS = (("head", "shoulder"), ("pelvis", "thigh"), ("knee",), ("ankle", "heel", "toe"))
_STRAIGHT = 0.95  # of the way by hips and knees that is the way from the feet to the head
_FEWEST = 0.1  # of the frames, in which somebody stands straight
_SHORTEST_S = 0.5  # in all
_FARTHEST_M = 1000.0
_TELLING_DEG, _FARTHEST_DEG = (15.0, 50.0)  # leaning less people do; who leans more lies
_STEADY_DEG = 6.0  # by which half of the frames may differ


def lean_of(recording: Recording) -> FloatArray | None:
    """Return where somebody who stands straight points, shape (3,); None where nobody does.

    Args:
        recording: Markers or joints [m], z up; their names say where they are on a body.
    """
    if not recording.is_markers:
        return None
    places = [place_of(name).part for name in recording.marker_names]
    some = recording.markers[:: -(-len(recording) // _LOOK)]
    seen = np.abs(some) < _FARTHEST_M  # which NaN is not
    levels = []
    for part in _PARTS:
        kind = next((each for each in part if each in places), None)
        if kind is None:
            return None
        of_part = [k for k, place in enumerate(places) if place == kind]
        known = seen[:, of_part].sum(axis=1)
        total = np.where(seen[:, of_part], some[:, of_part], 0.0).sum(axis=1)
        levels.append(np.where(known > 0, total / np.maximum(known, 1), np.nan))
    top, hips, knees, feet = levels
    ways = (top - feet, top - hips, hips - knees, knees - feet)
    whole, *parts = (np.linalg.norm(way, axis=1) for way in ways)
    straight = np.flatnonzero(whole > _STRAIGHT * np.sum(parts, axis=0))
    lasts_s = len(straight) / len(some) * len(recording) / recording.rate_hz
    if len(straight) < _FEWEST * len(some) or lasts_s < _SHORTEST_S:
        return None
    up = (top - feet)[straight] / whole[straight, None]
    middle = np.median(up, axis=0)
    middle = middle / np.linalg.norm(middle)
    off_deg = np.degrees(np.arccos(np.clip(up @ middle, -1.0, 1.0)))
    return middle if np.median(off_deg) < _STEADY_DEG else None


def lean_deg(up: FloatArray) -> float:
    """Return by how much a direction, shape (3,), leans [deg]."""
    return float(np.degrees(np.arccos(np.clip(up[2], -1.0, 1.0))))


def told_of_lean(recording: Recording) -> Recording:
    """Return a recording whose report warns where somebody who stands straight leans."""
    up = lean_of(recording)
    if up is None or recording.report is None:
        return recording
    if not _TELLING_DEG < lean_deg(up) < _FARTHEST_DEG:
        return recording
    warning = (
        f"who stands straight leans by {lean_deg(up):.0f} deg, always to the same side: if the "
        f"camera was tilted, {option('level')} sets people upright"
    )
    report = replace(recording.report, warnings=(*recording.report.warnings, warning))
    return replace(recording, report=report)


def turn_to_level(path: Path, recording: Recording) -> FloatArray:
    """Return the smallest turn that sets who stands straight upright, shape (3, 3).

    Args:
        path: Where the points come from, for messages.
        recording: Markers or joints [m], z up but for the tilt.

    Raises:
        RecordingError: Nobody is seen to stand straight.
    """
    up = lean_of(recording)
    if up is None or up[2] <= 0.0:
        raise bad_file(
            path,
            "nobody is seen to stand straight, by names of head, hips, knees and feet",
            "somebody who does, by whom the vertical can be told",
        )
    axis = np.array([up[1], -up[0], 0.0])  # up x z
    cross = np.array([[0.0, 0.0, axis[1]], [0.0, 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    turn: FloatArray = np.eye(3) + cross + cross @ cross / (1.0 + up[2])
    return turn


def leveled(recording: Recording, turn: FloatArray) -> Recording:
    """Return points turned as `turn_to_level` says; it is noted.

    Args:
        recording: Markers or joints [m].
        turn: Shape (3, 3).
    """
    skeleton, report = recording.skeleton, recording.report
    if report is not None:
        note = f"turned by {lean_deg(turn[2]):.1f} deg, so that who stands straight is upright"
        report = replace(report, notes=(*report.notes, note))
    if skeleton is not None:
        skeleton = replace(skeleton, offsets=skeleton.offsets @ turn.T)
    frames = (recording.markers @ turn.T).reshape(len(recording), -1)
    return replace(recording, frames=frames, skeleton=skeleton, report=report)

"""Poses of a person's segments, as Theia writes them to C3D files: a skeleton without markers.

A segment's origin is its joint towards the trunk, the trunk's is between the shoulders; its axes
are right, ahead and up of who stands with hanging arms [Theia].
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...option_names import option
from ...recording import FloatArray, Recording, Skeleton, marker_channels
from ..files import bad_file, head, read_bytes, stem
from ..findings import Findings
from ..markers.c3d import space_of
from ..markers.c3d_file import parse_c3d
from ..placing.space import Space, placed
from ..reader import Hints, Reader
from .kinematics import AXIS_M, AXIS_MARK
from .stature import unit_of_skeleton

PARENTS = {
    "pelvis": "",
    "torso": "pelvis",
    "head": "torso",
    **{f"{side}_uarm": "torso" for side in "lr"},
    **{f"{side}_larm": f"{side}_uarm" for side in "lr"},
    **{f"{side}_hand": f"{side}_larm" for side in "lr"},
    **{f"{side}_thigh": "pelvis" for side in "lr"},
    **{f"{side}_shank": f"{side}_thigh" for side in "lr"},
    **{f"{side}_foot": f"{side}_shank" for side in "lr"},
    **{f"{side}_toes": f"{side}_foot" for side in "lr"},
}
"""Segments, and what each hangs on, parents first."""

_ENDING = "_4x4"


class TheiaReader(Reader):
    """Reads C3D files without points: see the module's docstring."""

    format = "Theia"
    suffixes = (".c3d",)

    def accepts(self, path: Path) -> bool:
        """Whether its header says that there are no points."""
        start = head(path, 4)
        return len(start) == 4 and start[1] == 0x50 and start[2:] == b"\0\0"

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read where joints are; see `Reader.read`.

        Raises:
            RecordingError: There are no poses, or not those of a person.
        """
        findings = Findings(self.format)
        content = parse_c3d(path, read_bytes(path))
        if content.poses is None:
            raise bad_file(path, "it holds points", "poses of segments alone")
        if content.said_frames is not None:
            findings.warn(
                f"the header tells of {content.said_frames} frames, {len(content.points)} are there"
            )
        rate_hz = hints.rate_hz or content.rate_hz
        if not 0 < rate_hz < np.inf:
            raise bad_file(path, "no rate", f"ROTATION:RATE, or {option('rate_hz')}")
        labels = content.texts("ROTATION", "LABELS")
        space = space_of(path, hints, content)
        return _recording(path, content.poses, labels, rate_hz, space, hints, findings)


def _recording(
    path: Path,
    poses: FloatArray,
    labels: list[str],
    rate_hz: float,
    space: Space,
    hints: Hints,
    findings: Findings,
) -> Recording:
    """Return the recording of the joints of a person whose segments lie so.

    Args:
        path: The file.
        poses: Shape (T, S, 4, 4) [the file's unit]; NaN where not seen.
        labels: Name of each segment, ``l_thigh_4X4``, length S.
        rate_hz: Frames per second [1/s].
        space: What the file says of its unit and axes.
        hints: What the caller says.
        findings: What came to light so far; more is added.

    Raises:
        RecordingError: There is no pelvis, or nothing else.
    """
    at = {_plain(label): k for k, label in enumerate(labels[: poses.shape[1]])}
    seen = np.asarray(~np.isnan(poses).any(axis=(2, 3)).all(axis=0))
    names = [name for name in PARENTS if name in at and seen[at[name]]]
    if "pelvis" not in names or len(names) < 2:
        raise bad_file(
            path,
            f"no points, and poses of {', '.join(labels[:8]) or 'nothing'}",
            "markers, or poses of pelvis_4X4, l_thigh_4X4, ... as Theia writes them",
        )
    findings.note(f"poses of {len(names)} segments: their origins are the joints")
    findings.leave_out(label for label in labels if _plain(label) not in names)
    segments = poses[:, [at[name] for name in names]]
    places, turns = segments[..., :3, 3], segments[..., :3, :3]
    parents = [_above(name, names) for name in names]
    offsets = _offsets(places, turns, parents)
    sized = unit_of_skeleton(places, parents, space.unit_m, says_so=space.says_unit)
    placing = placed(path, places, tuple(names), rate_hz, space, hints, findings, sized)
    points, rest = placing.points, offsets * placing.unit_m @ placing.axes.T
    all_names, ends = list(names), [False] * len(names)
    if hints.joint_axes:
        along = AXIS_M * (placing.axes @ turns)  # (T, S, 3, 3), a column an axis
        shown = points[:, :, None] + along.swapaxes(-1, -2)
        points = np.concatenate([points, shown.reshape(len(points), -1, 3)], axis=1)
        all_names += [f"{name}{AXIS_MARK}{axis}" for name in names for axis in "xyz"]
        rest = np.concatenate([rest, np.tile(AXIS_M * placing.axes.T, (len(names), 1))])
        parents = parents + [k for k in range(len(names)) for _ in "xyz"]
        ends = ends + [True] * (3 * len(names))
    return Recording(
        points.reshape(len(points), -1),
        rate_hz,
        marker_channels(tuple(all_names)),
        stem(path),
        skeleton=Skeleton(tuple(all_names), tuple(parents), rest, tuple(ends)),
        report=findings.report(rate_hz, placing.unit_m, placing.up),
    )


def _plain(label: str) -> str:
    return label.strip().lower().removesuffix(_ENDING)


def _above(name: str, names: list[str]) -> int:
    """Return the index of what a segment hangs on, of those that there are; -1 for the pelvis."""
    parent = PARENTS[name]
    while parent and parent not in names:
        parent = PARENTS[parent]
    return names.index(parent) if parent else -1


def _offsets(places: FloatArray, turns: FloatArray, parents: list[int]) -> FloatArray:
    """Return where each origin is in its parent's axes, shape (S, 3), at the median."""
    offsets = np.zeros((len(parents), 3))
    for k, parent in enumerate(parents):
        if parent >= 0:
            apart = places[:, k] - places[:, parent]
            own = (turns[:, parent].swapaxes(-1, -2) @ apart[..., None])[..., 0]
            seen = ~np.isnan(own).any(axis=1)
            if seen.any():
                offsets[k] = np.median(own[seen], axis=0)
    return offsets

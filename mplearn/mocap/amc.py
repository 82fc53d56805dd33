"""AMC: joint angles of an ASF skeleton, as in the CMU motion capture database [CMU]."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..recording import FloatArray, Recording
from .asf import ASFSkeleton, read_asf
from .cmu_humanoid import CMU_COLUMNS, CMU_UNIT_M, cmu_humanoid_positions
from .files import bad_file, cmu_subject, read_text, stem
from .kinematics import joint_positions, with_axes
from .numbers import numbers
from .reader import Hints, Reader
from .skeletal import Column, angle_recording, position_recording
from .space import check_skeleton, file_axes

_RATE_HZ = 120.0  # the format has no place for it; this is the database's
_EXPECTED = "an AMC file: ':DEGREES', then for each frame its number and a line a bone"


class AMCReader(Reader):
    """Reads AMC files.

    The skeleton is `Hints.skeleton`, or lies beside the file under its subject's or its own name
    (``86.asf`` for ``86_01.amc``). Without one the bones must be CMU's: angles are the same, and
    positions are those of dm_control's CMU humanoid, with its proportions and not the person's.
    """

    format = "AMC"
    suffixes = (".amc",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read angles, or positions by forward kinematics; see `Reader.read`."""
        degrees, layout, table = _frames(path)
        skeleton_file = _skeleton_file(path, hints)
        rate_hz = hints.rate_hz or _RATE_HZ
        axes = file_axes(hints.up_axis, "y", "z")
        if skeleton_file is None:
            columns, unit = CMU_COLUMNS, hints.unit_m or CMU_UNIT_M
            values = _arranged(
                path, columns, layout, table, "CMU's skeleton (its ASF is not beside it)"
            )
            angles = _in_si(values, columns, True if degrees is None else degrees, unit)
            if positions:
                return cmu_humanoid_positions(path, angles, rate_hz, unit, axes=hints.joint_axes)
            return angle_recording(path, columns, (), angles, axes, rate_hz)

        skeleton = read_asf(skeleton_file, hints.unit_m)
        _check_size(skeleton_file, skeleton)
        values = _arranged(path, skeleton.columns, layout, table, skeleton_file.name)
        angles = _in_si(
            values,
            skeleton.columns,
            skeleton.degrees if degrees is None else degrees,
            skeleton.unit_m,
        )
        if positions:
            shown = with_axes(skeleton.joints) if hints.joint_axes else skeleton.joints
            return position_recording(path, shown, angles, axes, rate_hz)
        return angle_recording(path, skeleton.columns, skeleton.joints, angles, axes, rate_hz)


def _skeleton_file(path: Path, hints: Hints) -> Path | None:
    if hints.skeleton is not None:
        return Path(hints.skeleton)
    subject = cmu_subject(stem(path)) or stem(path)
    for name in (f"{stem(path)}.asf", f"{subject}.asf"):
        for candidate in (path.parent / name, path.parent / f"{name}.gz"):
            if candidate.is_file():
                return candidate
    return None


def _frames(path: Path) -> tuple[bool | None, list[tuple[str, int]], FloatArray]:
    """Return whether angles are degrees (None: not said), a frame's bones, and the table."""
    lines, places, modes = [], [], set()
    for place, line in enumerate(read_text(path).splitlines(), start=1):
        words = line.split()
        if words and words[0].startswith(":"):
            modes.add(words[0].lower())
        elif words and not words[0].startswith("#"):
            lines.append(words)
            places.append(place)
    degrees = True if ":degrees" in modes else False if ":radians" in modes else None
    starts = [i for i, words in enumerate(lines) if len(words) == 1 and words[0].isdecimal()]
    if not starts or starts[0] != 0:
        raise bad_file(path, f"starts with {lines[0][0][:40] if lines else ''!r}", _EXPECTED)
    height = starts[1] if len(starts) > 1 else len(lines)
    if height == 1 or len(lines) != height * len(starts) or any(np.diff(starts) != height):
        wrong = next((i for i, s in enumerate(starts) if s != i * height), len(starts))
        raise bad_file(path, f"frame {wrong} has another number of bones than the first", _EXPECTED)
    count = [int(lines[start][0][:12]) for start in starts]
    if any(np.diff(count) != 1):
        wrong = int(np.argmax(np.diff(count) != 1))
        raise bad_file(path, f"frame {count[wrong + 1]} follows frame {count[wrong]}", _EXPECTED)

    layout, tables = [], []
    for row in range(1, height):
        bone, *cells = lines[row]
        rows = lines[row::height]
        for frame, words in enumerate(rows):
            if words[0] != bone:
                raise bad_file(
                    path, f"bone {words[0]!r} in frame {count[frame]}", f"{bone!r}, as before"
                )
        layout.append((bone, len(cells)))
        where = places[row::height]
        tables.append(numbers(path, [words[1:] for words in rows], len(cells), where))
    return degrees, layout, np.concatenate(tables, axis=1)


def _arranged(
    path: Path,
    columns: tuple[Column, ...],
    layout: list[tuple[str, int]],
    table: FloatArray,
    skeleton: str,
) -> FloatArray:
    """Return the table's columns in the skeleton's order."""
    places: dict[str, list[int]] = {}
    at = 0
    for bone, count in layout:
        if bone in places:
            raise bad_file(path, f"bone {bone!r} twice in a frame", "each bone once")
        places[bone] = list(range(at, at + count))
        at += count
    wanted: dict[str, int] = {}
    for column in columns:
        wanted[column.joint] = wanted.get(column.joint, 0) + 1
    for bone in sorted(wanted.keys() | places.keys()):
        there = len(places.get(bone, ()))
        if there != wanted.get(bone, 0):
            raise bad_file(
                path,
                f"bone {bone!r} has {there} numbers",
                f"{wanted.get(bone, 0)}, after {skeleton}",
            )
    if np.isnan(table).any():
        raise bad_file(path, "a value is nan", "a number for each degree of freedom")
    order = [place for bone in wanted for place in places[bone]]
    return table[:, order]


def _in_si(
    values: FloatArray, columns: tuple[Column, ...], degrees: bool, unit: float
) -> FloatArray:
    turn = np.pi / 180.0 if degrees else 1.0
    factors: FloatArray = np.array([turn if column.rotates else unit for column in columns])
    return values * factors


def _check_size(path: Path, skeleton: ASFSkeleton) -> None:
    rest = joint_positions(skeleton.joints, np.zeros((1, len(skeleton.columns))))[0]
    check_skeleton(path, rest, skeleton.unit_m)

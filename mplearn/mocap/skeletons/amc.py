"""AMC: joint angles of an ASF skeleton, as in the CMU motion capture database [CMU]."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...recording import FloatArray, Recording
from ..files import bad_file, cmu_subject, read_text, stem, suffix, within
from ..findings import Findings
from ..numbers import numbers
from ..placing.space import Space
from ..rates import rate_beside
from ..reader import Hints, Reader
from .asf import read_asf
from .cmu_humanoid import CMU_SKELETON, cmu_humanoid_recording
from .skeletal import Column, SkeletalMotion, are_radians, skeletal_recording

_RATE_HZ = 120.0  # the format has no place for it; this is the database's
_NAMED_RATES = (30, 50, 60, 100, 120, 200, 240)
_EXPECTED = "an AMC file: ':DEGREES', then for each frame its number and a line a bone"


class AMCReader(Reader):
    """Reads AMC files.

    The skeleton is `Hints.skeleton`, or lies beside the file: under its own name, its subject's
    (``86.asf`` for ``86_01.amc``) or the start of its name (``HDM_bd.asf`` for
    ``HDM_bd_01-01_01_120.amc``), or as the only one in the folder. Without one the bones must be
    CMU's: angles are the same, and positions are those of dm_control's CMU humanoid, with its
    proportions and not the person's.
    """

    format = "AMC"
    suffixes = (".amc",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read angles, or positions by forward kinematics; see `Reader.read`."""
        findings = Findings(self.format)
        degrees, layout, table = _frames(path, findings)
        skeleton_file = _skeleton_file(path, hints, findings)
        rate_hz = hints.rate_hz or _named_rate(stem(path)) or rate_beside(path, findings)
        rate_hz = rate_hz or _RATE_HZ
        if skeleton_file is None:
            skeleton = CMU_SKELETON
            name = "CMU's skeleton (its ASF is not beside it)"
        else:
            skeleton = read_asf(skeleton_file)
            name = skeleton_file.name
        values = _arranged(path, skeleton.columns, layout, table, name, findings)
        if hints.angle_unit is not None:
            degrees = hints.angle_unit == "degrees"
        elif degrees is None:  # the skeleton's unit, if it can be
            degrees = skeleton.degrees and not are_radians(
                values, skeleton.columns, hints, findings
            )
        values *= _factors(skeleton.columns, degrees)
        space = Space(skeleton.unit_m, "y", "z", says_unit=skeleton_file is not None, says_up=True)
        motion = SkeletalMotion(skeleton.joints, skeleton.columns, values, rate_hz, space)
        if skeleton_file is None:
            return cmu_humanoid_recording(path, motion, hints, findings, positions=positions)
        return skeletal_recording(path, motion, hints, findings, positions=positions)


def _skeleton_file(path: Path, hints: Hints, findings: Findings) -> Path | None:
    if hints.skeleton is not None:
        return Path(hints.skeleton)
    own = stem(path).lower()
    named = {own, cmu_subject(own)}
    beside = sorted(file for file in within(path.parent) if suffix(file) == ".asf")
    starts = []
    for file in beside:
        name = stem(file).lower()
        if name in named or (own.startswith(name) and not own[len(name)].isalnum()):
            starts.append(file)
    if starts:
        return max(starts, key=lambda file: (stem(file).lower() == own, len(stem(file))))
    if len(beside) == 1 and not cmu_subject(own):
        findings.note(f"the skeleton is {beside[0].name}, the only one beside it")
        return beside[0]
    return None


def _named_rate(name: str) -> float | None:
    """Return the rate at the end of names like ``HDM_bd_01-01_01_120`` [1/s]."""
    match = re.fullmatch(r"[A-Za-z].*_(\d{2,3})", name)
    return float(match[1]) if match and int(match[1]) in _NAMED_RATES else None


def _frames(
    path: Path, findings: Findings
) -> tuple[bool | None, list[tuple[str, int]], FloatArray]:
    """Return whether angles are degrees (None: not said), a frame's bones, and the table."""
    lines, places, modes = [], [], set()
    content = read_text(path)
    for place, line in enumerate(content.splitlines(), start=1):
        text = line.strip()
        if text.startswith(":"):
            modes.add(text.split()[0].lower())
        elif text and not text.startswith("#"):
            lines.append(text)
            places.append(place)
    degrees = True if ":degrees" in modes else False if ":radians" in modes else None
    starts = [i for i, text in enumerate(lines) if text.isdecimal()]
    if not starts or starts[0] != 0:
        raise bad_file(path, f"starts with {lines[0][:40] if lines else ''!r}", _EXPECTED)
    height = starts[1] if len(starts) > 1 else len(lines)
    open_end = len(starts) > 1 and content[-1:] not in "\r\n"
    within = open_end and _is_part(lines[-1].split(), lines[-1 - height].split())
    if len(starts) > 1 and (len(lines) < starts[-1] + height or within):
        findings.warn(f"the last frame, {lines[starts[-1]][:12]}, is cut off: left out")
        cut = starts.pop()
        del lines[cut:], places[cut:]
    if height == 1 or len(lines) != height * len(starts) or any(np.diff(starts) != height):
        wrong = next((i for i, s in enumerate(starts) if s != i * height), len(starts))
        raise bad_file(path, f"frame {wrong} has another number of bones than the first", _EXPECTED)
    count = [int(lines[start][:12]) for start in starts]
    keep = np.append(True, np.diff(count) != 0)
    if not keep.all():
        findings.warn(f"{int((~keep).sum())} frames that stand twice are left out")
        count = [number for number, first in zip(count, keep, strict=True) if first]
    if any(np.diff(count) != 1):
        wrong = int(np.argmax(np.diff(count) != 1))
        raise bad_file(path, f"frame {count[wrong + 1]} follows frame {count[wrong]}", _EXPECTED)

    layout, tables = [], []
    for row in range(1, height):
        rows = [text.split() for text in lines[row::height]]
        bone, n_cells = rows[0][0], len(rows[0]) - 1
        for frame, words in enumerate(rows):
            if words[0] != bone:
                number = lines[starts[frame]]
                raise bad_file(
                    path, f"bone {words[0]!r} in frame {number}", f"{bone[:40]!r}, as before"
                )
        layout.append((bone, n_cells))
        tables.append(numbers(path, [words[1:] for words in rows], n_cells, places[row::height]))
    return degrees, layout, np.concatenate(tables, axis=1)[keep]


def _is_part(words: list[str], whole: list[str]) -> bool:
    """Whether a line is cut off, in its numbers or in the name of its bone."""
    return len(words) < len(whole) and whole[0].startswith(words[0])


def _arranged(
    path: Path,
    columns: tuple[Column, ...],
    layout: list[tuple[str, int]],
    table: FloatArray,
    skeleton: str,
    findings: Findings,
) -> FloatArray:
    """Return the table's columns in the skeleton's order; a bone that it lacks rests."""
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
    missing = sorted(wanted.keys() - places.keys() - {"root"})
    for bone in sorted((wanted.keys() | places.keys()) - set(missing)):
        there = len(places.get(bone, ()))
        if there != wanted.get(bone, 0):
            raise bad_file(
                path,
                f"bone {bone!r} has {there} numbers",
                f"{wanted.get(bone, 0)}, after {skeleton}",
            )
    if missing:
        findings.warn(f"bones {', '.join(missing[:8])} have no numbers: they are taken to rest")
    arranged = np.zeros((len(table), len(columns)))
    at = 0
    for bone, count in wanted.items():
        if bone in places:
            arranged[:, at : at + count] = table[:, places[bone]]
        at += count
    n_missing = int(np.isnan(arranged).sum())
    if n_missing:
        findings.warn(f"{n_missing} cells are not numbers: taken as missing")
    return arranged


def _factors(columns: tuple[Column, ...], degrees: bool) -> list[float]:
    turn = np.pi / 180.0 if degrees else 1.0
    return [turn if column.rotates else 1.0 for column in columns]

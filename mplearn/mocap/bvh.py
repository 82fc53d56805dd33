"""BVH: a skeleton and its joint angles in one file [BVH]."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..recording import FloatArray, Recording
from .files import bad_file, read_text
from .kinematics import Joint, joint_positions, with_axes
from .numbers import number, numbers
from .reader import Hints, Reader
from .skeletal import Column, angle_recording, position_recording
from .space import check_skeleton, file_axes

_UNIT_M = 0.01  # the format names no unit; centimetres are the usual one


class BVHReader(Reader):
    """Reads BVH files: y up, z forward, centimetres unless hinted otherwise.

    Each joint has its own order of channels. A joint's position channels replace its offset.
    """

    format = "BVH"
    suffixes = (".bvh",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read angles, or positions by forward kinematics; see `Reader.read`."""
        lines = read_text(path).splitlines()
        start = next((i for i, s in enumerate(lines) if s.strip().upper() == "MOTION"), len(lines))
        unit = hints.unit_m or _UNIT_M
        joints, columns = _Hierarchy(path, lines[:start], unit).parse()
        rest = joint_positions(tuple(_at_rest(joint) for joint in joints), np.zeros((1, 0)))[0]
        check_skeleton(path, rest, unit)
        values, file_rate_hz = _motion(path, lines, start, len(columns))
        values = values * np.array([np.pi / 180.0 if c.rotates else unit for c in columns])
        axes = file_axes(hints.up_axis, "y", "z")
        rate_hz = hints.rate_hz or file_rate_hz
        if positions:
            shown = with_axes(joints) if hints.joint_axes else joints
            return position_recording(path, shown, values, axes, rate_hz)
        return angle_recording(path, columns, joints, values, axes, rate_hz)


def _at_rest(joint: Joint) -> Joint:
    return Joint(joint.name, joint.parent, joint.offset)


def _motion(path: Path, lines: list[str], start: int, width: int) -> tuple[FloatArray, float]:
    head = [line.split() for line in lines[start + 1 : start + 3]]
    if len(head) < 2 or head[0][:1] != ["Frames:"] or head[1][:2] != ["Frame", "Time:"]:
        raise bad_file(path, "no 'MOTION' with 'Frames:' and 'Frame Time:'", "a whole BVH file")
    count = number(path, " ".join(head[0][1:]), "Frames:")
    step_s = number(path, " ".join(head[1][2:]), "Frame Time:")
    if not 1e-5 < step_s < 10.0:
        raise bad_file(path, f"Frame Time: {step_s}", "seconds between frames, as 0.00833")
    places = [i for i in range(start + 3, len(lines)) if lines[i].strip()]
    if count != len(places) or not places:
        raise bad_file(
            path, f"{len(places)} frames", f"{count:g}, as 'Frames:' says, and at least one"
        )
    values = numbers(path, [lines[i].split() for i in places], width, [i + 1 for i in places])
    if np.isnan(values).any():
        raise bad_file(path, "a value is nan", "a number for each channel")
    return values, 1.0 / step_s


@dataclass
class _Hierarchy:
    """The parser of the part before ``MOTION``; words are taken one after another."""

    path: Path
    lines: list[str]
    unit_m: float

    def parse(self) -> tuple[tuple[Joint, ...], tuple[Column, ...]]:
        """Return the joints, parents first, and what the columns of the motion mean."""
        words = self._words()
        self._expect(next(words), "HIERARCHY")
        self._expect(next(words), "ROOT")
        joints: list[Joint] = []
        columns: list[Column] = []
        open_joints: list[int] = []
        name, parent, is_end = next(words), -1, False
        while True:
            self._expect(next(words), "{")
            joint, own = self._body(words, name, parent, is_end, len(columns))
            if any(joint.name == other.name for other in joints):
                raise bad_file(self.path, f"two joints named {joint.name!r}", "a name for each")
            open_joints.append(len(joints))
            joints.append(joint)
            columns.extend(own)
            word = next(words)
            while word == "}":
                open_joints.pop()
                if not open_joints:
                    if (rest := next(words)) != "":
                        raise bad_file(
                            self.path, f"{rest!r} after the root", "one ROOT, then MOTION"
                        )
                    return tuple(joints), tuple(columns)
                word = next(words)
            parent = open_joints[-1]
            is_end = word.upper() == "END"
            if word.upper() == "JOINT":
                name = next(words)
            elif is_end:
                self._expect(next(words), "SITE")
                name = f"{joints[parent].name}_end"
            else:
                raise bad_file(self.path, f"{word!r} in the hierarchy", "JOINT, End Site or }")

    def _body(
        self, words: Iterator[str], name: str, parent: int, is_end: bool, first: int
    ) -> tuple[Joint, list[Column]]:
        self._expect(next(words), "OFFSET")
        offset = np.array([self._number(next(words), f"OFFSET of {name}") for _ in range(3)])
        own: list[Column] = []
        if not is_end:
            self._expect(next(words), "CHANNELS")
            count = self._number(next(words), f"CHANNELS of {name}")
            if count not in range(7):
                raise bad_file(self.path, f"{count:g} channels of {name!r}", "0 to 6")
            own = [self._column(next(words), name, parent < 0) for _ in range(int(count))]
            if len(set(own)) != len(own):
                raise bad_file(self.path, f"a channel of {name!r} twice", "each channel once")
        turning = tuple((np.eye(3)[c.axis], first + i) for i, c in enumerate(own) if c.rotates)
        moving = tuple((c.axis, first + i) for i, c in enumerate(own) if not c.rotates)
        return Joint(name, parent, offset * self.unit_m, turning, moving, is_end=is_end), own

    def _column(self, word: str, name: str, of_root: bool) -> Column:
        axis, kind = word[:1].lower(), word[1:].lower()
        if axis not in ("x", "y", "z") or kind not in ("rotation", "position"):
            raise bad_file(self.path, f"channel {word!r} of {name!r}", "Xrotation, Yposition, ...")
        return Column(name, "xyz".index(axis), kind == "rotation", of_root)

    def _number(self, word: str, where: str) -> float:
        value = number(self.path, word, where)
        if np.isnan(value):
            raise bad_file(self.path, f"{where} is {word!r}", "a number")
        return value

    def _expect(self, word: str, wanted: str) -> None:
        if word.upper() != wanted:
            raise bad_file(self.path, f"{word!r} in the hierarchy", f"{wanted!r}")

    def _words(self) -> Iterator[str]:
        for line in self.lines:
            yield from line.split()
        while True:
            yield ""

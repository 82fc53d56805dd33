"""BVH: a skeleton and its joint angles in one file [BVH].

The format was never written down, and each tool bends it. What is read:

* keywords in any case; names with blanks; names that repeat, which are numbered (``Arm``,
  ``Arm_2``); end sites with a name or without (``End Site``, ``EndSite``, ``End Site Head_tip``);
* up to six channels of each joint, in an order of its own; several trees (``ROOT``);
* frames that are wrapped over lines, numbers that are glued together (``1.0-2.0``), decimal commas,
  cells that are not numbers (missing), text behind the frames;
* a number of frames that is not the one in the header.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ....recording import FloatArray, Recording
from ...files import bad_file, read_text
from ...findings import Findings
from ...placing.space import Space
from ...reader import Hints, Reader
from ..kinematics import Joint
from ..skeletal import SkeletalMotion, are_radians, skeletal_recording
from .hierarchy import parse_hierarchy
from .motion import parse_motion

# the format names neither: centimetres are usual, and so is y up
_SPACE = Space(0.01, "y", "z", says_unit=False)
_NEXT_TO_NOTHING = 0.1  # of the offset
_HIERARCHY = re.compile(r"^[ \t]*HIERARCHY\b", re.IGNORECASE | re.MULTILINE)
_MOTION = re.compile(r"(?:^|(?<=\}))[ \t]*MOTION[ \t]*$", re.IGNORECASE | re.MULTILINE)


class BVHReader(Reader):
    r"""Reads BVH files: y up, z forward, centimetres unless the person or a hint tells otherwise.

    A joint's position channels replace its offset, unless those of most joints are next to nothing:
    then they are how far it is off its offset. Unlike most formats this one has a rate without
    a name: seconds a frame.

    Example:
        >>> from pathlib import Path
        >>> from mplearn.mocap import Hints
        >>> root = "HIERARCHY\nROOT hip\n{\nOFFSET 0 0 0\nCHANNELS 2 Zrotation Xrotation\n"
        >>> end = "End Site\n{\nOFFSET 0 -40 0\n}\n}\n"
        >>> motion = "MOTION\nFrames: 2\nFrame Time: 0.02\n0 0\n90 0\n"
        >>> _ = Path("leg.bvh").write_text(root + end + motion)
        >>> hints = Hints(unit_m=0.01, up_axis="y")
        >>> take = BVHReader().read(Path("leg.bvh"), hints, positions=False)
        >>> take.rate_hz, take.channels, take.frames.round(2).tolist()
        (50.0, ('hip.rx', 'hip.ry'), [[0.0, 0.0], [1.57, 0.0]])
    """

    format = "BVH"
    suffixes = (".bvh",)
    begins = ("HIERARCHY",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read angles, or positions by forward kinematics; see `Reader.read`."""
        findings = Findings(self.format)
        text = read_text(path).replace("\r\n", "\n").replace("\r", "\n")
        start = _MOTION.search(text)
        if start is None:
            raise bad_file(path, "no line 'MOTION'", "a BVH file: HIERARCHY, then MOTION")
        begin = _HIERARCHY.search(text, 0, start.start())
        begin_at = begin.start() if begin else 0
        if text[:begin_at].strip():
            findings.note("text before HIERARCHY is left out")
        joints, columns = parse_hierarchy(path, text[begin_at : start.start()], findings)
        first_line = text.count("\n", 0, start.end()) + 2
        values, rate_hz = parse_motion(
            path, text[start.end() + 1 :], first_line, len(columns), hints.rate_hz, findings
        )
        turn = 1.0 if are_radians(values, columns, hints, findings) else np.pi / 180.0
        values *= [turn if column.rotates else 1.0 for column in columns]
        _from_parents(joints, values, findings)
        motion = SkeletalMotion(joints, columns, values, rate_hz, _SPACE)
        return skeletal_recording(path, motion, hints, findings, positions=positions)


def _from_parents(joints: tuple[Joint, ...], values: FloatArray, findings: Findings) -> None:
    """Let positions that are counted from the offsets be counted from the parents, in place."""
    moving = [j for j in joints if j.parent >= 0 and len(j.translations) == 3 and j.offset.any()]
    small = []
    for joint in moving:
        columns = [column for _, column in joint.translations]
        known = values[~np.isnan(values[:, columns]).any(axis=1)][:, columns]
        if len(known) and np.linalg.norm(np.median(known, axis=0)) < _NEXT_TO_NOTHING * float(
            np.linalg.norm(joint.offset)
        ):
            small.append(joint)
    if small and 2 * len(small) > len(moving):
        findings.note("positions of joints are taken as how far they are off their offsets")
        for joint in small:
            for axis, column in joint.translations:
                values[:, column] += joint.offset[axis]

"""ASF: the skeleton that an AMC file moves [Acclaim]."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...maths.rotations import euler_to_matrix
from ...recording import FloatArray
from ..files import bad_file, read_text
from ..numbers import number
from ..placing.size import named_unit
from .kinematics import Joint
from .skeletal import Column

_INCH_M = 0.0254
_EXPECTED = "an ASF skeleton with :units, :root, :bonedata and :hierarchy"


@dataclass(eq=False)
class _Bone:
    """A bone as the file has it: direction at rest and axes are the world's."""

    direction: FloatArray = field(default_factory=lambda: np.zeros(3))
    length: float = 0.0
    axes: FloatArray = field(default_factory=lambda: np.eye(3))
    dofs: tuple[str, ...] = ()


@dataclass(frozen=True)
class ASFSkeleton:
    """An ASF skeleton.

    Attributes:
        columns: What the numbers of an AMC frame mean, in the skeleton's order.
        joints: Its joints, parents first, in the file's unit; one a bone at its near end, and
            ``NAME_end`` where a chain ends.
        unit_m: Length of the unit of length of both files [m], as the file says.
        degrees: Whether angles are in degrees.
    """

    columns: tuple[Column, ...]
    joints: tuple[Joint, ...]
    unit_m: float
    degrees: bool


def read_asf(path: Path) -> ASFSkeleton:
    """Read a skeleton, plain or gzipped.

    Its unit is ``1 / length`` inches, with the ``length`` of its units, or the one named there.

    Args:
        path: The file.

    Raises:
        RecordingError: The file is not a skeleton, or its bones form no tree below ``root``.
    """
    sections = _sections(path)
    units = {words[0].lower(): words[1:] for words in sections["units"]}
    degrees = units.get("angle", ["deg"])[:1] != ["rad"]
    length = " ".join(units.get("length", ["1"]))
    unit_m = named_unit(length)
    if unit_m is None:
        inverse = number(path, length, "length in :units")
        if not inverse > 0:
            raise bad_file(path, f"length {inverse} in :units", "a positive number")
        unit_m = _INCH_M / inverse
    turn = np.pi / 180.0 if degrees else 1.0
    root, columns = _root(path, sections["root"], turn)
    bones = dict(_bones(path, sections["bonedata"], turn))
    if "root" in bones:
        raise bad_file(path, "a bone named 'root'", "another name")
    joints, columns = _tree(
        path, root, columns, bones, _children(path, sections["hierarchy"], bones)
    )
    return ASFSkeleton(columns, joints, unit_m, degrees)


def _sections(path: Path) -> dict[str, list[list[str]]]:
    """Return the words of each line, by section."""
    sections: dict[str, list[list[str]]] = {}
    current: list[list[str]] | None = None
    for line in read_text(path).splitlines():
        words = line.split("#")[0].split()
        if not words:
            continue
        if words[0].startswith(":"):
            current = sections.setdefault(words[0][1:].lower(), [])
        elif current is not None:
            current.append(words)
    missing = [name for name in ("units", "root", "bonedata", "hierarchy") if name not in sections]
    if missing:
        raise bad_file(path, f"no section :{missing[0]}", _EXPECTED)
    return sections


def _root(path: Path, lines: list[list[str]], turn: float) -> tuple[Joint, tuple[Column, ...]]:
    words = {line[0].lower(): line[1:] for line in lines}
    dofs = tuple(name.lower() for name in words.get("order", ()))
    if len(set(dofs)) != len(dofs) or not set(dofs) <= {"tx", "ty", "tz", "rx", "ry", "rz"}:
        raise bad_file(
            path, f"root order {' '.join(dofs)!r}", "TX TY TZ RX RY RZ, each at most once"
        )
    position = _vector(path, words.get("position", ["0", "0", "0"]), "root position")
    order = words.get("axis", ["XYZ"])
    axes = _euler(path, words.get("orientation", ["0", "0", "0"]) + order, turn, "root orientation")
    # the AMC's root translation is where the root is, and position only where it starts
    columns = tuple(Column("root", "xyz".index(d[1]), d[0] == "r", True) for d in dofs)
    return (
        Joint(
            "root",
            -1,
            position,
            rotations_of(columns, 0),
            tuple((c.axis, i) for i, c in enumerate(columns) if not c.rotates),
            before=axes,
            after=axes.T,
        ),
        columns,
    )


def _bones(path: Path, lines: list[list[str]], turn: float) -> Iterator[tuple[str, _Bone]]:
    seen = set()
    bone, name = _Bone(), ""
    for words in lines:
        key, values = words[0].lower(), words[1:]
        if key == "begin":
            bone, name = _Bone(), ""
        elif key == "name" and values:
            name = values[0]
        elif key == "direction":
            bone.direction = _vector(path, values, f"direction of bone {name!r}")
        elif key == "length":
            bone.length = number(path, " ".join(values), f"length of bone {name!r}")
        elif key == "axis":
            bone.axes = _euler(path, values, turn, f"axis of bone {name!r}")
        elif key == "dof":
            bone.dofs = tuple(value.lower() for value in values)
            if not set(bone.dofs) <= {"rx", "ry", "rz"} or len(set(bone.dofs)) != len(bone.dofs):
                raise bad_file(
                    path, f"dof {values} of bone {name!r}", "rx, ry, rz, each at most once"
                )
        elif key == "end":
            if not name or name in seen:
                raise bad_file(
                    path, f"a bone named {name!r}", "a name for each bone, each different"
                )
            if not np.isfinite(bone.length):
                raise bad_file(path, f"bone {name!r} has no length", "a number")
            seen.add(name)
            yield name, bone


def _children(
    path: Path, lines: list[list[str]], bones: dict[str, _Bone]
) -> dict[str, tuple[str, ...]]:
    children: dict[str, tuple[str, ...]] = {}
    parents: dict[str, str] = {}
    for parent, *names in lines:
        if parent.lower() in ("begin", "end") and not names:
            continue
        for name in (parent, *names):
            if name not in bones and name != "root":
                raise bad_file(path, f":hierarchy names {name!r}", "a bone of :bonedata")
        for name in names:
            if name == "root" or name in parents:
                raise bad_file(path, f"bone {name!r} has two parents", "a tree below 'root'")
            parents[name] = parent
        children[parent] = children.get(parent, ()) + tuple(names)
    return children


def _tree(
    path: Path,
    root: Joint,
    columns: tuple[Column, ...],
    bones: dict[str, _Bone],
    children: dict[str, tuple[str, ...]],
) -> tuple[tuple[Joint, ...], tuple[Column, ...]]:
    joints, ends = [root], {"root": np.zeros(3)}
    waiting = [(name, 0) for name in reversed(children.get("root", ()))]
    while waiting:
        name, parent = waiting.pop()
        bone = bones[name]
        own = tuple(Column(name, "xyz".index(dof[1]), True) for dof in bone.dofs)
        joints.append(
            Joint(
                name,
                parent,
                ends[joints[parent].name],
                rotations_of(own, len(columns)),
                before=bone.axes,
                after=bone.axes.T,
            )
        )
        columns += own
        ends[name] = bone.direction * bone.length
        index = len(joints) - 1
        below = children.get(name, ())
        if not below:
            joints.append(Joint(f"{name}_end", index, ends[name], is_end=True))
        waiting.extend((child, index) for child in reversed(below))
    unreached = sorted(set(bones) - set(ends))
    if unreached:
        raise bad_file(path, f"bones {unreached[:5]} do not hang on 'root'", "a tree of all bones")
    return tuple(joints), columns


def rotations_of(columns: tuple[Column, ...], first: int) -> tuple[tuple[FloatArray, int], ...]:
    """Return the rotations outermost first: what an ASF names first, turns first."""
    turning = [(np.eye(3)[c.axis], first + i) for i, c in enumerate(columns) if c.rotates]
    return tuple(reversed(turning))


def _vector(path: Path, words: list[str], where: str) -> FloatArray:
    if len(words) != 3:
        raise bad_file(path, f"{where} has {len(words)} numbers", "three")
    vector = np.array([number(path, word, where) for word in words])
    if np.isnan(vector).any():
        raise bad_file(path, f"{where} is {vector}", "three numbers")
    return vector


def _euler(path: Path, words: list[str], turn: float, where: str) -> FloatArray:
    order = words[3].lower() if len(words) == 4 else ""
    if sorted(order) != ["x", "y", "z"]:
        raise bad_file(
            path, f"{where} is {' '.join(words)!r}", "three angles and an order like XYZ"
        )
    return euler_to_matrix(order, _vector(path, words[:3], where) * turn)

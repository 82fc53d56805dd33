"""Motions of the Unitree G1 as tables: the kind that LAFAN1 was retargeted to, and SEED's.

* 36 numbers a row, with a header or without: the pelvis' place [m], its orientation as a quaternion
  (x, y, z, w), and the 29 joints in order, 30 Hz; without a header there may be a frame's number or
  time before them, or only 23 joints, as those have that cannot bend waist and wrists. Angles are
  radians, or degrees where names or their size say so;
* a header ``Frame, root_translateX, ..., root_rotateX, ..., left_hip_pitch_joint_dof, ...``:
  centimetres, degrees, the pelvis' rotations about the fixed axes x, y, z in turn, 120 Hz.

Arrays (``.npy``) of such rows are read, too, and archives of ``root_pos``, ``root_rot`` and
``dof_pos``, as tools that retarget motions write them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...maths.rotations import euler_to_matrix, matrix_to_euler, quaternion_to_matrix
from ...recording import FloatArray, Recording
from ..clock import even_clock
from ..files import bad_file, head_text, read_text, suffix
from ..findings import Findings
from ..numbers import numbers, without_cut_row
from ..placing.space import Space
from ..rates import rate_beside
from ..reader import Hints, Reader
from .g1 import BASE, G1_JOINTS, g1_joints
from .npz_file import NPZFile, finite, npy_shape, read_npy
from .skeletal import Column, SkeletalMotion, skeletal_recording
from .stature import unit_of_places

_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_STIFF = re.compile("waist_(?:roll|pitch)|wrist_(?:pitch|yaw)")  # where there are 23 joints
_OF_23 = tuple(name for name in G1_JOINTS if not _STIFF.search(name))
_HEADERLESS = {len(_POSE) + len(joints): (*_POSE, *joints) for joints in (G1_JOINTS, _OF_23)}
_ROOT = r"(?:(?:root|base|pelvis|floating_base)_?)?"
_PLACE = re.compile(rf"{_ROOT}(?:(?:translate|translation|trans|pos|position)_?)?([xyz])")
_QUATERNION = re.compile(rf"{_ROOT}(?:q|quat|quaternion|rot|orientation)_?([xyzw])")
_ROTATION = re.compile(rf"{_ROOT}(?:rotate|rotation|euler)_?([xyz])")
_TIMES = ("time", "time_s", "timestamp", "t")
_RETARGETED_HZ, _SEED_HZ = 30.0, 120.0
_UNITS = {"deg": "degrees", "degrees": "degrees", "rad": "radians", "radians": "radians"}
_BEGINNINGS = re.compile(r"^(?:joint|dof|pos)_")
_ENDINGS = re.compile(rf"(_joint|_dof|_pos|_angle|_{'|_'.join(_UNITS)})+$")
_ARRAYS = ("root_pos", "root_rot", "dof_pos")  # of an archive
_LOOK = 20  # rows that are looked at
_MOST_BEFORE = 2  # columns before a pose: a frame's number, and its time
_EXPECTED = "the pelvis' place and orientation, and the G1's 29 or 23 joints"

_COLUMNS = (
    *(Column("pelvis", axis, False, True, name) for axis, name in enumerate(BASE[:3])),
    *(Column("pelvis", axis, True, True, BASE[3 + i]) for i, axis in enumerate((2, 0, 1))),
    *(Column(name, 0, True, name=name) for name in G1_JOINTS),
)


class G1CSVReader(Reader):
    """Reads motions of the Unitree G1 from CSV files: see the module's docstring.

    Channels are the robot's: how its pelvis is (`g1.BASE`), and its joints by name.
    """

    format = "G1 CSV"
    suffixes = (".csv", ".tsv", ".txt")

    def accepts(self, path: Path) -> bool:
        """Whether the first row names half of the G1's joints, or holds numbers as it would."""
        lines = [line for line in head_text(path).splitlines() if line.strip()]
        if not lines:
            return False
        cells = _cells(lines[0])
        if sum(_joint(cell) is not None for cell in cells) >= len(G1_JOINTS) // 2:
            return True
        width = _width(len(cells))
        if _plain_numbers(cells) is None or not width:
            return False
        rows = [_plain_numbers(_cells(line)) for line in lines[:_LOOK]]
        return _has_pose([row[-width:] for row in rows if row is not None and len(row) >= width])

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read angles, or where the robot's joints are; see `Reader.read`."""
        findings = Findings(self.format)
        text = read_text(path)
        rows = [(i, _cells(s)) for i, s in enumerate(text.splitlines(), 1) if s.strip()]
        rows = without_cut_row(rows, text, findings)
        header = rows[0][1] if rows else []
        named = _plain_numbers(header) is None
        rows = rows[1:] if named else rows
        if not rows:
            raise bad_file(path, "no frames", "a row for each")
        table = numbers(path, [row for _, row in rows], len(header), [i for i, _ in rows])
        if not named:
            names = _HEADERLESS[_width(len(header))]
            before = table[:, : len(header) - len(names)]
            header = [*map(_counts, before.T), *names]
        return _recording(path, table, header, None, hints, findings, positions=positions)


class G1ArrayReader(Reader):
    """Reads motions of the Unitree G1 from arrays: see the module's docstring."""

    format = "G1 array"
    suffixes = (".npy", ".npz")

    def accepts(self, path: Path) -> bool:
        """Whether it is an array of such rows, as they would be, or an archive of such."""
        try:
            if suffix(path) == ".npz":
                return set(_ARRAYS) <= set(NPZFile(path).names)
            shape = npy_shape(path)
            of_poses = len(shape) == 2 and shape[0] > 0 and shape[1] in _HEADERLESS
            return of_poses and _has_pose(_array(path))
        except RecordingError:
            return False

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read angles, or where the robot's joints are; see `Reader.read`."""
        findings = Findings(self.format)
        said_hz = None
        if suffix(path) == ".npz":
            archive = NPZFile(path)
            parts = [archive.numbers(name) for name in _ARRAYS]
            shapes = [each.shape for each in parts]
            wanted = [
                [(len(parts[0]), n) for n in (3, 4, width - len(_POSE))] for width in _HEADERLESS
            ]
            if not parts[0].ndim or shapes not in wanted or not shapes[0][0]:
                raise bad_file(path, f"{', '.join(_ARRAYS)} of shapes {shapes}", _EXPECTED)
            table, said_hz = np.concatenate(parts, axis=1), archive.rate_hz(len(parts[0]))
        else:
            table = _array(path)
        header = list(_HEADERLESS[table.shape[1]])
        return _recording(path, table, header, said_hz, hints, findings, positions=positions)


def _array(path: Path) -> FloatArray:
    """Return the rows of an array of poses, shape (T, 36) or (T, 30)."""
    table = finite(path, "the array", read_npy(path))
    if table.ndim != 2 or table.shape[1] not in _HEADERLESS or not len(table):
        raise bad_file(path, f"an array of shape {table.shape}", _EXPECTED)
    return table


def _width(n_cells: int) -> int:
    """Return how many numbers a pose has in rows of so many; 0 where none has."""
    return next((w for w in _HEADERLESS if w <= n_cells <= w + _MOST_BEFORE), 0)


def _has_pose(rows: Iterable[FloatArray]) -> bool:
    """Whether the first row that tells it is a pose: what is missing (NaN) tells nothing.

    The quaternion is one, and no angle is too large.
    """
    pose = next((row for row in rows if np.isfinite(row[3:7]).all()), None)
    if pose is None:
        return False
    with np.errstate(over="ignore", invalid="ignore"):
        off = abs(float(np.linalg.norm(pose[3:7])) - 1.0)
    reach = np.nanmax(np.abs(pose[7:]), initial=0.0)
    return bool(off < 0.01 and reach < 2 * np.pi) or bool(off < 1e-4 and reach < 360.0)


def _recording(
    path: Path,
    table: FloatArray,
    header: list[str],
    said_hz: float | None,
    hints: Hints,
    findings: Findings,
    *,
    positions: bool,
) -> Recording:
    """Return the motion in a table.

    Args:
        path: The file.
        table: Its numbers, shape (T, C).
        header: Names of the C columns.
        said_hz: The rate that it says [1/s]; None for none.
        hints: What it does not say.
        findings: Where to tell what was taken for what.
        positions: See `Reader.read`.
    """
    at = _columns(path, header, findings)
    seed = "qw" not in at
    unit_m = unit_of_places(path, table[:, at["z"]], 0.01 if seed else 1.0, hints, findings)
    values = np.zeros((len(table), len(BASE) + len(G1_JOINTS)))
    values[:, :3] = table[:, [at[axis] for axis in "xyz"]] * unit_m
    values[:, 3:6] = _root_angles(table, at, findings)
    joints = [name for name in G1_JOINTS if name in at]
    angles = table[:, [at[name] for name in joints]]
    unit = hints.angle_unit or _said_unit(header) or ("degrees" if seed else None)
    if unit is None and np.nanmax(np.abs(angles), initial=0.0) > 2 * np.pi:
        findings.warn("joint angles above a full turn: they are taken for degrees")
        unit = "degrees"
    values[:, [len(BASE) + G1_JOINTS.index(name) for name in joints]] = (
        np.radians(angles) if unit == "degrees" else angles
    )
    rate_hz = hints.rate_hz or said_hz or (_SEED_HZ if seed else _RETARGETED_HZ)
    if "time" in at:
        clock = even_clock(path, table[:, at["time"]])
        values, rate_hz = clock.even(values), hints.rate_hz or clock.rate_hz
    elif hints.rate_hz is None and not said_hz and (beside := rate_beside(path, findings)):
        rate_hz = beside
    elif hints.rate_hz is None and not said_hz:
        findings.note(f"{rate_hz:g} Hz, usual in such tables, which do not say it")
    motion = SkeletalMotion(
        g1_joints(), _COLUMNS, values, rate_hz, Space(1.0, "z", "x", says_up=True)
    )
    metres = replace(hints, unit_m=1.0)  # the robot's bones are known, whatever the file's unit
    recording = skeletal_recording(path, motion, metres, findings, positions=positions)
    assert recording.report is not None
    return replace(recording, report=replace(recording.report, unit_m=unit_m))


def _cells(line: str) -> list[str]:
    line = line.lstrip("# ")  # as numpy writes headers
    for separator in (";", "\t", ","):
        if separator in line:
            line = line if separator == "," else line.replace(",", ".")  # decimal commas
            return [cell.strip() for cell in line.rstrip().rstrip(separator).split(separator)]
    return line.split()


def _plain_numbers(cells: list[str]) -> FloatArray | None:
    """Return the numbers in a row, NaN where one is missing; None where there is a word."""
    try:
        values = np.array([float(cell or "nan") for cell in cells])
    except ValueError:
        return None
    return None if np.isinf(values).any() else values


def _counts(column: FloatArray) -> str:
    """Return whether a column without a name numbers frames, or is their time."""
    return "frame" if len(column) > 1 and (np.diff(column) == 1.0).all() else "time"


def _joint(name: str) -> str | None:
    """Return the joint of the G1 that a column is named after: ``waist_yaw``, ``..._joint_dof``."""
    plain = _BEGINNINGS.sub("", _ENDINGS.sub("", _words(name)))
    return f"{plain}_joint" if f"{plain}_joint" in G1_JOINTS else None


def _words(name: str) -> str:
    """Return a name with its words in small letters, ``_`` between them."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])|[\s.\-()\[\]]+", "_", name.strip()).lower().strip("_")


def _said_unit(header: list[str]) -> str | None:
    """Return the unit that the joints' names say, ``left_knee_deg``; None for none or several."""
    last = [_words(name).rpartition("_")[2] for name in header if _joint(name) is not None]
    units = {_UNITS.get(word) for word in last}
    return units.pop() if len(units) == 1 else None


def _columns(path: Path, header: list[str], findings: Findings) -> dict[str, int]:
    """Return the column of each joint, of x, y, z, of qx.. or rx.., and of the time."""
    at: dict[str, int] = {}
    for index, name in enumerate(header):
        plain = name.lower()
        found = _joint(name)
        for prefix, pattern in (("", _PLACE), ("q", _QUATERNION), ("r", _ROTATION)):
            match = pattern.fullmatch(plain)
            if found is None and match is not None:
                found = prefix + match[1]
        if found is None and plain in _TIMES:
            found = "time"
        if found is None:
            findings.leave_out([name])
        elif found in at:
            raise bad_file(path, f"columns {header[at[found]]!r} and {name!r}", "one of each")
        else:
            at[found] = index
    turned = "qw" in at or "rx" in at
    wanted = [*"xyz", *(f"q{c}" for c in "xyzw")] if "qw" in at else [*"xyz", "rx", "ry", "rz"]
    if not turned or not set(wanted) <= set(at):
        raise bad_file(path, f"columns named {header[:8]}", _EXPECTED)
    resting = [name for name in G1_JOINTS if name not in at]
    if resting:
        findings.warn(f"no columns for {', '.join(resting)}: they are taken to rest")
    return at


def _root_angles(table: FloatArray, at: dict[str, int], findings: Findings) -> FloatArray:
    if "qw" in at:
        rotations = _turned(table[:, [at[f"q{c}"] for c in "wxyz"]])
        w_first = _turned(table[:, [at[f"q{c}"] for c in "xyzw"]])
        if at["qx"] == 3 and _upright(rotations) < -0.5 < 0.5 < _upright(w_first):
            findings.warn("the quaternion is taken as w, x, y, z: else the robot is on its head")
            rotations = w_first
    else:
        rotations = euler_to_matrix("xyz", np.radians(table[:, [at[f"r{c}"] for c in "xyz"]]))
    return matrix_to_euler("ZXY", rotations)


def _turned(quaternions: FloatArray) -> FloatArray:
    size = np.linalg.norm(quaternions, axis=1, keepdims=True)
    return quaternion_to_matrix(np.where(size > 0.5, quaternions, np.nan))


def _upright(rotations: FloatArray) -> float:
    """Return the median height of the tip of the body's upward axis, 1 for who stands."""
    heights = rotations[:, 2, 2]
    return float(np.median(heights[~np.isnan(heights)])) if not np.isnan(heights).all() else 0.0

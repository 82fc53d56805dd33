"""BVH: the robot's bodies as joints, for animation tools.

Each body is a joint with its own rotation, so a tool that knows no hinges shows the robot as it is.
As in most files of the kind: centimetres, y up, z ahead, angles in degrees, and in the pose without
rotations (all angles zero) every joint's axes are the world's. Where a body's hinge lies beside its
origin, as in dm_control's humanoid, the origin moves in the body that carries it: that joint has
position channels, too, which say where it lies and not how far from its offset.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from mplearn.errors import RecordingError
from mplearn.maths.continuous_euler import continuous_euler
from mplearn.maths.rotations import (
    euler_to_matrix,
    matrix_to_euler,
    matrix_to_quaternion,
    quaternion_to_matrix,
)
from mplearn.recording import FloatArray

from ..format import Dialect, Format, Reading, in_order
from ..motion import RobotMotion
from ..robot_model import RobotModel

_CM = 100.0
_STILL = 1e-5  # by how much the place of a joint that has none differs from its offset [cm]
_ORDER = "ZYX"
_UPRIGHT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # x, y, z: y is up


class BVH(Format):
    """See the module's docstring."""

    name = "bvh"
    about = "BVH for animation tools: a joint a body, cm, y up, degrees (Blender, Maya, GMR)"
    suffix = ".bvh"

    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write one motion."""
        (motion,) = motions
        order = _depth_first(model)
        bodies = model.forward(motion.root_pos, motion.root_quat, motion.joint_pos)
        turn = _turns(model, bodies.quat)
        places, moving = _CM * bodies.pos @ _UPRIGHT.T, set()
        columns = []
        for b in order:
            p = model.parents[b]
            local, place = turn[:, b], places[:, b]
            if p >= 0:
                back = np.swapaxes(turn[:, p], 1, 2)
                local = back @ turn[:, b]
                place = np.einsum("tij,tj->ti", back, places[:, b] - places[:, p])
            if p < 0 or np.abs(place - _offset(model, b)).max() > _STILL:
                columns.append(place)
                moving.add(b)
            angles = continuous_euler(_ORDER, matrix_to_euler(_ORDER, local))
            exact = matrix_to_euler(_ORDER, local)  # near gimbal lock, where the path is not exact
            off = np.abs(euler_to_matrix(_ORDER, angles) - local).max(axis=(1, 2)) > 1e-7
            angles[off] = exact[off]
            columns.append(np.degrees(angles))
        lines = ["HIERARCHY", *_hierarchy(model, moving), "MOTION", f"Frames: {len(motion)}"]
        lines.append(f"Frame Time: {1.0 / motion.rate_hz:.9g}")
        with path.open("w", encoding="utf-8") as file:
            file.write("\n".join(lines) + "\n")
            np.savetxt(file, np.hstack(columns), fmt="%.8g")

    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return the bodies of a file, by their names."""
        return (_reading(path, model),)

    def dialects(self, path: Path, model: RobotModel) -> tuple[Dialect, ...]:
        """Return what it says if its angles are radians, or its joints are not what they say."""
        radians = _reading(path, model, float(np.degrees(1.0)))
        found = [Dialect("degrees", "angles are in radians, not degrees", (radians,))]
        ordered = tuple(model.body_names[b] for b in _depth_first(model))
        names = _parsed(path)[0]
        if tuple(names) != ordered and len(names) == len(ordered):
            problem = "joints have other names than their places in the tree say"
            moved = _reading(path, model, names=ordered)
            found.append(Dialect("joints permuted", problem, (moved,)))
        return tuple(found)


def _reading(
    path: Path, model: RobotModel, angle_unit: float = 1.0, names: Sequence[str] = ()
) -> Reading:
    """Return what a file says; its unit of angles [deg] and its joints' names may be given."""
    own_names, parents, offsets, channels, frame_s, table = _parsed(path)
    places = in_order(path, "joint", names or own_names, model.body_names)
    n_frames = len(table)
    turn = np.empty((len(own_names), n_frames, 3, 3))
    pos = np.empty((len(own_names), n_frames, 3))
    column = 0
    for b, (parent, offset, kinds) in enumerate(zip(parents, offsets, channels, strict=True)):
        values = dict(zip(kinds, table[:, column : column + len(kinds)].T, strict=True))
        column += len(kinds)
        axes = [kind[0] for kind in kinds if kind.endswith("rotation")]
        angles = np.radians([angle_unit * values[f"{axis}rotation"] for axis in axes]).T
        local = euler_to_matrix("".join(axes), angles)
        place = np.tile(offset, (n_frames, 1))
        for axis, letter in enumerate("XYZ"):
            if f"{letter}position" in values:
                place[:, axis] = values[f"{letter}position"]
        if parent < 0:
            turn[b], pos[b] = local, place
        else:
            turn[b] = turn[parent] @ local
            pos[b] = pos[parent] + np.einsum("tij,tj->ti", turn[parent], place)
    back = np.swapaxes(pos[places], 0, 1) @ _UPRIGHT / _CM
    own = np.swapaxes(turn[places], 0, 1)
    rest = quaternion_to_matrix(model.at_zero.quat[0])
    quat = matrix_to_quaternion(_UPRIGHT.T @ own @ _UPRIGHT @ rest)
    reading = Reading(1.0 / frame_s, back[:, 0], quat[:, 0], None, back, quat)
    return reading.require(path, model)


def _turns(model: RobotModel, quat: FloatArray) -> FloatArray:
    """Return how bodies are turned from their rest, in the file's axes, shape (T, B, 3, 3)."""
    rest = quaternion_to_matrix(model.at_zero.quat[0])
    return np.asarray(_UPRIGHT @ quaternion_to_matrix(quat) @ np.swapaxes(rest, 1, 2) @ _UPRIGHT.T)


def _depth_first(model: RobotModel) -> list[int]:
    """Return the bodies as the hierarchy has them."""
    below: dict[int, list[int]] = {}
    for b, p in enumerate(model.parents.tolist()):
        below.setdefault(p, []).append(b)
    out: list[int] = []
    ahead = list(below[-1])
    while ahead:
        out.append(ahead.pop(0))
        ahead = below.get(out[-1], []) + ahead
    return out


def _offset(model: RobotModel, b: int) -> FloatArray:
    """Return where a body lies in the one that carries it with all angles zero [cm], shape (3,)."""
    p, places = int(model.parents[b]), model.at_zero.pos[0]
    return np.zeros(3) if p < 0 else _CM * (places[b] - places[p]) @ _UPRIGHT.T


def _hierarchy(model: RobotModel, moving: Collection[int]) -> list[str]:
    """Return the joints; those of some bodies have position channels."""
    rest = quaternion_to_matrix(model.at_zero.quat[0])
    children = set(model.parents.tolist())
    turns = " ".join(f"{axis}rotation" for axis in _ORDER)
    out: list[str] = []
    open_: list[int] = []
    for b in _depth_first(model):
        p = int(model.parents[b])
        while open_ and open_[-1] != p:
            open_.pop()
            out.append("\t" * len(open_) + "}")
        tab = "\t" * len(open_)
        moves = "6 Xposition Yposition Zposition " if b in moving else "3 "
        out += [
            f"{tab}{'ROOT' if p < 0 else 'JOINT'} {model.body_names[b]}",
            f"{tab}{{",
            f"{tab}\tOFFSET {_row(_offset(model, b))}",
            f"{tab}\tCHANNELS {moves}{turns}",
        ]
        open_.append(b)
        if b not in children:  # as far beyond the middle of its mass as its joint is before it
            end = 2 * _CM * rest[b] @ model.model.body_ipos[model.bodies[b]] @ _UPRIGHT.T
            out += [
                f"{tab}\tEnd Site",
                f"{tab}\t{{",
                f"{tab}\t\tOFFSET {_row(end)}",
                f"{tab}\t}}",
            ]
    while open_:
        open_.pop()
        out.append("\t" * len(open_) + "}")
    return out


def _row(vector: FloatArray) -> str:
    return " ".join(f"{value:.9g}" for value in vector + 0.0)


def _parsed(
    path: Path,
) -> tuple[list[str], list[int], list[FloatArray], list[list[str]], float, FloatArray]:
    """Return joints, parents, offsets, channels, seconds a frame and numbers, as they stand."""
    text = path.read_text(encoding="utf-8", errors="replace")
    head, found, tail = text.partition("MOTION")
    names: list[str] = []
    parents: list[int] = []
    offsets: list[FloatArray] = []
    channels: list[list[str]] = []
    open_: list[int] = []
    try:
        if not found:
            raise ValueError("there is no MOTION")
        at_end = False
        for line in head.splitlines():
            words = line.split()
            if not words:
                continue
            if words[0] in ("ROOT", "JOINT"):
                parents.append(open_[-1] if open_ else -1)
                names.append(" ".join(words[1:]))
                open_.append(len(names) - 1)
            elif words[0] == "End":
                at_end = True
            elif words[0] == "OFFSET" and not at_end:
                offsets.append(np.array(words[1:4], dtype=np.float64))
            elif words[0] == "CHANNELS":
                channels.append([word.lower()[:1].upper() + word[1:] for word in words[2:]])
            elif words[0] == "}":
                if at_end:
                    at_end = False
                else:
                    open_.pop()
        lines = tail.strip().splitlines()
        frame_s = float(lines[1].split(":")[1])
        if len(lines) < 3:
            raise ValueError("it has no frames")
        table = np.loadtxt(lines[2:], ndmin=2)
        if table.shape[1] != sum(map(len, channels)) or not len(names) == len(offsets):
            raise ValueError(
                f"{table.shape[1]} numbers a frame, {sum(map(len, channels))} channels"
            )
        if not frame_s > 0:
            raise ValueError(f"Frame Time is {frame_s}")
    except (ValueError, IndexError) as error:
        raise RecordingError(f"{path}: no BVH file: {error}") from error
    return names, parents, offsets, channels, frame_s, table

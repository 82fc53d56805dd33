"""From the columns of a skeletal file to a recording of joint angles or joint positions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...maths.continuous_euler import continuous_euler
from ...maths.rotations import matrix_to_euler
from ...option_names import option
from ...recording import FloatArray, Recording, marker_channels
from ..files import bad_file, cmu_subject, stem
from ..findings import Findings
from ..placing.part_names import HEIGHTS, place_of
from ..placing.space import Space, placed
from ..reader import Hints
from .kinematics import Joint, joint_positions, skeleton_of, with_axes
from .stature import unit_of_skeleton

_FEW = 10  # frames, which tell nothing
_MOVES = 1.0  # of an angle, as it stands in the file: for who moves at all, one in radians


@dataclass(frozen=True)
class Column:
    """What a column of a skeletal file means.

    Attributes:
        joint: The joint it moves.
        axis: 0-2, the file's x, y or z.
        rotates: Whether it is an angle [rad], not a translation [m].
        of_root: Whether it is a part of the root's pose in the world.
        name: Name of its channel, where it is not made of the joint's and the axis'.
    """

    joint: str
    axis: int
    rotates: bool
    of_root: bool = False
    name: str = ""


@dataclass(frozen=True, eq=False)
class SkeletalMotion:
    """What a file of a skeleton holds, in its own axes and unit of length.

    Attributes:
        joints: Its joints, parents first.
        columns: What each value means, length C.
        values: Angles [rad] and translations [the file's unit], shape (T, C); NaN where missing.
        rate_hz: Frames per second [1/s].
        space: What the file says of its unit and axes.
    """

    joints: tuple[Joint, ...]
    columns: tuple[Column, ...]
    values: FloatArray
    rate_hz: float
    space: Space


def are_radians(
    values: FloatArray, columns: tuple[Column, ...], hints: Hints, findings: Findings
) -> bool:
    """Whether a file's angles, shape (T, C), are radians: none beyond a turn, and one travels far.

    In degrees that would be someone who stands in the zero pose to within 6 degrees, and moves.
    """
    if hints.angle_unit is not None:
        return hints.angle_unit == "radians"
    angles = values[:, [i for i, column in enumerate(columns) if column.rotates]]
    known = np.nan_to_num(angles)
    if len(known) < _FEW or np.abs(known).max(initial=0.0) > 2.0 * np.pi + 0.01:
        return False
    if np.ptp(known, axis=0).max(initial=0.0) < _MOVES:
        return False
    findings.warn(
        "the angles are taken as radians: none is beyond a turn of them "
        f"({option('angle_unit', 'degrees')} says otherwise)"
    )
    return True


def skeletal_recording(
    path: Path, motion: SkeletalMotion, hints: Hints, findings: Findings, *, positions: bool
) -> Recording:
    """Return a motion as a recording in metres, z up: where its joints are, or their angles.

    The unit and the vertical axis are settled by where the joints are, whichever is asked for.

    Args:
        path: The file.
        motion: What it holds.
        hints: What the caller says.
        findings: What came to light so far; more is added.
        positions: Whether the joints' positions are asked for.
    """
    joints = motion.joints
    names = tuple(joint.name for joint in joints)
    local = joint_positions(joints, motion.values)
    parents = [joint.parent for joint in joints]
    space = motion.space
    sized = unit_of_skeleton(local, parents, space.unit_m, says_so=space.says_unit)
    if sized is None and len({place_of(name).part for name in names} & HEIGHTS.keys()) < 2:
        findings.note(
            "no person by its joints: unit and vertical axis are those usual in the format"
        )
        findings.up_in_doubt = hints.up_axis is None
        hints = replace(
            hints, unit_m=hints.unit_m or space.unit_m, up_axis=hints.up_axis or space.up
        )
    place = placed(path, local, names, motion.rate_hz, space, hints, findings, sized, parents)
    if not positions:
        channels, frames = angle_channels(path, motion, place.axes, place.unit_m)
    elif hints.joint_axes:
        joints = with_axes(joints, place.unit_m)
        points = joint_positions(joints, motion.values) * place.unit_m @ place.axes.T
        channels = marker_channels(tuple(joint.name for joint in joints))
        frames = points.reshape(len(local), -1)
    else:
        channels, frames = marker_channels(names), place.points.reshape(len(local), -1)
    return Recording(
        frames,
        motion.rate_hz,
        channels,
        stem(path),
        cmu_subject(stem(path)),
        skeleton=skeleton_of(joints, motion.values, place.unit_m * place.axes),
        report=findings.report(motion.rate_hz, place.unit_m, place.up),
    )


def angle_channels(
    path: Path, motion: SkeletalMotion, axes: FloatArray, unit_m: float
) -> tuple[tuple[str, ...], FloatArray]:
    """Return a motion's columns by name; a joint's angles are a path, see `continuous_euler`.

    The root's axes are the world's: they get the name and the sign that the axis has once z points
    up. All others are axes of a bone and keep the file's name.

    Args:
        path: The file, for messages.
        motion: Its joints need no offsets.
        axes: Rotation from the file's axes to z up, shape (3, 3); it exchanges axes.
        unit_m: Length of the file's unit [m].

    Returns:
        Names, length C: ``lfemur.rx`` or ``root.tz``; angles [rad] and translations [m], shape
        (T, C).
    """
    values = motion.values.copy()
    for joint in motion.joints:
        order = "".join("XYZ"[int(axis.argmax())] for axis, _ in joint.rotations)
        own = [column for _, column in joint.rotations]
        if own:
            values[:, own] = continuous_euler(order, values[:, own])
    names = []
    for index, column in enumerate(motion.columns):
        axis, sign = column.axis, 1.0
        if column.of_root:
            axis = int(np.abs(axes[:, column.axis]).argmax())
            sign = float(axes[axis, column.axis])
        names.append(column.name or f"{column.joint}.{'r' if column.rotates else 't'}{'xyz'[axis]}")
        values[:, index] *= sign * (1.0 if column.rotates else unit_m)
    if len(set(names)) != len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise bad_file(path, f"channels {twice[:5]} more than once", "each channel once")
    return tuple(names), values


@dataclass(frozen=True, eq=False)
class Limbs:
    """A tree of joints whose rotations a file holds as such, without Euler angles.

    Attributes:
        names: Name of each joint, length J; parents stand before their children, the root first.
        parents: Index of each joint's parent, -1 for the root.
        offsets: Where each joint is in its parent's frame, shape (J, 3) [the file's unit].
        orders: Axes of the Euler angles that each joint's channels are, as ``"YXZ"``; empty for an
            end site. See `limb_order`.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: FloatArray
    orders: tuple[str, ...]

    def motion(
        self, rotations: FloatArray, places: FloatArray, rate_hz: float, space: Space
    ) -> SkeletalMotion:
        """Return how they move.

        Args:
            rotations: Of each joint against its parent, of the root against the world, shape
                (T, J, 3, 3); those of end sites do not count.
            places: Where the root is, shape (T, 3) [the file's unit].
            rate_hz: Frames per second [1/s].
            space: What the file says of its unit and axes.
        """
        root = self.names[0]
        columns = [Column(root, axis, rotates=False, of_root=True) for axis in range(3)]
        values = [places]
        joints = []
        for index, (name, order) in enumerate(zip(self.names, self.orders, strict=True)):
            first = len(columns)
            axes = ["XYZ".index(axis) for axis in order]
            columns += [Column(name, axis, rotates=True, of_root=index == 0) for axis in axes]
            if order:
                values.append(matrix_to_euler(order, rotations[:, index]))
            joints.append(
                Joint(
                    name,
                    self.parents[index],
                    self.offsets[index],
                    tuple((np.eye(3)[axis], first + i) for i, axis in enumerate(axes)),
                    ((0, 0), (1, 1), (2, 2)) if index == 0 else (),
                    is_end=not order,
                )
            )
        return SkeletalMotion(
            tuple(joints), tuple(columns), np.concatenate(values, axis=1), rate_hz, space
        )


def limb_order(name: str, *, is_root: bool) -> str:
    """Return the Euler order that keeps a joint of a person away from gimbal lock.

    For joints whose frames are the world's (x forward, y left, z up) in a T pose. The middle angle
    must not come near a right angle: the root heads, rolls and pitches; arms are lowered first;
    legs and trunk bend forward first.
    """
    if is_root:
        return "ZXY"
    arm = any(
        part in name.lower() for part in ("shoulder", "collar", "arm", "elbow", "wrist", "hand")
    )
    return "XYZ" if arm else "YXZ"

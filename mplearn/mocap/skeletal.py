"""From the columns of a skeletal file to a recording of joint angles or joint positions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..recording import FloatArray, Recording, marker_channels
from .files import bad_file, cmu_subject, stem
from .kinematics import Joint, joint_positions, skeleton_of
from .space import checked_markers


@dataclass(frozen=True)
class Column:
    """What a column of a skeletal file means.

    Attributes:
        joint: The joint it moves.
        axis: 0-2, the file's x, y or z.
        rotates: Whether it is an angle [rad], not a translation [m].
        of_root: Whether it is a part of the root's pose in the world.
    """

    joint: str
    axis: int
    rotates: bool
    of_root: bool = False

    def channel(self, axes: FloatArray) -> str:
        """Return its name, ``lfemur.rx`` or ``root.tz``.

        The root's axes are the world's: they get the name that the axis has once z points up. All
        others are axes of a bone and keep the file's name.
        """
        axis = int(np.abs(axes[:, self.axis]).argmax()) if self.of_root else self.axis
        return f"{self.joint}.{'r' if self.rotates else 't'}{'xyz'[axis]}"


def angle_recording(
    path: Path,
    columns: tuple[Column, ...],
    joints: tuple[Joint, ...],
    values: FloatArray,
    axes: FloatArray,
    rate_hz: float,
) -> Recording:
    """Return the columns as channels, angles free of jumps by a full turn.

    Args:
        path: The file.
        columns: What each column means, length C.
        joints: The joints that they move, parents first; empty where they are not known.
        values: Angles [rad] and translations [m], shape (T, C).
        axes: `to_z_up` of the file, a cyclic exchange of axes, so that angles keep their values.
        rate_hz: Frames per second [1/s].
    """
    skeleton = skeleton_of(joints, values, axes) if joints else None
    values = values.copy()
    turning = [i for i, column in enumerate(columns) if column.rotates]
    values[:, turning] = np.unwrap(values[:, turning], axis=0)
    channels = tuple(column.channel(axes) for column in columns)
    if len(set(channels)) != len(channels):
        twice = sorted({name for name in channels if channels.count(name) > 1})
        raise bad_file(path, f"channels {twice[:5]} more than once", "each channel once")
    return Recording(
        values, rate_hz, channels, stem(path), cmu_subject(stem(path)), skeleton=skeleton
    )


def position_recording(
    path: Path, joints: tuple[Joint, ...], values: FloatArray, axes: FloatArray, rate_hz: float
) -> Recording:
    """Return the joints' positions as markers; arguments as for `angle_recording`."""
    points = joint_positions(joints, values) @ axes.T
    names = tuple(joint.name for joint in joints)
    checked_markers(path, points, names)
    return Recording(
        points.reshape(len(points), -1),
        rate_hz,
        marker_channels(names),
        stem(path),
        cmu_subject(stem(path)),
        skeleton=skeleton_of(joints, values, axes),
    )

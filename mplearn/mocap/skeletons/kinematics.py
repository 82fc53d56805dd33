"""Forward kinematics of recorded skeletons, over all frames at once."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...maths.rotations import axis_angle_to_matrix
from ...recording import FloatArray, Skeleton

AXIS_M = 0.1
AXIS_MARK = ">"  # between a joint's name and the axis that a point shows

_IDENTITY = np.eye(3)


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint of a skeleton, at the near end of the bone that carries its name.

    Its frame is ``R_parent @ before @ R(axis_1) @ R(axis_2) ... @ after``.

    Attributes:
        name: Name of the joint.
        parent: Index of its parent, which stands before it; -1 for the root.
        offset: Its place in the parent's frame, shape (3,) [m].
        rotations: Axis (3,) and column of the values [rad] of each rotation, outermost first.
        translations: Axis 0-2 and column [m] of each moving coordinate; they replace the offset's.
        before: Rotation from the parent's frame to that of the angles, shape (3, 3).
        after: Rotation from the frame of the angles to the bone's, shape (3, 3).
        is_end: Whether it is where a chain ends, and turns nothing.
    """

    name: str
    parent: int
    offset: FloatArray
    rotations: tuple[tuple[FloatArray, int], ...] = ()
    translations: tuple[tuple[int, int], ...] = ()
    before: FloatArray = field(default_factory=lambda: _IDENTITY)
    after: FloatArray = field(default_factory=lambda: _IDENTITY)
    is_end: bool = False


def joint_positions(joints: tuple[Joint, ...], values: FloatArray) -> FloatArray:
    """Return where all joints are.

    Args:
        joints: J joints, parents first.
        values: Angles [rad] and translations [m], shape (T, C).

    Returns:
        Positions in the root's world, shape (T, J, 3) [m].
    """
    positions = np.empty((len(values), len(joints), 3))
    frames: list[FloatArray] = []
    for index, joint in enumerate(joints):
        place = np.broadcast_to(joint.offset, (len(values), 3))
        if joint.translations:
            place = place.copy()
            for axis, column in joint.translations:
                place[:, axis] = values[:, column]
        rotation = joint.before
        for direction, column in joint.rotations:
            rotation = rotation @ axis_angle_to_matrix(direction, values[:, column])
        rotation = rotation @ joint.after  # (3, 3) or (T, 3, 3)
        if joint.parent < 0:
            positions[:, index] = place
        else:
            parent = frames[joint.parent]
            positions[:, index] = positions[:, joint.parent] + (parent @ place[..., None])[..., 0]
            rotation = parent @ rotation
        frames.append(rotation)
    return positions


def with_axes(joints: tuple[Joint, ...], unit_m: float = 1.0) -> tuple[Joint, ...]:
    """Return joints with points on their axes, behind them: they show how each joint is turned.

    Each joint that turns gets three, `AXIS_M` along x, y, z of its own frame, as ``NAME>x``.

    Args:
        joints: Joints in any unit.
        unit_m: Length of the unit [m].
    """
    along = AXIS_M / unit_m * _IDENTITY
    return joints + tuple(
        Joint(f"{joint.name}{AXIS_MARK}{name}", index, along[axis], is_end=True)
        for index, joint in enumerate(joints)
        if not joint.is_end
        for axis, name in enumerate("xyz")
    )


def skeleton_of(joints: tuple[Joint, ...], values: FloatArray, axes: FloatArray) -> Skeleton:
    """Return the joints as a recording names them.

    A place that the recording moves (a joint's position channels) is taken at its median: most
    files that move more than the root repeat the bone's length in every frame.

    Args:
        joints: J joints, parents first.
        values: Angles [rad] and translations [m], shape (T, C).
        axes: Rotation from the file's axes to z up, shape (3, 3).
    """
    offsets = np.array([joint.offset for joint in joints])
    for joint, offset in zip(joints, offsets, strict=True):
        for axis, column in joint.translations:
            known = values[~np.isnan(values[:, column]), column]
            if joint.parent >= 0 and len(known):
                offset[axis] = np.median(known)
    still = tuple(
        Joint(joint.name, joint.parent, offset, (), (), joint.before, joint.after)
        for joint, offset in zip(joints, offsets, strict=True)
    )
    rest = joint_positions(still, np.zeros((1, 0)))[0] @ axes.T
    parents = tuple(joint.parent for joint in joints)
    hanging = [index for index, parent in enumerate(parents) if parent >= 0]
    from_parent = rest.copy()
    from_parent[hanging] -= rest[[parents[index] for index in hanging]]
    return Skeleton(
        tuple(joint.name for joint in joints),
        parents,
        from_parent,
        tuple(joint.is_end for joint in joints),
    )

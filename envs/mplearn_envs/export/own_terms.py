"""Postures of a described robot in the terms of the MJCF that it came from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.rotations import quaternion_to_matrix
from mplearn.recording import FloatArray
from mplearn_envs.robot import Robot

from .robot_model import RobotModel


class OwnTerms(NamedTuple):
    """Postures as those know them who have the robot's MJCF.

    Attributes:
        joint_names: The hinges, in its order.
        root_pos: Where the body is by which it floats, shape (T, 3) [m].
        root_quat: How that is turned (w, x, y, z), shape (T, 4).
        joint_pos: The hinges' angles in its zero, shape (T, n) [rad].
    """

    joint_names: tuple[str, ...]
    root_pos: FloatArray
    root_quat: FloatArray
    joint_pos: FloatArray


def in_own_terms(robot: Robot, postures: FloatArray) -> OwnTerms:
    """Return postures in the terms of the MJCF that a robot came from.

    Args:
        robot: The robot.
        postures: Its postures in the layout of qpos, shape (T, 7 + n).
    """
    pos = postures[:, :3]
    quat = postures[:, 3:7] / np.linalg.norm(postures[:, 3:7], axis=1, keepdims=True)
    angles = robot.signs * postures[:, 7:] + robot.attention_angles
    origin = robot.origin
    if origin is None:
        return OwnTerms(robot.joint_names, pos, quat, angles)
    from scipy.spatial.transform import Rotation

    ours = RobotModel(robot.name, robot.model(), np.zeros(len(robot.joint_names)))
    bodies = ours.forward(pos, quat, postures[:, 7:])
    b = ours.body_names.index(origin.base)
    turn = quaternion_to_matrix(bodies.quat[:, b])
    whole = Rotation.from_matrix(turn) * Rotation.from_quat(origin.quat, scalar_first=True)
    names = RobotModel.of(robot).joint_names
    return OwnTerms(
        names,
        bodies.pos[:, b] + turn @ np.array(origin.offset),
        whole.as_quat(scalar_first=True),
        angles[:, [robot.joint_names.index(name) for name in names]],
    )

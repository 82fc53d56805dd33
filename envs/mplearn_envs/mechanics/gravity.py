"""The torques that hold a posture up, which the servos' commands lead by."""

from __future__ import annotations

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.recording import FloatArray
from mplearn_envs.robot import Robot

from .kinematics import forward
from .reference import ReferenceRobot, reference_robot, sole_middles
from .support import GRAVITY

_SOLE_M = 0.1  # a foot carries within about this of its middle


def standing_commands(robot: Robot, q: FloatArray) -> FloatArray:
    """Return servo commands, shape (n,) [rad], that hold a posture (7 + n,) on both feet.

    Args:
        robot: The robot, its COG over the middle of its soles.
        q: The posture.
    """
    ref = reference_robot(robot)
    middles = sole_middles(ref, ref.ground[None])
    torque = holding_torques(ref, q[None], np.array([0.5]), middles.mean(axis=1), middles)
    return np.asarray(q[7:] + torque[0] / robot.per_joint("stiffness"))


@njit(cache=True, nogil=True)
def holding_torques(
    robot: ReferenceRobot, q: FloatArray, share: FloatArray, zmp: FloatArray, middles: FloatArray
) -> FloatArray:
    """Return the torques of all hinges against gravity, the feet carrying their shares.

    Args:
        robot: The reference robot.
        q: Postures, shape (T, 7 + n).
        share: Which share of the weight the left foot carries, shape (T,).
        zmp: Zero-moment points, shape (T, 2) [m].
        middles: Middles of the soles, shape (T, 2, 2) [m].

    Returns:
        Torques, shape (T, n) [N m].
    """
    tree, stance = robot.tree, robot.stance
    n_times, n_hinges = q.shape[0], len(tree.linkage.axis)
    out = np.empty((n_times, n_hinges))
    for t in range(n_times):
        pose = forward(tree, q[t])
        for j in range(n_hinges):
            body, axis, anchor = tree.linkage.joint_body[j], pose.axis[j], pose.anchor[j]
            x = pose.moment[body, 0] - pose.carried[body] * anchor[0]
            y = pose.moment[body, 1] - pose.carried[body] * anchor[1]
            out[t, j] = GRAVITY * (axis[0] * y - axis[1] * x)
        middle = share[t] * middles[t, 0] + (1.0 - share[t]) * middles[t, 1]
        off = np.minimum(np.maximum(zmp[t] - middle, -_SOLE_M), _SOLE_M)
        for k in range(stance.leg_joints.shape[0]):
            j, side = stance.leg_joints[k], stance.leg_side[k]
            carried = share[t] if side == 0 else 1.0 - share[t]
            lift = carried * pose.carried[0] * GRAVITY
            x = middles[t, side, 0] + off[0] - pose.anchor[j, 0]
            y = middles[t, side, 1] + off[1] - pose.anchor[j, 1]
            out[t, j] -= lift * (pose.axis[j, 0] * y - pose.axis[j, 1] * x)
    return out

"""What a reference motion asks of the joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mplearn.maths.rotation_kernels import quaternion_matrix
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.robot import Robot

from .kinematics import forward
from .reference import reference_robot
from .velocity_ik import FEET, add_leg_columns, jacobian_rows

if TYPE_CHECKING:
    import mujoco

_LEVER_M = 0.1  # a foot carries a moment as unwillingly as this lever's force


def free_model(robot: Robot) -> mujoco.MjModel:
    """Return the robot as MuJoCo has it, without ground, limits, servos and sensors."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(robot.xml)
    off = mujoco.mjtDisableBit
    model.opt.disableflags |= off.mjDSBL_CONSTRAINT | off.mjDSBL_ACTUATION | off.mjDSBL_SENSOR
    return model


class InverseDynamics:
    """Joint torques of reference motions (MuJoCo's ``mj_inverse``).

    The ground's whole reaction follows from the motion. How two feet share it does not: the share
    of smallest forces and moments is taken, and gives the legs' torques.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: Robot) -> None:
        import mujoco

        self.robot = robot
        self._reference = reference_robot(robot)
        self._model = free_model(robot)
        self._data = mujoco.MjData(self._model)
        self._torque = robot.per_joint("torque")

    def along(
        self, q: FloatArray, period_s: float, up: IntArray | None = None, smoothing: int = 2
    ) -> FloatArray:
        """Follow a motion.

        Args:
            q: Reference postures, shape (K, 7 + n), K >= 3.
            period_s: Time between them [s].
            up: Side of the foot in the air at each, -1 for none, shape (K,); None is none ever.
            smoothing: Accelerations are taken over this many periods to either side.

        Returns:
            Shares of the torque limits at S postures of the motion, shape (S, n).
        """
        import mujoco

        model, data = self._model, self._data
        step = min(smoothing, (len(q) - 1) // 2)
        span = step * period_s
        before, after = np.zeros(model.nv), np.zeros(model.nv)
        share = []
        for k in range(step, len(q) - step, step):
            mujoco.mj_differentiatePos(model, before, span, q[k - step], q[k])
            mujoco.mj_differentiatePos(model, after, span, q[k], q[k + step])
            data.qpos[:] = q[k]
            data.qvel[:] = 0.5 * (before + after)
            data.qacc[:] = (after - before) / span
            mujoco.mj_inverse(model, data)
            needed = data.qfrc_inverse.copy()
            needed[3:6] = quaternion_matrix(q[k, 3:7]) @ needed[3:6]
            lifted = -1 if up is None else int(up[k])
            share.append(np.abs(self._joint_torques(q[k], needed, lifted)) / self._torque)
        return np.array(share)

    def _joint_torques(self, q: FloatArray, needed: FloatArray, lifted: int) -> FloatArray:
        """Return the servos' torques, shape (n,), shared by the feet that stand."""
        tree, stance = self._reference.tree, self._reference.stance
        pose = forward(tree, q)
        jacobian = jacobian_rows(stance, pose)
        add_leg_columns(tree, stance, pose, jacobian)
        jacobian = jacobian[FEET]  # (12, 6 + n_legs)
        willing = np.tile([1.0, 1.0, 1.0, _LEVER_M, _LEVER_M, _LEVER_M], 2)
        if lifted >= 0:
            willing[6 * lifted : 6 * lifted + 6] = 0.0
        weighed = jacobian[:, :6].T * willing  # (6, 12)
        reaction = willing * (weighed.T @ np.linalg.solve(weighed @ weighed.T, needed[:6]))
        torque = needed[6:].copy()
        torque[stance.leg_joints] -= jacobian[:, 6:].T @ reaction
        return torque

"""Balance with both feet down: COG, hip height and base orientation by velocity IK.

[Kulic2012] 4.2.1, after Ott et al. (2008): gradient descent on the COG's and on the orientation's
error gives a desired COG velocity and a desired angular velocity of the base, which a
velocity-based inverse kinematics executes with the legs of a reference robot whose feet are fixed.
Pure gradient descent lags behind a moving target (5 degrees in a bow), so the wanted velocities are
fed forward.
"""

from __future__ import annotations

import numpy as np

from mplearn.maths.yaw_roll_pitch import roll_pitch_matrix
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.kinematics import forward, rotate_quaternion
from mplearn_envs.mechanics.reference import Reference, reference_robot
from mplearn_envs.mechanics.velocity_ik import (
    COG,
    FEET,
    HEIGHT,
    ORIENTATION,
    advance,
    errors,
    rates,
    settle,
)
from mplearn_envs.robot import Robot


class BalanceController:
    """The balancing law of the paper, one call a control period.

    Args:
        robot: The robot.
        gain: Of COG, height and orientation [1/s].
        foot_gain: Of the feet's positions and rotations [1/s].

    Example:
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.robot import humanoid
        >>> controller = BalanceController(humanoid())
        >>> reference = rest_reference(humanoid())
        >>> target = reference.target.copy()
        >>> target[0] -= 0.01  # a little into the knees
        >>> for _ in range(100):
        ...     reference = controller.update(reference, target, period_s=0.004)
        >>> controller.cog_error_m(reference) < 0.005
        True
    """

    def __init__(self, robot: Robot, gain: float = 8.0, foot_gain: float = 20.0) -> None:
        self.robot = robot
        self.gain = gain
        self.foot_gain = foot_gain
        self._reference = reference_robot(robot)
        self._gains = np.full(18, gain)
        self._gains[FEET] = foot_gain

    def update(self, reference: Reference, target: FloatArray, period_s: float) -> Reference:
        """Move the reference towards the next target; the upper body goes there, the legs balance.

        Args:
            reference: Where the reference robot is.
            target: Next tracked coordinates, shape (U,) [m, rad].
            period_s: Time from now to then [s].
        """
        robot = self._reference
        height_offset = robot.stance_height - robot.standing_height
        before = forward(robot.tree, reference.q)
        q = reference.q.copy()
        q[7 + robot.upper] = target[3:]
        pose = forward(robot.tree, q)
        moved = pose.moment[0, :2] - before.moment[0, :2]  # by the upper body alone
        now = errors(
            robot.stance,
            before,
            reference.target[0] + height_offset,
            roll_pitch_matrix(reference.target[1], reference.target[2]),
        )
        height, upright = target[0] + height_offset, roll_pitch_matrix(target[1], target[2])
        later = errors(robot.stance, before, height, upright)
        rows = self._gains * now * period_s
        rows[COG] -= moved / pose.carried[0]
        rows[ORIENTATION] += later[ORIENTATION] - now[ORIENTATION]
        q[3:7] = rotate_quaternion(q[3:7], rows[ORIENTATION])  # it lifts the hips in a bow
        bowed = errors(robot.stance, forward(robot.tree, q), height, upright)
        q[3:7] = reference.q[3:7]
        rows[HEIGHT] += bowed[HEIGHT] - now[HEIGHT]
        q = advance(robot.stance, q, rates(robot.tree, robot.stance, pose, rows))
        q, _ = settle(robot.tree, robot.stance, q, height, upright, 1e-9, 2)
        velocity = (target - reference.target) / period_s
        return reference._replace(target=target.copy(), velocity=velocity, q=q)

    def cog_error_m(self, reference: Reference) -> float:
        """Return how far the reference's COG is from where it shall stay, in the plane [m]."""
        pose = forward(self._reference.tree, reference.q)
        return float(
            np.linalg.norm(pose.moment[0, :2] / pose.carried[0] - self._reference.stance.cog)
        )

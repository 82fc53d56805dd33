"""How much of a stranger's posture is followed: as fast and as far as the robot keeps standing."""

from __future__ import annotations

from collections import deque

import numpy as np

from mplearn.maths.yaw_roll_pitch import roll_pitch_matrix
from mplearn.recording import FloatArray
from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.mechanics.reference import N_BASE
from mplearn_envs.mechanics.servos import approach
from mplearn_envs.mechanics.velocity_ik import settle
from mplearn_envs.robot import Robot

VELOCITY_SHARE = 0.6  # of the robot's velocity limits that is followed
RISE_S = 0.6  # in which a tracked coordinate may reach its velocity limit
_SMOOTHING_S = 0.04  # over which the limited motion is averaged: no jerks
_LEG_SHARE = 0.8  # of their velocity limits that the legs may need
_KNEE_SHARE = 0.5  # of the guard against straight knees that must be left
_MISS = 2e-3  # how far feet, COG and base may miss in a posture that balances [m, rad]
_NEAR = 1e-3  # how near one tries to come
_ITERATIONS = 10
_SHARE_A_SECOND = 2.0  # how fast what is followed of a posture may grow back


class Restraint:
    """Follows wanted postures no faster than the limits allow, no farther than the robot balances.

    Each period it moves so that the posture in which it could come to rest is one that the legs
    balance: first towards what is wanted; where that fails, with the base going back towards
    standing while the arms go on; where that fails, it brakes, towards the last such posture.

    Args:
        robot: The robot.
        period_s: Control period [s].

    Attributes:
        fastest: Velocity limits of the tracked coordinates, shape (U,) [m/s, rad/s].
        strongest: Acceleration limits, shape (U,) [m/s^2, rad/s^2].
        share: Which share of the wanted base's way from standing is followed, in [0, 1].
    """

    def __init__(self, robot: Robot, period_s: float) -> None:
        self._robot = reference_robot(robot)
        self.period_s = period_s
        self.fastest = VELOCITY_SHARE * self._robot.velocity
        self.strongest = self._robot.velocity / RISE_S
        self.share = 1.0
        self._q = self._robot.rest
        legs = robot.leg_joints
        self._leg_step = _LEG_SHARE * robot.per_joint("velocity")[legs] * period_s
        self._knees = np.array([7 + robot.joint_names.index(name) for name in robot.knees])
        self._least_knee = _KNEE_SHARE * robot.guard_knee_rad
        self._rest = rest_reference(robot).target
        self._wanted = self._stop = self._here = self._rest
        self._velocity = np.zeros_like(self._rest)
        self._recent = deque([self._rest], maxlen=max(1, round(_SMOOTHING_S / period_s)))

    @property
    def position(self) -> FloatArray:
        """Where the limited motion is before it is averaged, shape (U,) [m, rad]."""
        return self._here

    @property
    def velocity(self) -> FloatArray:
        """Its velocity, shape (U,) [m/s, rad/s]."""
        return self._velocity

    @property
    def stop(self) -> FloatArray:
        """Where it comes to rest if it brakes now, shape (U,) [m, rad]."""
        return self._stop

    def update(self, wanted: FloatArray) -> FloatArray:
        """Return what to do instead of a wanted posture, one period on; both of shape (U,)."""
        wanted = self._part(wanted, self.share)
        rate = (wanted - self._wanted) / self.period_s
        self._wanted = wanted
        still = np.zeros_like(rate)
        standing = self._part(wanted, 0.0)
        free = self._move(wanted, rate)
        change = _SHARE_A_SECOND * self.period_s
        self.share = min(1.0, self.share + change) if free else max(0.0, self.share - change)
        if not free and not self._move(standing, still):
            self._here, self._velocity = self._step(self._stop, still)
        self._recent.append(self._here)
        return np.asarray(np.mean(self._recent, axis=0))

    def _move(self, wanted: FloatArray, rate: FloatArray) -> bool:
        """Move one period towards a posture, if the robot can come to rest balanced from there."""
        here, velocity = self._step(wanted, rate)
        stop = here + 0.5 * velocity * np.abs(velocity) / self.strongest
        if not self._balances(stop):
            return False
        self._here, self._velocity, self._stop = here, velocity, stop
        return True

    def _step(self, wanted: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        return approach(
            wanted,
            rate,
            self._here,
            self._velocity,
            self._robot.limits,
            self.fastest,
            self.strongest,
            self.period_s,
        )

    def _part(self, wanted: FloatArray, share: float) -> FloatArray:
        out = wanted.copy()
        out[:N_BASE] = self._rest[:N_BASE] + share * (wanted - self._rest)[:N_BASE]
        return out

    def _balances(self, target: FloatArray) -> bool:
        """Look for legs that balance a posture: near the last ones, then near standing."""
        robot = self._robot
        height = target[0] + robot.stance_height - robot.standing_height
        turn = roll_pitch_matrix(target[1], target[2])
        q = self._q.copy()
        q[7 + robot.upper] = target[N_BASE:]
        q, miss = settle(robot.tree, robot.stance, q, height, turn, _NEAR, _ITERATIONS)
        moved = np.abs(q - self._q)[7 + robot.stance.leg_joints]
        straight = q[self._knees].min() < self._least_knee
        if miss > _MISS or straight or (moved > self._leg_step).any():
            return False
        self._q = q
        return True

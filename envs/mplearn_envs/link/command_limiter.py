"""The last thing before the servos: commands within limits of position, velocity, acceleration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.mechanics.servos import Bounds, approach
from mplearn_envs.robot import Robot

RISE_S = 0.05  # in which a command, which leads by its velocity, may reach its velocity limit
_ROUNDING = 1e-6  # of differences of commands, as a share of their limits


class Use(NamedTuple):
    """How much of their limits some commands used.

    Attributes:
        outside: How many were outside the limits of position, velocity and acceleration.
        fastest: Largest velocity as a share of its limit.
        strongest: Largest acceleration as a share of its limit.
    """

    outside: tuple[int, int, int]
    fastest: float
    strongest: float


class CommandLimiter:
    """Keeps servo commands within limits of position, velocity and acceleration, whatever comes.

    Args:
        robot: The robot.
        period_s: Control period [s].
        here: The commands at first, shape (n,) [rad].

    Attributes:
        limits: Smallest and largest command, shape (n, 2) [rad].
        fastest: Velocity limits, the joints' own, shape (n,) [rad/s].
        strongest: Acceleration limits, shape (n,) [rad/s^2].
    """

    def __init__(self, robot: Robot, period_s: float, here: FloatArray) -> None:
        self.limits = robot.position_limits.copy()
        self.fastest = robot.per_joint("velocity")
        self.strongest = self.fastest / RISE_S
        self.period_s = period_s
        self._wanted = self._here = np.clip(here, self.limits[:, 0], self.limits[:, 1])
        self._velocity = np.zeros_like(here)

    def update(self, wanted: FloatArray) -> FloatArray:
        """Return the commands of the next period, shape (n,) [rad]."""
        rate = (wanted - self._wanted) / self.period_s
        self._wanted = wanted
        bounds = Bounds(self.limits, self.fastest, self.strongest)
        self._here, self._velocity = approach(
            wanted, rate, self._here, self._velocity, bounds, self.period_s
        )
        return self._here

    def use(self, commands: FloatArray) -> Use:
        """Return how much of the limits commands used that were sent period by period, (T, n)."""
        low, high = self.limits.T
        speed = np.diff(commands, axis=0) / self.period_s
        velocity = np.abs(speed) / self.fastest
        acceleration = np.abs(np.diff(speed, axis=0)) / self.period_s / self.strongest
        outside = (
            int(((commands < low) | (commands > high)).sum()),
            int((velocity > 1.0 + _ROUNDING).sum()),
            int((acceleration > 1.0 + _ROUNDING).sum()),
        )
        return Use(outside, float(velocity.max(initial=0)), float(acceleration.max(initial=0)))

"""Feedback while a plan with steps is performed: the ankles hold the divergent part of the motion.

An inverted pendulum falls along its divergent component of motion (DCM), COG + velocity / rate
[Englsberger2015]. Pushing the zero-moment point beyond it, by torques of the standing ankles, makes
it return to its plan. Torques are small changes of the ankles' position commands.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mplearn.recording import FloatArray, IntArray
from mplearn_envs.robot import Robot

from .pendulum import pendulum_rate
from .plan import Plan
from .reference import reference_robot
from .support import GRAVITY

GAIN = 3.0  # zero-moment point per DCM error; 1 would just stop it from growing
LARGEST_M = 0.06  # shift of the zero-moment point


class Support(NamedTuple):
    """What the weight is seen from, along a motion of S postures.

    Attributes:
        share: Which share of the weight the left foot carries as planned, shape (S,).
        origin: Point between the feet that divides them as the weight, shape (S, 2) [m].
        heading: Yaw, between the feet's, shape (S,) [rad].
    """

    share: FloatArray
    origin: FloatArray
    heading: FloatArray

    def see(self, points: FloatArray) -> FloatArray:
        """Return points of the floor, (S, 2), as seen from here [m]."""
        x, y = (points - self.origin).T
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.stack((c * x + s * y, c * y - s * x), axis=-1)


def support(share: FloatArray, feet: FloatArray) -> Support:
    """Return from where the weight is seen.

    Args:
        share: Which share of it the left foot carries, shape (S,).
        feet: Where the feet are: x, y [m] and yaw [rad], shape (S, 2, 3).
    """
    weight = np.stack((share, 1.0 - share), axis=1)[..., None]
    place = (weight * feet[..., :2]).sum(axis=1)
    ahead = (weight * np.stack((np.cos(feet[..., 2]), np.sin(feet[..., 2])), axis=-1)).sum(axis=1)
    return Support(share, place, np.arctan2(ahead[:, 1], ahead[:, 0]))


class Guide:
    """Corrects the commands of one plan, step by step.

    Args:
        robot: The robot.
        plan: What it performs.
        gain: Shift of the zero-moment point per error of the DCM.
        largest_m: Largest shift [m].
    """

    def __init__(
        self, robot: Robot, plan: Plan, gain: float = GAIN, largest_m: float = LARGEST_M
    ) -> None:
        ref = reference_robot(robot)
        share = plan.share
        seen = support(share, plan.ground)
        self.rate = pendulum_rate(float(plan.cog[:, 2].mean()))
        cog = plan.cog[:, :2]
        dcm = seen.see(cog + np.gradient(cog, plan.knot_s, axis=0) / self.rate)
        n_knots = len(plan.q) - 1
        at = np.arange(1.0, len(plan.commands) + 1.0) * (n_knots / len(plan.commands))
        knots = np.arange(n_knots + 1.0)
        self.wanted = np.stack([np.interp(at, knots, x) for x in (*dcm.T, share)], axis=1)
        self.gain, self.largest_m = gain, largest_m
        self._ankles, self._sides = ankles(robot)
        weight = float(ref.tree.mass.sum()) * GRAVITY
        self._softness = weight / robot.per_joint("stiffness")[self._ankles]
        self._limits = robot.position_limits[self._ankles]

    def correct(
        self,
        step: int,
        command: FloatArray,
        cog: FloatArray,
        velocity: FloatArray,
        feet: FloatArray,
        turns: FloatArray,
        axes: FloatArray,
    ) -> None:
        """Change the ankles' commands in place.

        Args:
            step: Which of the plan's commands comes next.
            command: It, shape (n,) [rad].
            cog: Measured COG, shape (3,) [m].
            velocity: Its velocity, shape (3,) [m/s].
            feet: Positions of the feet, shape (2, 3) [m].
            turns: Their orientations, rows of matrices, shape (2, 9).
            axes: Axes of all joints, the free one first, shape (1 + n, 3).
        """
        _correct(
            self.wanted[step],
            command,
            cog,
            velocity,
            feet,
            turns,
            axes,
            self.rate,
            self.gain,
            self.largest_m,
            self._ankles,
            self._sides,
            self._softness,
            self._limits,
        )


def ankles(robot: Robot) -> tuple[IntArray, IntArray]:
    """Return the hinges between shanks and feet, and which side each is on, shape (A,) each."""
    hinges, sides = [], []
    for side, leg in enumerate(robot.legs):
        below = leg[leg.index(robot.knees[side]) + 1 :]
        hinges += [robot.joint_names.index(name) for name in below]
        sides += [side] * len(below)
    return np.array(hinges, np.int64), np.array(sides, np.int64)


@njit(cache=True)
def _correct(
    wanted: FloatArray,
    command: FloatArray,
    cog: FloatArray,
    velocity: FloatArray,
    feet: FloatArray,
    turns: FloatArray,
    axes: FloatArray,
    rate: float,
    gain: float,
    largest: float,
    ankles: IntArray,
    sides: IntArray,
    softness: FloatArray,
    limits: FloatArray,
) -> None:
    left = wanted[2]
    right = 1.0 - left
    c = left * turns[0, 0] + right * turns[1, 0]
    s = left * turns[0, 3] + right * turns[1, 3]
    length = np.sqrt(c * c + s * s)
    c, s = c / length, s / length
    x = cog[0] + velocity[0] / rate - left * feet[0, 0] - right * feet[1, 0]
    y = cog[1] + velocity[1] / rate - left * feet[0, 1] - right * feet[1, 1]
    x = gain * (x - c * wanted[0] + s * wanted[1])
    y = gain * (y - s * wanted[0] - c * wanted[1])
    size = np.sqrt(x * x + y * y)
    if size > largest:
        x, y = x * largest / size, y * largest / size
    for k in range(ankles.shape[0]):
        j = ankles[k]
        axis = axes[j + 1]
        carried = left if sides[k] == 0 else right
        change = carried * softness[k] * (axis[1] * x - axis[0] * y)
        command[j] = min(max(command[j] + change, limits[k, 0]), limits[k, 1])

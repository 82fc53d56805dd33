"""Feedback while a plan with steps is performed: the ankles hold the divergent part of the motion.

An inverted pendulum falls along its divergent component of motion (DCM), COG + velocity / rate
[Englsberger2015]. Pushing the zero-moment point beyond it, by torques of the standing ankles, makes
it return to its plan. Torques are small changes of the ankles' position commands.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import kernel
from mplearn.maths.plane import turn_in_plane
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.mechanics.heels import foot_places, on_toes
from mplearn_envs.mechanics.pendulum import pendulum_rate
from mplearn_envs.mechanics.reference import reference_robot
from mplearn_envs.mechanics.support import GRAVITY
from mplearn_envs.mechanics.views import Views
from mplearn_envs.planning.plan import Plan
from mplearn_envs.robot import Robot

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
        return np.stack(turn_in_plane(x, y, -self.heading), axis=-1)


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


class AnkleFeedback(NamedTuple):
    """What corrects the commands of one plan, step by step.

    Attributes:
        wanted: DCM seen from the feet (x, y) [m], the left foot's share of the weight, and how
            flat the left and the right sole lie, 0 to 1, after each command, shape (N, 5); nothing
            is corrected where there is none.
        rate: Of the pendulum [1/s].
        gain: Shift of the zero-moment point per error of the DCM.
        largest_m: Largest shift [m].
        ankles: Hinges between shanks and feet, shape (A,).
        sides: Side of each, 0 left, 1 right, shape (A,).
        softness: Change of their commands per shift, shape (A,) [rad/m].
        limits: Limits of their commands, shape (A, 2) [rad].
    """

    wanted: FloatArray
    rate: float
    gain: float
    largest_m: float
    ankles: IntArray
    sides: IntArray
    softness: FloatArray
    limits: FloatArray


def make_ankle_feedback(
    robot: Robot,
    plan: Plan,
    corrects: bool = True,
    gain: float = GAIN,
    largest_m: float = LARGEST_M,
) -> AnkleFeedback:
    """Return what corrects the commands of a plan.

    Args:
        robot: The robot.
        plan: What it performs.
        corrects: Whether anything shall be corrected at all.
        gain: Shift of the zero-moment point per error of the DCM.
        largest_m: Largest shift [m].
    """
    ref = reference_robot(robot)
    hinges, sides = ankles(robot)
    weight = float(ref.tree.mass.sum()) * GRAVITY
    return AnkleFeedback(
        _wanted(robot, plan) if corrects else np.empty((0, 5)),
        pendulum_rate(float(plan.cog[:, 2].mean())),
        gain,
        largest_m,
        hinges,
        sides,
        weight / robot.per_joint("stiffness")[hinges],
        robot.position_limits[hinges],
    )


def _wanted(robot: Robot, plan: Plan) -> FloatArray:
    """Return what a plan wants after each command, see `AnkleFeedback`, shape (N, 5).

    The ankle of a foot whose heel is raised moves no weight: the sole would turn about its edge.
    """
    cog, rate = plan.cog[:, :2], pendulum_rate(float(plan.cog[:, 2].mean()))
    feet = foot_places(reference_robot(robot).corners, plan.ground, plan.heel)
    seen = support(plan.share, feet)
    dcm = seen.see(cog + np.gradient(cog, plan.knot_s, axis=0) / rate)
    n_knots = len(plan.q) - 1
    at = np.arange(1.0, len(plan.commands) + 1.0) * (n_knots / len(plan.commands))
    knots = np.arange(n_knots + 1.0)
    flat = 1.0 - on_toes(plan.heel).T
    return np.stack([np.interp(at, knots, x) for x in (*dcm.T, plan.share, *flat)], axis=1)


def ankles(robot: Robot) -> tuple[IntArray, IntArray]:
    """Return the hinges between shanks and feet, and which side each is on, shape (A,) each."""
    hinges, sides = [], []
    for side, leg in enumerate(robot.legs):
        below = leg[leg.index(robot.knees[side]) + 1 :]
        hinges += [robot.joint_names.index(name) for name in below]
        sides += [side] * len(below)
    return np.array(hinges, np.int64), np.array(sides, np.int64)


@kernel
def correct(law: AnkleFeedback, step: int, views: Views) -> float:
    """Change the ankles' commands in place; return how far the DCM is from where it shall be [m].

    Args:
        law: What is wanted.
        step: Which of the plan's commands comes next.
        views: The robot as it stands, velocities of subtrees up to date, and that command.
    """
    wanted, command = law.wanted[step], views.ctrl
    cog, velocity = views.subtree_com[1], views.subtree_linvel[1]
    left_foot, right_foot = views.xpos[views.feet[0]], views.xpos[views.feet[1]]
    left_turn, right_turn = views.xmat[views.feet[0]], views.xmat[views.feet[1]]
    left = wanted[2]
    right = 1.0 - left
    c = left * left_turn[0] + right * right_turn[0]
    s = left * left_turn[3] + right * right_turn[3]
    length = np.sqrt(c * c + s * s)
    c, s = c / length, s / length
    x = cog[0] + velocity[0] / law.rate - left * left_foot[0] - right * right_foot[0]
    y = cog[1] + velocity[1] / law.rate - left * left_foot[1] - right * right_foot[1]
    x = law.gain * (x - c * wanted[0] + s * wanted[1])
    y = law.gain * (y - s * wanted[0] - c * wanted[1])
    size = np.sqrt(x * x + y * y)
    if size > law.largest_m:
        x, y = x * law.largest_m / size, y * law.largest_m / size
    for k in range(law.ankles.shape[0]):
        j = law.ankles[k]
        axis = views.xaxis[j + 1]
        carried = (left if law.sides[k] == 0 else right) * wanted[3 + law.sides[k]]
        change = carried * law.softness[k] * (axis[1] * x - axis[0] * y)
        low, high = law.limits[k]
        command[j] = min(max(command[j] + change, low), high)
    return float(size / law.gain)

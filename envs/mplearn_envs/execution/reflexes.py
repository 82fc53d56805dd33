"""A plan is performed by a robot that may be pushed: it steps where it would fall otherwise."""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np

from mplearn.maths.compiling import kernel
from mplearn.maths.easing import minimum_jerk
from mplearn.maths.rotation_kernels import turn_about_vertical
from mplearn.maths.yaw_roll_pitch import roll_pitch_matrix, roll_pitch_of
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.control.ankle_feedback import AnkleFeedback, correct, make_ankle_feedback
from mplearn_envs.control.body_state import body_state_of
from mplearn_envs.control.capture import Reach
from mplearn_envs.control.stepping import (
    StepLaw,
    StepState,
    begin_stepping,
    new_step_state,
    plan_step,
    settled,
    swinging,
)
from mplearn_envs.control.whole_body import BodyLaw, Upper, command_legs, wanted_acceleration
from mplearn_envs.mechanics.gravity import holding_torques
from mplearn_envs.mechanics.inverse_dynamics import free_model
from mplearn_envs.mechanics.kinematics import places
from mplearn_envs.mechanics.reference import (
    Reference,
    ReferenceRobot,
    reference_robot,
    rest_reference,
    sole_middles,
)
from mplearn_envs.mechanics.velocity_ik import settle
from mplearn_envs.planning.plan import Plan
from mplearn_envs.planning.planner import GRID_DECIMALS
from mplearn_envs.planning.stride import recentred
from mplearn_envs.robot import Robot

from .mujoco_loop import Simulated, Track, mj_inverse, mj_step1, mj_step2, mj_subtree_velocity
from .tracking_report import FALL_DROP_M, has_fallen

ASTRAY_M = 0.06  # a DCM so far from its plan wakes the reflexes
TILTED = 0.99  # as does a base so tilted against its plan (cosine)
_REACHED = 1e-3  # [m, rad]
LONGEST_S = 8.0  # after the end of a plan for which the robot may still be on its way back
RESTS_S = 0.3
_BLEND_S = 0.5
_PAST_M = 0.02  # between soles that pass each other
_BESIDE_M = 0.01  # between soles where one comes down beside the other
_CROSS_M = 0.06  # as much more a foot is ahead of the other one so that legs can cross
_DROP_M = 0.35  # who steps may be so much lower
_TUNED: dict[str, Any] = {  # on pushes at the chest of the humanoid
    "reach": Reach(0.5, 0.4, 0.16, 0.62, 2.2, 0.24, across=0.1, inwards=0.05),
    "hurried_s": 0.2,
    "gently": 60.0,
    "inside": 0.01,
    "decides_s": 0.1,
    "gain": 4.0,
    "lift_m": 0.035,
    "friction": 0.6,
    "moment": 1.0,
    "turn": 30.0,
    "foot": 80.0,
    "foot_turn": 100.0,
    "crouch_m": 0.08,
    "drop": 3.0,
    "rise": 8.0,
    "ahead": 0.0,
    "watch": 60.0,
    "learns": 0.05,
}


class Pushes(NamedTuple):
    """Forces on one body while a plan is performed.

    Attributes:
        body: Which body, at its centre of mass.
        steps: First and last step (excluded) of each push, shape (P, 2).
        force: Its force, shape (P, 3) [N].
    """

    body: int
    steps: IntArray
    force: FloatArray


NO_PUSHES = Pushes(0, np.empty((0, 2), np.int64), np.empty((0, 3)))


class PlannedMotion(NamedTuple):
    """What a plan of K knots and N commands wants, as the loop needs it.

    Attributes:
        commands: Servo commands, shape (N, n) [rad].
        q: Reference postures, shape (K + 1, 7 + n).
        base: Height [m], roll and pitch [rad] of the base, shape (K + 1, 3).
        rate: Velocities of the tracked hinges, shape (K + 1, U - 3) [rad/s].
        change: Their accelerations, shape (K + 1, U - 3) [rad/s^2].
        up: Side of the foot in the air, -1 for none, shape (K + 1,).
    """

    commands: FloatArray
    q: FloatArray
    base: FloatArray
    rate: FloatArray
    change: FloatArray
    up: IntArray


class OwnModel(NamedTuple):
    """What the robot reckons with: its own model of itself, without the ground.

    Attributes:
        model: Address of the model.
        data: Address of its state; the other fields are named as those of ``MjData``.
    """

    model: int
    data: int
    qpos: FloatArray
    qvel: FloatArray
    qacc: FloatArray
    qfrc_inverse: FloatArray


class Balance(NamedTuple):
    """How a robot keeps its balance.

    Attributes:
        robot: The robot as it knows itself.
        own: Its own model of itself.
        ankles: What corrects commands as long as no step is needed.
        law: What stepping goes by.
        body: What the whole body's control goes by.
    """

    robot: ReferenceRobot
    own: OwnModel
    ankles: AnkleFeedback
    law: StepLaw
    body: BodyLaw


class Reflexes:
    """What a robot needs to balance by steps.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.reference = reference_robot(robot)
        self._model = free_model(robot)
        self._data = mujoco.MjData(self._model)
        state = (getattr(self._data, name) for name in OwnModel._fields[2:])
        self._own = OwnModel(self._model._address, self._data._address, *state)
        limits = robot.position_limits.copy()
        for knee in robot.knees:
            j = robot.joint_names.index(knee)
            limits[j, 0] = max(limits[j, 0], 0.5 * robot.guard_knee_rad)
        ground = self.reference.ground
        long, wide = np.ptp(self.reference.corners[..., :2], axis=1).max(axis=0) + _PAST_M
        period_s = float(self._model.opt.timestep)
        reach = _TUNED["reach"]._replace(clear=float(long) + _CROSS_M, apart=float(wide))
        hurried = {name: _TUNED[name] for name in ("gently", "inside")}
        hurried |= {"soonest": _TUNED["hurried_s"], "close": float(wide) - _PAST_M + _BESIDE_M}
        self.law = StepLaw(
            period_s,
            _TUNED["gain"],
            reach,
            reach._replace(**hurried),
            np.append(ground[0, :2] - ground[1, :2], 0.0),
            _TUNED["lift_m"],
            _TUNED["decides_s"],
        )
        self.body = BodyLaw(
            period_s,
            robot.per_joint("stiffness"),
            robot.per_joint("damping"),
            robot.per_joint("torque"),
            limits,
            *(
                _TUNED[name]
                for name in (
                    "friction",
                    "moment",
                    "turn",
                    "foot",
                    "foot_turn",
                    "crouch_m",
                    "drop",
                    "rise",
                    "ahead",
                    "watch",
                    "learns",
                )
            ),
        )

    def balance(self, plan: Plan) -> Balance:
        """Return how the balance is kept while a plan is performed."""
        ankles = make_ankle_feedback(self.robot, plan)
        return Balance(self.reference, self._own, ankles, self.law, self.body)

    def planned(self, plan: Plan) -> PlannedMotion:
        """Return what a plan wants."""
        q = plan.q
        roll, pitch = np.array([roll_pitch_of(row) for row in q[:, 3:7]]).T
        hinges = q[:, 7 + self.reference.upper]
        rate = np.gradient(hinges, plan.knot_s, axis=0)
        change = np.gradient(rate, plan.knot_s, axis=0)
        base = np.column_stack((q[:, 2], roll, pitch))
        return PlannedMotion(plan.commands, q, base, rate, change, plan.up.astype(np.int64))

    def arrival(self, plan: Plan, q: FloatArray) -> Reference:
        """Return the reference robot at rest where a robot that has stepped stands.

        Args:
            plan: What it performed meanwhile: the upper body is as at its end.
            q: How it stands, shape (7 + n,).
        """
        ref = self.reference
        now = body_state_of(ref, q, np.zeros(len(q) - 1), self.law.period_s, -1)
        posture, ground = recentred(q, now.feet)
        rest = rest_reference(self.robot)
        end = plan.end.target
        for target in (end, np.concatenate((rest.target[:3], end[3:]))):
            stance = ref.stance._replace(
                foot_position=np.column_stack((ground[:, :2], ref.stance.foot_position[:, 2])),
                foot_rotation=np.stack(
                    [
                        turn_about_vertical(float(yaw), flat)
                        for yaw, flat in zip(ground[:, 2], ref.stance.foot_rotation, strict=True)
                    ]
                ),
                cog=sole_middles(ref, ground).mean(axis=0),
            )
            guess = posture.copy()
            guess[7 + ref.upper] = target[3:]
            height = float(target[0]) + ref.stance_height - ref.standing_height
            upright = roll_pitch_matrix(float(target[1]), float(target[2]))
            found, worst = settle(ref.tree, stance, guess, height, upright, 1e-8, 50)
            if worst < _REACHED:
                break
        still, swing = np.zeros_like(target), np.zeros_like(rest.swing)
        parts = (target, still, found, rest.swing, swing, np.zeros(2), ground, np.zeros(2))
        return Reference(*(np.round(part, GRID_DECIMALS) for part in parts))

    def return_commands(self, arrival: Reference, commands: FloatArray) -> FloatArray:
        """Return the commands that bring the robot from what it is commanded to the reference."""
        ref = self.reference
        middles = sole_middles(ref, arrival.ground)[None]
        share = np.array([0.5])
        torque = holding_torques(ref, arrival.q[None], share, middles.mean(axis=1), middles)[0]
        there = arrival.q[7:] + torque / self.robot.per_joint("stiffness")
        n = round(_BLEND_S / self.law.period_s)
        x = minimum_jerk((np.arange(n) + 1.0) / n)[:, None]
        return np.asarray(commands * (1.0 - x) + there * x)


class Progress(NamedTuple):
    """Where a robot is in a plan; arrays, changed in place.

    Attributes:
        knot: Of the plan, at which the robot is, shape (1,).
        stepping: What stepping remembers.
        by_steps: 1 once the robot balances by steps, shape (1,).
        command: What the servos got last, shape (n,) [rad].
        adapted: What joints miss, see `command_legs`, shape (3, n).
        late: Commands that have not reached the servos yet, shape (lag, n) [rad].
    """

    knot: IntArray
    stepping: StepState
    by_steps: IntArray
    command: FloatArray
    adapted: FloatArray
    late: FloatArray


def new_progress(command: FloatArray, lag: int) -> Progress:
    """Return the start of a plan.

    Args:
        command: What the servos got last, shape (n,) [rad].
        lag: By how many control periods commands come late.
    """
    late = np.repeat(command[None], lag, axis=0)
    adapted = np.zeros((3, len(command)))
    knot, by_steps = np.zeros((2, 1), np.int64)
    return Progress(knot, new_step_state(), by_steps, command.copy(), adapted, late)


@kernel
def send_with_steps(
    simulated: Simulated,
    balance: Balance,
    planned: PlannedMotion,
    pushes: Pushes,
    progress: Progress,
    track: Track,
    last: int,
) -> tuple[bool, bool]:
    """Send the commands of a plan of K knots from where the robot is to a knot, or until a fall.

    Knots beyond the last are those of a robot that is still stepping back.

    Args:
        simulated: The simulated robot.
        balance: How it keeps its balance.
        planned: What the plan wants.
        pushes: What pushes the robot.
        progress: Where the robot is in the plan.
        track: Filled at the plan's knots after the first.
        last: Where to stop.

    Returns:
        Whether it has fallen, and whether all is over.
    """
    model, data, views = simulated.model, simulated.data, simulated.views
    robot, own, law, body = balance.robot, balance.own, balance.law, balance.body
    stepping, adapted, h = progress.stepping, progress.adapted, law.period_s
    n_knots = planned.q.shape[0] - 1
    n_steps = planned.commands.shape[0] // n_knots
    still = np.zeros(planned.rate.shape[1])
    for knot in range(progress.knot[0] + 1, last + 1):
        at = min(knot, n_knots)
        for step in range((knot - 1) * n_steps, knot * n_steps):
            views.ctrl[:] = planned.commands[min(step, n_knots * n_steps - 1)]
            views.xfrc_applied[pushes.body, :3] = 0.0
            for p in range(pushes.steps.shape[0]):
                if pushes.steps[p, 0] <= step < pushes.steps[p, 1]:
                    views.xfrc_applied[pushes.body, :3] += pushes.force[p]
            mj_step1(model, data)
            begins = False
            if progress.by_steps[0] == 0:
                mj_subtree_velocity(model, data)
                begins = correct(balance.ankles, step, views) > ASTRAY_M
            if begins:
                progress.by_steps[0] = 1
            if progress.by_steps[0] == 1:
                up = planned.up[at] if begins else swinging(stepping)
                now = body_state_of(robot, views.qpos.copy(), views.qvel.copy(), h, up)
                if begins:
                    begin_stepping(law, robot, stepping, now, up)
                    adapted[0], adapted[1] = now.v[6:], 0.0
                zmp_x, zmp_y = plan_step(law, robot, stepping, now)
                over = knot > n_knots
                upper = Upper(
                    planned.base[at],
                    still if over else planned.rate[at],
                    still if over else planned.change[at],
                )
                change = wanted_acceleration(body, robot, stepping, now, upper, zmp_x, zmp_y)
                own.qpos[:], own.qvel[:], own.qacc[:] = views.qpos, views.qvel, change
                mj_inverse(own.model, own.data)
                command_legs(
                    body, robot, stepping, now, change, own.qfrc_inverse, views.ctrl, adapted
                )
            progress.command[:] = views.ctrl
            if progress.late.shape[0] > 0:
                slot = step % progress.late.shape[0]
                views.ctrl[:] = progress.late[slot]
                progress.late[slot] = progress.command
            mj_step2(model, data)
        progress.knot[0] = knot
        if knot <= n_knots:
            track.q[knot], track.v[knot] = views.qpos, views.qvel
        drop = _DROP_M if progress.by_steps[0] == 1 else FALL_DROP_M
        if has_fallen(views.qpos, planned.q[at], drop):
            return True, True
        if knot >= n_knots:
            if progress.by_steps[0] == 0:
                return False, True
            feet = places(robot.tree, robot.stance.feet, views.qpos.reshape(1, -1))[0]
            if settled(law, stepping, feet, RESTS_S):
                return False, True
    return False, False

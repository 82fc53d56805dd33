"""Torques of the legs that make weight, base and feet move as wanted.

Wanted accelerations of the feet, the weight (an inverted pendulum on the wanted zero-moment point)
and the base give those of the legs, by the Jacobian of [Kulic2012] 4.2.1; inverse dynamics gives
what the ground has to do for that, the soles do what is nearest to it (`contact_forces`), and the
legs' torques follow. The servos get positions and velocities that make these torques.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import inlined
from mplearn.maths.plane import wrap_angle
from mplearn.maths.rotation_kernels import rotation_error, turn_about_vertical
from mplearn.maths.solvers import solve_damped
from mplearn.maths.yaw_roll_pitch import roll_pitch_matrix
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.ground_forces import contact_forces
from mplearn_envs.mechanics.kinematics import cross, forward
from mplearn_envs.mechanics.reference import ReferenceRobot
from mplearn_envs.mechanics.velocity_ik import (
    COG,
    HEIGHT,
    ORIENTATION,
    add_leg_columns,
    jacobian_rows,
)

from .body_state import BodyState, in_base
from .stepping import SHIFTS, StepState, swinging

# Gains [1/s^2, 1/s] and largest accelerations, of 30 rad/s for a foot on its way.
_SWING = (900.0, 60.0)
_STANDING = (200.0, 50.0)
_HEIGHT = (250.0, 30.0)
_BASE = (70.0, 17.0)
_SWING_WEIGHT = 0.2  # of the foot on its way, where not all can be had
_DAMPING = 0.05
_AHEAD_S = 0.1  # the base is lowered for where it will be
_REACH = 0.985  # of the leg
_NEAR_M = 0.02  # a foot so near to the floor stands on its whole sole, or soon will
_PROBE_S = 1e-3
_COG, _TURN = COG.start, ORIENTATION.start  # rows of the Jacobian
_FORGETS, _MOST_TORQUE = 0.97, 0.4  # a period; share of the torque limit
_WRONG = 0.25  # share of a velocity's gain by which a servo may be wrong
_STILL = 0.5  # (rad/s)^2: from slower joints less is learned
_NEAR_LIMIT = 0.2  # share of the way to a joint's limit in one period


class BodyLaw(NamedTuple):
    """What the whole body's control goes by.

    Attributes:
        period_s: Control period [s].
        stiffness: Gain of each servo, shape (n,) [N m/rad].
        damping: Its velocity gain, shape (n,) [N m s/rad].
        torque: Torque limits, shape (n,) [N m].
        limits: Limits of the joints' angles, shape (n, 2) [rad].
        friction: Coefficient that is counted on.
        moment: How much a moment about the COG [N m] counts against a force [N].
        turn: Largest angular acceleration of the base [rad/s^2].
        foot: Largest acceleration of a foot on its way [m/s^2].
        foot_turn: Its largest angular acceleration [rad/s^2].
        crouch_m: How much the base is lower as soon as steps are taken [m].
        drop: Largest acceleration of the base downwards [m/s^2]: who drops has no weight to push
            himself off with.
        rise: And upwards [m/s^2].
        ahead: Which share of its acceleration a foot on its way is given ahead.
        watch: How much of what a joint's velocity misses in a period is made up for by torque in
            the leg on its way [N m s/rad]; not while its foot is held by the floor.
        learns: How fast a joint learns by which share of its velocity's gain its servo is wrong.
    """

    period_s: float
    stiffness: FloatArray
    damping: FloatArray
    torque: FloatArray
    limits: FloatArray
    friction: float
    moment: float
    turn: float
    foot: float
    foot_turn: float
    crouch_m: float
    drop: float
    rise: float
    ahead: float
    watch: float
    learns: float


class Upper(NamedTuple):
    """What the rest of the body does meanwhile.

    Attributes:
        base: Height [m], roll and pitch [rad] that the base shall have, shape (3,).
        rate: Velocities of the tracked hinges, shape (U - 3,) [rad/s].
        change: Their accelerations, shape (U - 3,) [rad/s^2].
    """

    base: FloatArray
    rate: FloatArray
    change: FloatArray


@inlined
def wanted_acceleration(
    law: BodyLaw,
    robot: ReferenceRobot,
    stepping: StepState,
    now: BodyState,
    upper: Upper,
    zmp_x: float,
    zmp_y: float,
) -> FloatArray:
    """Return the acceleration that the robot shall have, layout of qacc, shape (6 + n,).

    Args:
        law: What control goes by.
        robot: The reference robot.
        stepping: Which foot is where on its way.
        now: The moment.
        upper: What the rest of the body does.
        zmp_x: Where the zero-moment point shall be [m].
        zmp_y: The same.
    """
    stance, period_s = robot.stance, law.period_s
    swings = swinging(stepping)
    change = np.empty(18)
    for side in range(2):
        _foot(law, robot, stepping, now, side, side == swings, change[6 * side : 6 * side + 6])
    push = now.rate * now.rate
    change[_COG] = push * (now.cog[0] - zmp_x)
    change[_COG + 1] = push * (now.cog[1] - zmp_y)
    height = _height(law, robot, stepping, now, upper.base[0])
    lift = _HEIGHT[0] * (height + now.floor - now.q[2]) - _HEIGHT[1] * now.v[2]
    change[HEIGHT] = min(max(lift, -law.drop), law.rise)
    yaw = now.feet[0, 2] + 0.5 * wrap_angle(now.feet[1, 2] - now.feet[0, 2])
    upright = turn_about_vertical(yaw, roll_pitch_matrix(upper.base[1], upper.base[2]))
    turn = rotation_error(upright, now.pose.rotation[0])
    for i in range(3):
        a = _BASE[0] * turn[i] - _BASE[1] * now.spin[i]
        change[_TURN + i] = min(max(a, -law.turn), law.turn)

    # velocities that these make in one period, less those that there are
    n_legs = stance.leg_joints.shape[0]
    jacobian = jacobian_rows(stance, now.after)
    add_leg_columns(robot.tree, stance, now.after, jacobian)
    here = np.empty(6 + n_legs)
    here[:3], here[3:6] = now.v[:3], now.spin
    for k in range(n_legs):
        here[6 + k] = now.v[6 + stance.leg_joints[k]]
    rows = period_s * change - jacobian @ here
    for side in range(2):
        rows[6 * side : 6 * side + 6] += now.foot_rate[side]
    by_upper = _cog_rate_of(robot, now, upper.rate)
    rows[_COG : _COG + 2] += now.cog_rate[:2] - by_upper[:2]
    rows[HEIGHT] += now.v[2]
    rows[_TURN : _TURN + 3] += now.spin
    if swings >= 0:
        jacobian[6 * swings : 6 * swings + 6] *= _SWING_WEIGHT
        rows[6 * swings : 6 * swings + 6] *= _SWING_WEIGHT
    step = solve_damped(jacobian, rows, _DAMPING) / period_s
    out = np.zeros(now.v.shape[0])
    out[:3] = step[:3]
    turned = in_base(now.q, now.spin + period_s * step[3:6])
    out[3:6] = (turned - now.v[3:6]) / period_s
    for k in range(n_legs):
        out[6 + stance.leg_joints[k]] = step[6 + k]
    for u in range(robot.upper.shape[0]):
        out[6 + robot.upper[u]] = upper.change[u]
    return out


@inlined
def _foot(
    law: BodyLaw,
    robot: ReferenceRobot,
    stepping: StepState,
    now: BodyState,
    side: int,
    swings: bool,
    out: FloatArray,
) -> None:
    """Write a foot's acceleration: on its way it follows that, otherwise it stays and lies flat."""
    foot, rate = robot.stance.feet[side], now.foot_rate[side]
    flat = robot.stance.foot_rotation[side]
    if not swings:
        turn = rotation_error(turn_about_vertical(now.feet[side, 2], flat), now.pose.rotation[foot])
        for i in range(3):
            out[i] = -_STANDING[1] * rate[i]
            out[3 + i] = _STANDING[0] * turn[i] - _STANDING[1] * rate[3 + i]
        up = now.pose.position[foot, 2] - now.floor - robot.stance.foot_position[side, 2]
        out[2] -= _STANDING[0] * max(up, 0.0)
        return
    turn = rotation_error(turn_about_vertical(stepping.foot[3], flat), now.pose.rotation[foot])
    for i in range(3):
        a = law.ahead * stepping.foot_change[i]
        a += _SWING[0] * (stepping.foot[i] - now.pose.position[foot, i])
        a += _SWING[1] * (stepping.foot_rate[i] - rate[i])
        out[i] = min(max(a, -law.foot), law.foot)
        wanted = stepping.foot_rate[3] if i == 2 else 0.0
        a = _SWING[0] * turn[i] + _SWING[1] * (wanted - rate[3 + i])
        out[3 + i] = min(max(a, -law.foot_turn), law.foot_turn)


@inlined
def _height(
    law: BodyLaw, robot: ReferenceRobot, stepping: StepState, now: BodyState, wanted: float
) -> float:
    """Return how high the base shall be over the floor, so that both legs will reach [m]."""
    stance, swings = robot.stance, swinging(stepping)
    out = wanted - (law.crouch_m if stepping.step[0].n_steps > 0.0 else 0.0)
    for side in range(2):
        foot, thigh = stance.feet[side], stance.thighs[side]
        hip = now.pose.position[thigh]
        ground = now.pose.position[foot, 2]
        far = 0.0
        for i in range(2):
            speed = (now.after.position[thigh, i] - hip[i]) / law.period_s
            if side == swings:
                left = max(stepping.step[0].lasts_s - stepping.step[0].time_s, 0.0)
                d = hip[i] + left * speed - stepping.place[i]
            elif stepping.step[0].doing == SHIFTS:
                d = hip[i] + stepping.goal[i] - now.cog[i] - now.pose.position[foot, i]
            else:
                speed -= (now.after.position[foot, i] - now.pose.position[foot, i]) / law.period_s
                d = hip[i] + _AHEAD_S * speed - now.pose.position[foot, i]
            far += d * d
        if side == swings:
            ground = now.floor + stance.foot_position[side, 2]
        flat = (_REACH * stance.reach[side]) ** 2 - far
        most = np.sqrt(max(flat, 0.05)) + ground - hip[2] + now.q[2] - now.floor
        out = min(out, most)
    return out


@inlined
def _cog_rate_of(robot: ReferenceRobot, now: BodyState, rate: FloatArray) -> FloatArray:
    """Return the COG's velocity that comes of the tracked hinges alone, shape (3,) [m/s]."""
    q = now.q.copy()
    for u in range(robot.upper.shape[0]):
        q[7 + robot.upper[u]] += _PROBE_S * rate[u]
    moved: FloatArray = forward(robot.tree, q).moment[0] - now.pose.moment[0]
    moved /= _PROBE_S * now.pose.carried[0]
    return moved


@inlined
def command_legs(
    law: BodyLaw,
    robot: ReferenceRobot,
    stepping: StepState,
    now: BodyState,
    change: FloatArray,
    needed: FloatArray,
    command: FloatArray,
    adapted: FloatArray,
) -> None:
    """Write the legs' servo commands.

    A servo's force at the end of a period is stiffness (command - angle) - damping rate: so the
    command leads by where the joint will be, and by the torque.

    Args:
        law: What control goes by.
        robot: The reference robot.
        stepping: Which foot is on its way.
        now: The moment.
        change: Wanted acceleration, layout of qacc, shape (6 + n,).
        needed: Generalised forces that make it without the ground's, same layout.
        command: Commands of all servos, shape (n,) [rad], in which the legs' are written.
        adapted: Of each joint, the velocity wanted for now [rad/s], the torque by which what the
            robot believes of itself is wrong [N m], and the share of the velocity's gain by which
            it is, shape (3, n); brought up to date.
    """
    stance, swings, period_s = robot.stance, swinging(stepping), law.period_s
    points, sides = np.empty((8, 3)), np.empty(8, np.int64)
    n = 0
    aloft = False
    for side in range(2):
        low = now.soles[side, :, 2].min() - now.floor
        if side == swings:
            aloft = low > 0.0
        for k in range(4):
            if side != swings and low < _NEAR_M:
                points[n], sides[n] = now.soles[side, k] - now.cog, side
                n += 1
    wrench, base = np.empty(6), now.pose.rotation[0]
    wrench[:3] = needed[:3]
    moment = cross(now.pose.position[0] - now.cog, needed[:3])
    for i in range(3):
        wrench[3 + i] = moment[i]
        for j in range(3):
            wrench[3 + i] += base[i, j] * needed[3 + j]
    weight = np.array([1.0, 1.0, 0.7, law.moment, law.moment, law.moment])
    forces = contact_forces(points[:n].copy(), wrench, weight, law.friction)
    for k in range(stance.leg_joints.shape[0]):
        j = stance.leg_joints[k]
        torque = needed[6 + j]
        for p in range(n):
            if sides[p] == stance.leg_side[k]:
                turning = cross(points[p] + now.cog - now.pose.anchor[j], forces[p])
                for i in range(3):
                    torque -= now.pose.axis[j, i] * turning[i]
        v = now.v[6 + j]
        missed = adapted[0, j] - v
        watch = law.watch if aloft and stance.leg_side[k] == swings else 0.0
        most = _MOST_TORQUE * law.torque[j]
        adapted[1, j] = _FORGETS * adapted[1, j] + watch * missed
        adapted[1, j] = min(max(adapted[1, j], -most), most)
        adapted[2, j] += law.learns * missed * v / (v * v + _STILL)
        adapted[2, j] = min(max(adapted[2, j], -_WRONG), _WRONG)
        torque += adapted[1, j] + adapted[2, j] * law.damping[j] * v
        torque = min(max(torque, -law.torque[j]), law.torque[j])
        angle = now.q[7 + j]
        rate = now.v[6 + j] + period_s * change[6 + j]
        rate = max(rate, _NEAR_LIMIT * (law.limits[j, 0] - angle) / period_s)
        rate = min(rate, _NEAR_LIMIT * (law.limits[j, 1] - angle) / period_s)
        adapted[0, j] = rate
        lead = (torque + law.damping[j] * rate) / law.stiffness[j]
        command[j] = angle + period_s * rate + lead

"""The velocity inverse kinematics of the legs, numba kernels ([Kulic2012] section 4.2.1, figure 8).

Unknowns: the twist of the base (6) and the rates of the leg joints (n). Rows, 18 of them: both feet
(position 3, rotation 3 each), the horizontal COG (2), the height (1) and the orientation (3) of the
base. Solved by damped least squares.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import inlined, njit
from mplearn.maths.rotation_kernels import rotation_error
from mplearn.maths.solvers import solve_damped
from mplearn.recording import FloatArray, IntArray

from .kinematics import MassTree, Pose, cross, forward, rotate_quaternion

N_ROWS = 18
FEET = slice(0, 12)
COG = slice(12, 14)
HEIGHT = 14
ORIENTATION = slice(15, 18)
LONGEST_STEP = 0.2  # of one iteration [m, rad]


class Stance(NamedTuple):
    """Two feet that stand, and the legs above them.

    Attributes:
        leg_joints: Hinges of both legs, shape (n,).
        leg_side: Which foot each of them moves, shape (n,), 0 or 1.
        limits: Their angles' limits, shape (n, 2) [rad].
        feet: Bodies of the feet, shape (2,).
        thighs: Bodies whose origins are the hips, shape (2,).
        foot_position: Where the feet shall be, shape (2, 3) [m].
        foot_rotation: How they shall be turned, shape (2, 3, 3).
        reach: Longest distance from hip to ankle that the straight-knee guard allows, shape (2,)
            [m].
        cog: Where the horizontal COG shall be, shape (2,) [m].
        carried: How far each foot moves with the base instead of standing, shape (2,), 0 to 1.
    """

    leg_joints: IntArray
    leg_side: IntArray
    limits: FloatArray
    feet: IntArray
    thighs: IntArray
    foot_position: FloatArray
    foot_rotation: FloatArray
    reach: FloatArray
    cog: FloatArray
    carried: FloatArray


@njit(cache=True)
def jacobian_rows(stance: Stance, pose: Pose) -> FloatArray:
    """Return the Jacobian of the rows over base twist and leg rates, shape (18, 6 + n).

    As far as a foot is carried by the base its target is, too, so that no error comes of it. The
    twist is the base origin's velocity [m/s] and the angular velocity [rad/s], world frame.
    """
    n = stance.leg_joints.shape[0]
    out = np.zeros((N_ROWS, 6 + n))
    base = pose.position[0]
    for side in range(2):
        stands = 1.0 - stance.carried[side]
        arm = (pose.position[stance.feet[side]] - base) * stands
        for i in range(3):
            out[6 * side + i, i] = stands
            out[6 * side + 3 + i, 3 + i] = stands
        _minus_skew(out, 6 * side, arm)
    arm = pose.moment[0] / pose.carried[0] - base
    out[12, 0] = out[13, 1] = out[14, 2] = 1.0
    out[12, 4], out[12, 5] = arm[2], -arm[1]
    out[13, 3], out[13, 5] = -arm[2], arm[0]
    for i in range(3):
        out[15 + i, 3 + i] = 1.0
    return out


@inlined
def _minus_skew(out: FloatArray, row: int, arm: FloatArray) -> None:
    """Write the columns of omega x arm into rows row..row+2, columns 3..5."""
    out[row, 4], out[row, 5] = arm[2], -arm[1]
    out[row + 1, 3], out[row + 1, 5] = -arm[2], arm[0]
    out[row + 2, 3], out[row + 2, 4] = arm[1], -arm[0]


@njit(cache=True)
def add_leg_columns(tree: MassTree, stance: Stance, pose: Pose, out: FloatArray) -> None:
    """Write the columns of the leg joints into a Jacobian of `jacobian_rows`."""
    for k in range(stance.leg_joints.shape[0]):
        joint = stance.leg_joints[k]
        body = tree.linkage.joint_body[joint]
        axis = pose.axis[joint]
        row = 6 * stance.leg_side[k]
        foot = pose.position[stance.feet[stance.leg_side[k]]]
        out[row : row + 3, 6 + k] = cross(axis, foot - pose.anchor[joint])
        out[row + 3 : row + 6, 6 + k] = axis
        weighed = pose.moment[body] - pose.carried[body] * pose.anchor[joint]
        out[12:14, 6 + k] = cross(axis, weighed)[:2] / pose.carried[0]


@njit(cache=True)
def errors(stance: Stance, pose: Pose, height: float, orientation: FloatArray) -> FloatArray:
    """Return wanted minus actual of the 18 rows [m, rad], guarded against straight knees.

    Straight knees are the failure of leg kinematics: near them the legs cannot make the base rise
    and no small rate mends an error. So the wanted height bends smoothly off (over 1 cm) below the
    one at which a hip would be further from its ankle than ``stance.reach``.
    """
    out = np.empty(N_ROWS)
    rise = np.inf
    for side in range(2):
        foot = stance.feet[side]
        out[6 * side : 6 * side + 3] = stance.foot_position[side] - pose.position[foot]
        out[6 * side + 3 : 6 * side + 6] = rotation_error(
            stance.foot_rotation[side], pose.rotation[foot]
        )
        span = pose.position[stance.thighs[side]] - stance.foot_position[side]
        reach = stance.reach[side] + stance.carried[side] ** 4  # no bound on a foot in the air
        flat = reach**2 - span[0] ** 2 - span[1] ** 2
        rise = min(rise, np.sqrt(max(flat, 1e-4)) - span[2])
    out[12:14] = stance.cog - pose.moment[0, :2] / pose.carried[0]
    wanted = height - pose.position[0, 2]
    out[14] = 0.5 * (wanted + rise - np.sqrt((wanted - rise) ** 2 + 1e-4))
    out[15:18] = rotation_error(orientation, pose.rotation[0])
    return out


@njit(cache=True)
def rates(tree: MassTree, stance: Stance, pose: Pose, rows: FloatArray) -> FloatArray:
    """Return base twist and leg rates, shape (6 + n,), that best give the rows their velocities."""
    jacobian = jacobian_rows(stance, pose)
    add_leg_columns(tree, stance, pose, jacobian)
    return solve_damped(jacobian, rows, 1e-3)


@njit(cache=True)
def advance(stance: Stance, q: FloatArray, step: FloatArray) -> FloatArray:
    """Return the posture moved by base displacement and leg angles, within the legs' limits."""
    out = q.copy()
    out[:3] += step[:3]
    out[3:7] = rotate_quaternion(q[3:7], step[3:6])
    for k in range(stance.leg_joints.shape[0]):
        i = 7 + stance.leg_joints[k]
        out[i] = min(max(out[i] + step[6 + k], stance.limits[k, 0]), stance.limits[k, 1])
    return out


@njit(cache=True)
def nearer(
    tree: MassTree, stance: Stance, pose: Pose, rows: FloatArray, q: FloatArray
) -> FloatArray:
    """Return a posture with smaller errors, not farther off than 0.2 rad and 0.2 m."""
    step = rates(tree, stance, pose, rows)
    longest = np.max(np.abs(step))
    if longest > LONGEST_STEP:
        step *= LONGEST_STEP / longest
    return advance(stance, q, step)


@njit(cache=True)
def settle(
    tree: MassTree,
    stance: Stance,
    q: FloatArray,
    height: float,
    orientation: FloatArray,
    tolerance: float,
    max_iterations: int,
) -> tuple[FloatArray, float]:
    """Follow the rates until the rows are met; return the posture and the largest error left.

    One iteration is one step of the gradient descent at a gain of one over its time, so the law has
    no lag.
    """
    worst = np.inf
    for iteration in range(max_iterations + 1):
        pose = forward(tree, q)
        rows = errors(stance, pose, height, orientation)
        worst = np.max(np.abs(rows))
        if worst < tolerance or iteration == max_iterations:
            break
        q = nearer(tree, stance, pose, rows, q)
    return q, worst

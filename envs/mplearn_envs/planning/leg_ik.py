"""The reference robot's postures along a plan: feet where they shall be, COG where it shall be."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import inlined, njit
from mplearn.maths.plane import turn_in_plane
from mplearn.maths.rotation_kernels import rotation_error, turn_about_vertical, turn_by_vector
from mplearn.maths.yaw_roll_pitch import roll_pitch_matrix
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.heels import raised_foot
from mplearn_envs.mechanics.kinematics import forward
from mplearn_envs.mechanics.reference import ReferenceRobot
from mplearn_envs.mechanics.velocity_ik import Stance, errors, nearer

TOLERANCE = 1e-8  # [m, rad] to which the feet, COG and base follow
OFF_M = 0.08  # by no more than this a foot's height is its leg's and not the one it shall have
APART_M = 0.02  # between a foot and the one that it passes, where it is
LOW_M = 0.2  # not much higher than this
RISING_M_S2 = 5.0  # so fast the base gathers speed, and loses it, where a leg lets it rise again
_MAX_ITERATIONS = 12


class Wanted(NamedTuple):
    """What is wanted of the reference robot at K moments.

    Attributes:
        targets: Tracked coordinates, shape (K, U) [m, rad].
        swing: Angles of the legs' hinges [rad] that feet in the air follow, and heights of the left
            and the right sole [m], shape (K, n_legs + 2).
        ground: Where each foot stands or would: x, y [m] and yaw [rad], shape (K, 2, 3).
        heel: By how much each heel is raised, shape (K, 2) [rad].
        carried: How far each foot follows its leg's motion instead, shape (K, 2), 0 to 1.
        cog: Horizontal COG, shape (K, 2) [m].
    """

    targets: FloatArray
    swing: FloatArray
    ground: FloatArray
    heel: FloatArray
    carried: FloatArray
    cog: FloatArray


@njit(cache=True, nogil=True)
def balanced_path(
    robot: ReferenceRobot, wanted: Wanted, start: FloatArray, knot_s: float, wide: bool
) -> tuple[FloatArray, FloatArray]:
    """Balance the reference robot under every target.

    Where a leg is too short, the base is lower than it shall be; when the leg is free again, the
    base does not jump.

    Args:
        robot: The reference robot.
        wanted: What is wanted of it, at K moments.
        start: Posture before them, shape (7 + n,).
        knot_s: Time between the moments [s].
        wide: Whether a foot passes the other one as wide as it is turned, however far it follows
            its leg's motion.

    Returns:
        The postures, shape (K + 1, 7 + n), start included, and the largest error that is left in
        each, shape (K + 1,) [m, rad].
    """
    targets, swing, ground, heel, carried, cog = wanted
    n_knots = targets.shape[0]
    out = np.empty((n_knots + 1, start.shape[0]))
    worst = np.zeros(n_knots + 1)
    out[0] = start
    fixed = robot.stance
    stance = Stance(
        fixed.leg_joints,
        fixed.leg_side,
        fixed.limits,
        fixed.feet,
        fixed.thighs,
        fixed.foot_position.copy(),
        fixed.foot_rotation.copy(),
        fixed.reach,
        fixed.cog.copy(),
        np.zeros(2),
    )
    offset = robot.stance_height - robot.standing_height
    low = max(targets[0, 0] + offset - start[2], 0.0)  # by this the base is lower than it shall be
    rising = 0.0  # by how much less than before
    for k in range(n_knots):
        q = out[k].copy()
        if k > 0:  # base and legs go on as they went
            for i in range(3):
                q[i] += out[k, i] - out[k - 1, i]
            for j in stance.leg_joints:
                q[7 + j] += out[k, 7 + j] - out[k - 1, 7 + j]
        for u in range(robot.upper.shape[0]):
            q[7 + robot.upper[u]] = targets[k, 3 + u]
        stance.cog[:] = cog[k]
        stance.carried[:] = carried[k]
        heading = 0.5 * (ground[k, 0, 2] + ground[k, 1, 2])
        orientation = turn_about_vertical(heading, roll_pitch_matrix(targets[k, 1], targets[k, 2]))
        fastest = min(
            max(rising, 0.0) + RISING_M_S2 * knot_s**2, np.sqrt(2.0 * RISING_M_S2 * low) * knot_s
        )
        height = targets[k, 0] + offset - max(low - fastest, 0.0)
        for iteration in range(_MAX_ITERATIONS + 1):
            pose = forward(robot.tree, q)
            for side in range(2):
                _aim(robot, stance, side, q, ground[k], swing[k], heel[k, side], wide)
            rows = errors(stance, pose, height, orientation)
            worst[k + 1] = np.max(np.abs(rows))
            if worst[k + 1] < TOLERANCE or iteration == _MAX_ITERATIONS:
                break
            q = nearer(robot.tree, stance, pose, rows, q)
        out[k + 1] = q
        was_low, low = low, max(targets[k, 0] + offset - q[2], 0.0)
        rising = was_low - low
    return out, worst


@inlined
def _aim(
    robot: ReferenceRobot,
    stance: Stance,
    side: int,
    q: FloatArray,
    ground: FloatArray,
    swing: FloatArray,
    heel: float,
    wide: bool,
) -> None:
    """Write where a foot shall be: on the ground, or as the leg's motion has it, or in between.

    On its way it passes the other foot, and does not meet it.
    """
    n_legs = stance.leg_joints.shape[0]
    rise, share = swing[n_legs + side], stance.carried[side]
    flat = robot.stance.foot_rotation[side]
    height = robot.stance.foot_position[side, 2]
    place, rotation = raised_foot(robot.corners[side], flat, height, ground[side], heel)
    x, y, z = place[0], place[1], place[2] + rise
    if share > 0.0:
        there = q.copy()
        for i in range(n_legs):
            if stance.leg_side[i] == side:
                there[7 + stance.leg_joints[i]] = swing[i]
        pose = forward(robot.tree, there)
        foot = stance.feet[side]
        flat_there, lowest = rotation, _lowest(robot.corners[side], rotation)
        turn = rotation_error(pose.rotation[foot], rotation)
        rotation = turn_by_vector(share * turn, rotation)
        z += lowest - _lowest(robot.corners[side], rotation)
        x += share * (pose.position[foot, 0] - x)
        y += share * (pose.position[foot, 1] - y)
        low = min(max(1.5 - rise / LOW_M, 0.0), 1.0)
        other = ground[1 - side]
        if wide:  # the way of the leg is cleared, then blended with its place on the ground
            missing = _overlap(robot, side, x, y, rotation, other)
            missing -= (1.0 - share) * _overlap(robot, side, place[0], place[1], flat_there, other)
            aside = low * max(missing, 0.0) * (1.0 if side == 0 else -1.0)
        else:
            aside = share * low * _too_near(robot, side, x, y, other)
        x -= aside * np.sin(other[2])
        y += aside * np.cos(other[2])
        z += share * OFF_M * np.tanh((pose.position[foot, 2] - z) / OFF_M)
    stance.foot_position[side, 0] = x
    stance.foot_position[side, 1] = y
    stance.foot_position[side, 2] = z
    stance.foot_rotation[side] = rotation


@inlined
def _too_near(robot: ReferenceRobot, side: int, x: float, y: float, other: FloatArray) -> float:
    """Return how far a foot must go to the left so that it clears the one that stands [m]."""
    corners = robot.corners[side]
    length = corners[:, 0].max() - corners[:, 0].min()
    width = corners[:, 1].max() - corners[:, 1].min()
    ahead, aside = turn_in_plane(x - other[0], y - other[1], -other[2])
    beside = min(max(2.0 - abs(ahead) / length, 0.0), 1.0)
    missing = (width + APART_M) * beside - (aside if side == 0 else -aside)
    return float(max(missing, 0.0) * (1.0 if side == 0 else -1.0))


@njit(cache=True)
def _overlap(
    robot: ReferenceRobot, side: int, x: float, y: float, rotation: FloatArray, other: FloatArray
) -> float:
    """Return how far a foot, as it is turned, must go aside to clear the one that stands [m]."""
    corners, stands = robot.corners[side], robot.corners[1 - side]
    length = corners[:, 0].max() - corners[:, 0].min()
    sign = 1.0 if side == 0 else -1.0
    inner = np.inf  # how far aside of the foot's origin its innermost corner is
    for corner in range(corners.shape[0]):
        dx, dy = 0.0, 0.0
        for i in range(3):
            dx += rotation[0, i] * corners[corner, i]
            dy += rotation[1, i] * corners[corner, i]
        inner = min(inner, sign * turn_in_plane(dx, dy, -other[2])[1])
    ahead, aside = turn_in_plane(x - other[0], y - other[1], -other[2])
    beside = min(max(2.0 - abs(ahead) / length, 0.0), 1.0)
    return float(beside * ((sign * stands[:, 1]).max() + APART_M - inner) - sign * aside)


@njit(cache=True)
def _lowest(corners: FloatArray, rotation: FloatArray) -> float:
    """Return the height of the lowest corner of a sole over its foot's origin [m]."""
    lowest = np.inf
    for corner in range(corners.shape[0]):
        z = 0.0
        for i in range(3):
            z += rotation[2, i] * corners[corner, i]
        lowest = min(lowest, z)
    return lowest

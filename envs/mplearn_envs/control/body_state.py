"""What a robot knows of itself in one moment: body, weight and feet, and how they move."""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np

from mplearn.maths.compiling import inlined, inner_kernel, kernel
from mplearn.maths.plane import turn_in_plane
from mplearn.maths.rotation_kernels import rotation_error
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.kinematics import Pose, forward, rotate_quaternion
from mplearn_envs.mechanics.reference import ReferenceRobot
from mplearn_envs.mechanics.support import GRAVITY

# Sides, as numbers of numpy: numba would compile a kernel anew for each literal that it is given.
LEFT, RIGHT, NEITHER = (cast("int", np.int64(side)) for side in (0, 1, -1))
_LOWEST_M = 0.3  # of the COG, for the pendulum


class BodyState(NamedTuple):
    """One moment.

    Attributes:
        q: Posture, shape (7 + n,).
        v: Its velocity, layout of qvel, shape (6 + n,).
        pose: Where bodies and hinges are.
        after: Where they are one control period later, if all goes on so.
        spin: Angular velocity of the base, world frame, shape (3,) [rad/s].
        cog: Centre of gravity, by the masses that the robot believes in, shape (3,) [m].
        cog_rate: Its velocity, shape (3,) [m/s].
        feet: Where the feet are: x, y [m] and yaw [rad], shape (2, 3).
        foot_rate: Their velocities, linear [m/s] and angular [rad/s], shape (2, 6).
        soles: Corners of the soles, shape (2, 4, 3) [m].
        floor: Height of the lowest corner of a foot that stands [m].
        rate: Of the pendulum [1/s].
        dcm: Divergent component of motion, COG + velocity / rate, shape (2,) [m].
    """

    q: FloatArray
    v: FloatArray
    pose: Pose
    after: Pose
    spin: FloatArray
    cog: FloatArray
    cog_rate: FloatArray
    feet: FloatArray
    foot_rate: FloatArray
    soles: FloatArray
    floor: float
    rate: float
    dcm: FloatArray


@kernel
def body_state_of(
    robot: ReferenceRobot, q: FloatArray, v: FloatArray, period_s: float, up: int
) -> BodyState:
    """Return the moment.

    Args:
        robot: The robot as it knows itself.
        q: Posture, shape (7 + n,).
        v: Its velocity, layout of qvel, shape (6 + n,).
        period_s: Control period [s].
        up: Side of the foot that is on its way, -1 for none.
    """
    pose = forward(robot.tree, q)
    spin = _turned_by(q, v[3:6])
    later = q + 0.0
    later[:3] += period_s * v[:3]
    later[3:7] = rotate_quaternion(q[3:7], period_s * spin)
    later[7:] += period_s * v[6:]
    after = forward(robot.tree, later)
    cog = pose.moment[0] / pose.carried[0]
    cog_rate = (after.moment[0] / after.carried[0] - cog) / period_s
    feet, foot_rate = np.empty((2, 3)), np.empty((2, 6))
    soles = np.empty((2, 4, 3))
    floor = np.inf
    for side in range(2):
        foot = robot.stance.feet[side]
        turn = pose.rotation[foot]
        feet[side, :2] = pose.position[foot, :2]
        feet[side, 2] = np.arctan2(turn[1, 0], turn[0, 0])
        foot_rate[side, :3] = (after.position[foot] - pose.position[foot]) / period_s
        foot_rate[side, 3:] = rotation_error(after.rotation[foot], turn) / period_s
        for k in range(4):
            for i in range(3):
                x = pose.position[foot, i]
                for j in range(3):
                    x += turn[i, j] * robot.corners[side, k, j]
                soles[side, k, i] = x
        if side != up:
            floor = min(floor, soles[side, :, 2].min())
    rate = np.sqrt(GRAVITY / max(cog[2] - floor, _LOWEST_M))
    dcm = cog[:2] + cog_rate[:2] / rate
    return BodyState(
        q, v, pose, after, spin, cog, cog_rate, feet, foot_rate, soles, floor, rate, dcm
    )


@kernel
def sole_middle(robot: ReferenceRobot, feet: FloatArray, side: int) -> tuple[float, float]:
    """Return the middle of a sole, x and y [m]."""
    x, y = robot.corners[side, :, 0].mean(), robot.corners[side, :, 1].mean()
    x, y = turn_in_plane(x, y, feet[side, 2])
    return feet[side, 0] + x, feet[side, 1] + y


@inlined
def in_base(q: FloatArray, vector: FloatArray) -> FloatArray:
    """Return a vector of the world (3,) as the base sees it."""
    conjugate = np.array([q[3], -q[4], -q[5], -q[6]])
    return _rotated(conjugate, vector)


@inlined
def _turned_by(q: FloatArray, vector: FloatArray) -> FloatArray:
    """Return a vector of the base's frame (3,) in the world's."""
    return _rotated(q[3:7], vector)


@inner_kernel
def _rotated(quaternion: FloatArray, vector: FloatArray) -> FloatArray:
    w, x, y, z = quaternion
    a, b, c = vector
    out = np.empty(3)
    out[0] = (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - w * z) * b + 2 * (x * z + w * y) * c
    out[1] = 2 * (x * y + w * z) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - w * x) * c
    out[2] = 2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (1 - 2 * (x * x + y * y)) * c
    return out

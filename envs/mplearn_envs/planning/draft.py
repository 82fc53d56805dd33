"""One try at a plan: the reference robot performs a motion at a given pace, balanced."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.easing import smooth_step
from mplearn.maths.resampling import interpolate_linearly
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.mechanics.kinematics import forward
from mplearn_envs.mechanics.momentum import ground_reaction, momenta, velocities
from mplearn_envs.mechanics.pendulum import zmp_along
from mplearn_envs.mechanics.reference import Reference, reference_robot, sole_middles, sole_outlines
from mplearn_envs.mechanics.servos import limit_velocity
from mplearn_envs.mechanics.support import margins_along
from mplearn_envs.robot import Robot

from .clearance import NEAR_M, feet_touch
from .leg_ik import Wanted, balanced_path
from .plan import Motion, PlannerConfig
from .splines import fading
from .stride import CARRY_M, plan_ground, plan_rise, plan_weight
from .timeline import Stretch, Timeline, lay_out, stretches

CLOSE_M = 0.035  # a zero-moment point so near the edge is planned again, for all masses
_SOLE_M = 0.1  # by no more than this
_GRAZES_M = 0.008  # feet that stand as the robot's own may overlap by so much: no robot fell


class Pace(NamedTuple):
    """How fast a motion is performed.

    Attributes:
        speed: As a share of the human's.
        patience: By how much shifts of the weight and swings of a foot take longer than at least.
        in_turn: Whether the body goes to where the motion begins while both feet are down, after
            one has been lowered and before another is raised, and not meanwhile.
        gathers: Whether the feet are put beside each other before that.
    """

    speed: float
    patience: float = 1.0
    in_turn: bool = False
    gathers: bool = False


class Draft(NamedTuple):
    """A motion at one pace: K knots after the start.

    Attributes:
        timeline: The times.
        targets: Tracked coordinates and swing (see `Reference`), shape (K, U + n_legs + 2).
        q: Reference postures, the start included, shape (K + 1, 7 + n).
        error: Largest error that is left at each of them, shape (K + 1,) [m, rad].
        cog: COG of each, shape (K + 1, 3) [m].
        zmp: Zero-moment point at each, of all masses, shape (K + 1, 2) [m].
        margin: Its distance from the edge of the soles that stand, shape (K + 1,) [m].
        ground: Where each foot stands or would: x, y [m] and yaw [rad], shape (K + 1, 2, 3).
        up: Side of the foot in the air at each, -1 for none, shape (K + 1,).
        heel: By how much each heel is raised, shape (K + 1, 2) [rad].
    """

    timeline: Timeline
    targets: FloatArray
    q: FloatArray
    error: FloatArray
    cog: FloatArray
    zmp: FloatArray
    margin: FloatArray
    ground: FloatArray
    up: IntArray
    heel: FloatArray


class Drafter:
    """Drafts plans for one robot.

    Args:
        robot: The robot.
        config: How motions become commands.
    """

    def __init__(self, robot: Robot, config: PlannerConfig) -> None:
        self.config = config
        self.knot_s = config.period_s * config.knot_steps
        self._reference = reference_robot(robot)
        self._mass = float(self._reference.tree.mass.sum())
        joints = robot.position_limits[robot.leg_joints].copy()
        knees = np.isin(robot.leg_joints, [robot.joint_names.index(name) for name in robot.knees])
        joints[knees, 0] = np.maximum(joints[knees, 0], 0.5 * robot.guard_knee_rad)
        self._limits = np.vstack((self._reference.limits, joints, [[0.0, np.inf]] * 2))
        self._standing = np.append(self._reference.rest[7 + robot.leg_joints], np.zeros(2))
        sides = np.repeat(np.arange(2), [len(leg) for leg in robot.legs])
        self._leg_columns = [
            len(self._reference.limits) + np.flatnonzero(sides == s) for s in (0, 1)
        ]
        rates = robot.per_joint("velocity")[robot.leg_joints]
        self._rates = np.concatenate((self._reference.velocity, rates, [np.inf] * 2))

    def draft(self, start: Reference, motion: Motion, pace: Pace) -> Draft:
        """Return the motion at a pace, from where the reference robot is."""
        ref, knot_s = self._reference, self.knot_s
        pose = forward(ref.tree, start.q)
        here = pose.moment[0] / pose.carried[0]
        timeline, targets, heel = self._targets(start, motion, pace, here)
        ground = plan_ground(ref, timeline, motion.footwork, start.ground, knot_s)
        standing = np.concatenate((start.ground[None], ground))
        up = np.concatenate(([start.lifted], timeline.up))
        weight = plan_weight(timeline, sole_middles(ref, ground, heel), here[:2], knot_s)
        heels = np.concatenate((start.heel[None], heel))
        path = weight.path(here[2], knot_s)
        q, error = self._follow(start, motion, targets, ground, heel, path)
        cog, zmp, margin = self._balance(q, standing, up, heels)
        if not weight.still and margin.min() < CLOSE_M and np.isfinite(zmp).all():
            off = zmp - zmp_along(np.vstack((here[:2], path)), here[2], knot_s)
            path = weight.path(here[2], knot_s, np.clip(off, -_SOLE_M, _SOLE_M))
            q, error = self._follow(start, motion, targets, ground, heel, path)
            cog, zmp, margin = self._balance(q, standing, up, heels)
        return Draft(timeline, targets, q, error, cog, zmp, margin, standing, up, heels)

    def _targets(
        self, start: Reference, motion: Motion, pace: Pace, here: FloatArray
    ) -> tuple[Timeline, FloatArray, FloatArray]:
        """Return the times, and what is wanted at the knots after the start.

        Returns:
            The timeline, tracked coordinates and swing, shape (K, U + n_legs + 2) [m, rad], and by
            how much each heel is raised, shape (K, 2) [rad].
        """
        footwork, speed, knot_s = motion.footwork, pace.speed, self.knot_s
        n_frames = len(motion.frames)
        before = np.concatenate((start.target, start.swing))
        before_rate = np.concatenate((start.velocity, start.swing_velocity))
        if footwork is None:
            swing = np.broadcast_to(self._standing, (n_frames, len(self._standing)))
        else:
            swing = np.hstack((footwork.legs, footwork.rise))
        limits = self._limits
        frames = np.clip(np.hstack((motion.frames, swing)), limits[:, 0], limits[:, 1])
        gap = before - frames[0]
        length_s = motion.duration_s / speed
        allowed = self.config.blend_velocity * self._rates
        counts = np.ones(len(gap))
        for side in range(2):  # a foot that is down does not follow its leg's motion
            counts[self._leg_columns[side]] = start.up[side]
        needed_s = float(np.max(1.875 * counts * np.abs(gap) / allowed))  # a quintic's peak
        blend_s = max(needed_s, min(self.config.blend_s, 0.6 * length_s))
        wait_s = max(0.0, needed_s - 0.6 * length_s)

        middles = sole_middles(self._reference, start.ground)
        to_foot = float(np.linalg.norm(middles - here[:2], axis=1).max())
        apart = float(np.linalg.norm(middles[0] - middles[1]))
        rise = float(start.swing[-2:].max())
        parts = stretches(n_frames, footwork, start.lifted, rise, to_foot, apart, pace.gathers)
        first_of_all = 0  # parts that come before the body goes where the motion begins
        if pace.in_turn:
            lowers = parts[0].up >= 0 and parts[0].first == parts[0].last
            first_of_all = int(lowers) + (2 * int(not lowers) if pace.gathers else 0)
            parts.insert(first_of_all, Stretch(0, 0, -1, -1, blend_s))
        timeline = lay_out(parts, 1.0 / (motion.rate_hz * speed), knot_s, wait_s, pace.patience)
        at = timeline.progress
        time = np.arange(1.0, len(at) + 1.0) * knot_s
        path = interpolate_linearly(frames, at)
        moves = wait_s == 0 and parts[0].first < parts[0].last
        first = (frames[1] - frames[0]) * motion.rate_hz * speed if moves else 0.0
        heights = path[:, -2:].copy()
        rate = before_rate - first
        late_s = timeline.ends[first_of_all - 1] * knot_s if first_of_all else 0.0
        fades = fading(np.maximum(time - late_s, 0.0), blend_s, gap, 0.0 * rate)
        fades += fading(time, blend_s, 0.0 * gap, rate)
        for side, (begin_s, end_s) in self._swings(timeline).items():
            of_it = self._leg_columns[side]
            late = np.maximum(time - begin_s, 0.0)
            at_once = rate[of_it] if begin_s == 0.0 else np.zeros(len(of_it))
            fades[:, of_it] = fading(late, end_s - begin_s, gap[of_it], at_once)
        path += fades
        path[:, -2:] = plan_rise(timeline, heights, start, path[:, -2:], knot_s)
        path = np.clip(path, limits[:, 0], limits[:, 1])
        width = len(self._rates) - 2
        path[:, :width] = limit_velocity(
            path[:, :width], before[:width], self._rates[:width] * knot_s
        )
        heel = np.zeros((len(at), 2))
        if motion.stance is not None:
            heel += interpolate_linearly(motion.stance.heel, at)
        if start.heel.any() or heel.any():
            lower = start.heel - (0.0 if motion.stance is None else motion.stance.heel[0])
            heel += fading(np.maximum(time - late_s, 0.0), blend_s, lower, 0.0 * lower)
        return timeline, path, np.maximum(heel, 0.0)

    def _swings(self, timeline: Timeline) -> dict[int, tuple[float, float]]:
        """Return when which foot is raised or lowered while the motion waits for it [s]."""
        out, first = {}, 0
        for part, last in zip(timeline.stretches, timeline.ends, strict=True):
            if part.up >= 0 and part.first == part.last:
                out[part.up] = (first * self.knot_s, last * self.knot_s)
            first = last
        return out

    def _follow(
        self,
        start: Reference,
        motion: Motion,
        targets: FloatArray,
        ground: FloatArray,
        heel: FloatArray,
        cog: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the reference postures and their errors; see `balanced_path`."""
        width = len(self._reference.limits)
        carried = smooth_step(np.clip(targets[:, -2:] / CARRY_M, 0.0, 1.0))
        if motion.footwork is not None and not motion.footwork.free:
            carried[:] = 0.0
        wanted = Wanted(targets[:, :width], targets[:, width:], ground, heel, carried, cog)
        what = self._reference, wanted, start.q, self.knot_s
        path: tuple[FloatArray, FloatArray] = balanced_path(*what, False)
        beside = np.array_equal(start.ground, self._reference.ground)
        if carried.any() and feet_touch(self._reference, path[0], -_GRAZES_M if beside else NEAR_M):
            path = balanced_path(*what, True)
        return path

    def _balance(
        self, q: FloatArray, ground: FloatArray, up: IntArray, heel: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return COG (K + 1, 3), zero-moment point (K + 1, 2) and its margin (K + 1,) [m]."""
        ref, knot_s = self._reference, self.knot_s
        feet, rate = ref.stance.feet, velocities(q, knot_s)
        cog, linear, angular, _ = momenta(ref.tree, ref.inertia, feet, ref.corners[:, :0], q, rate)
        between = ground_reaction(self._mass, cog, linear, angular, knot_s)
        zmp = np.vstack((between[:1], 0.5 * (between[1:] + between[:-1]), between[-1:]))
        points = np.nan_to_num(zmp, nan=np.inf)
        margin = margins_along(sole_outlines(ref, ground, heel), up, points)
        return cog, zmp, margin

"""From a primitive's trajectory to servo commands for the whole robot: a pure function.

What is commanded depends on the reference posture at the start, the motion and the speed alone
([Kulic2012] 4.2.1 balances a kinematic reference). Plans are therefore cached, exactly: their ends
are kept on a grid of 1e-6, so the same posture recurs.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.lru_cache import LRUCache
from mplearn_envs.mechanics.gravity import holding_torques
from mplearn_envs.mechanics.reference import (
    N_BASE,
    Reference,
    reference_robot,
    rest_reference,
    sole_middles,
    tracked_columns,
)
from mplearn_envs.mechanics.servos import servo_commands
from mplearn_envs.robot import Robot

from .draft import Draft, Drafter, Pace
from .footwork import Footwork, Lift, read_flight, read_footwork
from .plan import Motion as Motion
from .plan import Plan as Plan
from .plan import PlannerConfig as PlannerConfig
from .plan import joined
from .restance import Restance
from .splines import refine
from .stance import OWN_M, OWN_RAD, Stance, astray, balanced, read_stance
from .stride import SAME_PLACE_M, SAME_YAW_RAD, left_from_right, left_share, recentred

GRID_DECIMALS = 6
OUT_OF_REACH = 1e-3  # [m, rad]: an error that slowing down does not mend
_TRIES, _MORE_TRIES = 6, 3
_SLOWEST = 0.6  # of the pace is tried next, at least
_ENOUGH_M = 1e-3  # a margin that falls short by less is enough
_CALMS_S = 1.0  # in which the robot comes to rest where it is, if it does not come home at once
_AT_HOME = 1e-3  # so near to where it stands at rest the robot stands there [m, rad]


class Planner:
    """Plans motions for one robot.

    Args:
        robot: The robot.
        config: See `PlannerConfig`.

    Example:
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.robot import humanoid
        >>> planner = Planner(humanoid())
        >>> plan = planner.hold(rest_reference(humanoid()), 1.0)
        >>> plan.duration_s, plan.commands.shape
        (1.0, (250, 30))
    """

    def __init__(self, robot: Robot, config: PlannerConfig | None = None) -> None:
        self.robot = robot
        self.config = config or PlannerConfig()
        self._reference = reference_robot(robot)
        self._drafter = Drafter(robot, self.config)
        self._velocity = np.concatenate(
            (self._reference.velocity[:N_BASE], robot.per_joint("velocity"))
        )
        self._stiffness = robot.per_joint("stiffness")
        self._tracked = tracked_columns(robot)
        self._cache = LRUCache(self.config.cache_size)
        self._restance = Restance(robot, self._plan_step)
        self._rest = rest_reference(robot)

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
        flight_m = read_flight(self.robot, frames)
        lifts = footwork.lifts
        stance, until = None, lifts[0].start if lifts else len(frames)
        if until >= 0:
            until = max(until, 1)
            stance = read_stance(self.robot, frames, until, lifts)
            far, turned = astray(self._reference, stance.place)
            if far < OWN_M and turned < OWN_RAD:
                place = left_from_right(self._reference.ground)
                stance = Stance(place, np.zeros((len(frames), 2)))
            else:
                stance = self._restance.within_reach(stance)
            tracked, stance = balanced(self.robot, tracked, rate_hz, stance, until)
        return Motion(tracked, rate_hz, footwork if lifts else None, flight_m, stance)

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
            InvalidValueError: The speed is not positive, the motion is too short or not finite, or
                where the reference robot is is not finite.
        """
        if not (np.isfinite(speed) and speed > 0):
            raise InvalidValueError(f"speed must be positive and finite, not {speed}")
        _require_finite(start)
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
        plan: Plan | None = self._cache.get(full_key)
        if plan is None:
            plan = self._plan(start, motion, speed)
            self._cache.put(full_key, plan)
        return plan

    def hold(self, start: Reference, duration_s: float) -> Plan:
        """Return the commands that come to rest in the present posture, on one foot or on two.

        Raises:
            InvalidValueError: Where the reference robot is is not finite.
        """
        return self.plan(start, self._held(start, duration_s), 1.0, ("hold", duration_s))

    def home(self, start: Reference) -> Plan:
        """Return the commands after which the robot stands at rest, as it did at first.

        Its end is `rest_reference`, to the last bit, wherever it began and by whatever way; where
        the robot does not come there, the plan's errors and margins say so.

        Args:
            start: Where the reference robot is.

        Raises:
            InvalidValueError: Where that is is not finite.
        """
        _require_finite(start)
        full_key = ("home", *(part.tobytes() for part in start))
        plan: Plan | None = self._cache.get(full_key)
        if plan is None:
            plan = self._home(start)
            self._cache.put(full_key, plan)
        return plan

    def _held(self, start: Reference, duration_s: float) -> Motion:
        """Return the motion of who stays as the robot is."""
        here = np.clip(start.target, *self._reference.limits.T)
        footwork = None
        if start.lifted >= 0:
            legs, rise = start.swing[:-2], start.swing[-2:]
            lifts = (Lift(start.lifted, -1, 2),)
            footwork = Footwork(
                np.stack((legs, legs)), np.stack((rise, rise)), np.zeros((2, 3)), lifts
            )
        stance = Stance(left_from_right(start.ground), np.stack((start.heel, start.heel)))
        return Motion(np.stack((here, here)), 1.0 / duration_s, footwork, stance=stance)

    def _home(self, start: Reference) -> Plan:
        plans = []
        if start.lifted >= 0:
            plans.append(self._plan_one(start, self._restance.lowered(start), 1.0)[0])
            start = plans[0].end
        by_left, by_right = (self._restance.home(start, side) for side in (0, 1))
        way, sound = self._plan_row(start, by_left)
        for motions in (by_right, [self._held(start, _CALMS_S), *by_left]):
            if not sound:
                again, sound = self._plan_row(start, motions)
                way = again if sound else way
        plan = joined([*plans, way])
        off = np.abs(plan.end.q - self._rest.q).max()
        if not off < _AT_HOME:  # then a plan from there is not what was planned
            return plan._replace(error=np.maximum(plan.error, off))
        return plan._replace(end=self._rest)

    def _plan(self, start: Reference, motion: Motion, speed: float) -> Plan:
        """Return the plan of a motion, and of the steps into its stance before it."""
        steps = self._restance.into(start, motion)
        if steps and self._restance.alike(start, motion):
            plan, sound = self._plan_one(start, motion, speed)
            if sound:
                return plan
        plan, sound = self._plan_row(start, [*steps, motion], speed)
        if not sound and (steps := self._restance.together(start, motion)):
            again, better = self._plan_row(start, [*steps, motion], speed)
            plan = again if better else plan
        return plan

    def _plan_row(
        self, start: Reference, motions: list[Motion], speed: float = 1.0
    ) -> tuple[Plan, bool]:
        """Return the plan of steps and a motion after them, and whether all of it is sound.

        Args:
            start: Where the reference robot is.
            motions: One after another.
            speed: Of the last; the others are steps, planned at the speed at which they are made.
        """
        plans, sounds = [], []
        for i, each in enumerate(motions):
            pace = speed if i == len(motions) - 1 else 1.0
            plan, sound = self._plan_one(start, each, pace)
            plans.append(plan)
            sounds.append(sound)
            start = plan.end
        return joined(plans), all(sounds)

    def _plan_step(self, start: Reference, motion: Motion) -> tuple[Plan, bool]:
        return self._plan_one(start, motion, 1.0)

    def _plan_one(self, start: Reference, motion: Motion, speed: float) -> tuple[Plan, bool]:
        """Return a motion's plan, and whether the robot reaches what is wanted, and stands."""
        draft, pace = self._balanced(start, motion, Pace(speed))
        if not self._sound(draft) and self._strides(start) and self._gathers(motion):
            gathered = Pace(speed, in_turn=True, gathers=True)
            again, its_pace = self._balanced(start, motion, gathered)
            if self._sound(again) or again.error.max() < draft.error.max():
                draft, pace = again, its_pace
        knot_s = self._drafter.knot_s
        middles = sole_middles(self._reference, draft.ground, draft.heel)
        borne = np.where(np.isfinite(draft.zmp), draft.zmp, draft.cog[:, :2])  # it may fly
        share = left_share(middles, draft.up, borne)
        torque = holding_torques(self._reference, draft.q, share, borne, middles)
        led = draft.q[:, 7:] + torque / self._stiffness  # a servo gives way to what it holds
        position, rate = refine(led, knot_s, self.config.knot_steps)
        plan = Plan(
            commands=servo_commands(self.robot, position, rate),
            q=draft.q,
            knot_s=knot_s,
            error=draft.error,
            end=self._end(draft),
            speed=pace.speed,
            cog=draft.cog,
            zmp=draft.zmp,
            zmp_margin_m=draft.margin,
            ground=draft.ground,
            up=draft.up,
            share=share,
            heel=draft.heel,
        )
        return plan, self._sound(draft)

    def _balanced(self, start: Reference, motion: Motion, pace: Pace) -> tuple[Draft, Pace]:
        """Return a motion as slow as it must be, and how slow that is."""
        draft = self._drafter.draft(start, motion, pace)
        for _ in range(_TRIES):
            slower = self._slower(draft, start, motion, pace)
            if slower == pace:
                break
            pace = slower
            draft = self._drafter.draft(start, motion, pace)
        for _ in range(_MORE_TRIES):  # at its velocity limits little tells what balance asks for
            if self._sound(draft) or draft.error.max() > 10.0 * OUT_OF_REACH:
                break
            pace = pace._replace(speed=_SLOWEST * pace.speed)
            draft = self._drafter.draft(start, motion, pace)
        return draft, pace

    def _sound(self, draft: Draft) -> bool:
        """Return whether the robot reaches what is wanted, and stands."""
        reached = draft.error.max() <= 10.0 * OUT_OF_REACH
        return bool(reached and draft.margin.min() >= self.config.zmp_margin_m - _ENOUGH_M)

    def _strides(self, start: Reference) -> bool:
        """Return whether the feet are apart; where motions are judged they are side by side."""
        off = left_from_right(start.ground) - left_from_right(self._reference.ground)
        return bool(np.hypot(off[0], off[1]) > SAME_PLACE_M or abs(off[2]) > SAME_YAW_RAD)

    def _gathers(self, motion: Motion) -> bool:
        """Return whether a motion may begin with the feet beside each other."""
        return motion.stance is None or astray(self._reference, motion.stance.place)[0] < OWN_M

    def _slower(self, draft: Draft, start: Reference, motion: Motion, pace: Pace) -> Pace:
        """Return the pace that velocity limits and balance ask for; the same where it is right.

        What moving masses add to the zero-moment point falls with the square of the pace.
        """
        if draft.error.max() > OUT_OF_REACH:
            carries_on = motion.footwork is not None and start.lifted == motion.footwork.up_at(
                False
            )
            return pace if start.lifted >= 0 and carries_on else pace._replace(in_turn=True)
        base = np.vstack((start.target[:N_BASE], draft.targets[:, :N_BASE]))
        velocity = np.diff(np.hstack((base, draft.q[:, 7:])), axis=0) / self._drafter.knot_s
        excess = float(np.max(np.abs(velocity) / self._velocity))
        if excess > 1.0:
            return pace._replace(speed=pace.speed / (1.02 * excess))
        moving = np.linalg.norm(draft.zmp - draft.cog[:, :2], axis=1)
        wanted = self.config.zmp_margin_m + self.config.model_error * moving
        short = np.nan_to_num(wanted - draft.margin, nan=np.inf)
        worst = int(np.argmax(short))
        if not short[worst] > _ENOUGH_M or moving[worst] == 0:
            return pace
        slower = _SLOWEST
        if np.isfinite(moving[worst]):  # it does not fly
            share = 1.0 - 1.1 * short[worst] / moving[worst]
            slower = max(_SLOWEST, float(np.sqrt(max(share, 0.0))))
        if draft.timeline.waits(worst, 1.0 / (motion.rate_hz * pace.speed)):
            return pace._replace(patience=pace.patience / slower)
        return pace._replace(speed=pace.speed * slower)

    def _end(self, draft: Draft) -> Reference:
        """Return the reference after the last knot, seen from between the feet."""
        targets, up, width = draft.targets, int(draft.up[-1]), len(self._reference.limits)
        rate = (targets[-1] - targets[-2]) / self._drafter.knot_s
        lifted = np.zeros(2)
        if up >= 0:
            lifted[up] = 1.0
        q, ground = recentred(draft.q[-1], draft.ground[-1])
        tracked = targets[-1, :width], rate[:width], q
        swing = targets[-1, width:], rate[width:], lifted
        parts = (*tracked, *swing, ground, draft.heel[-1])
        return Reference(*(np.round(part, GRID_DECIMALS) for part in parts))


def _require_finite(start: Reference) -> None:
    """Check that the reference robot is somewhere."""
    for name, part in zip(Reference._fields, start, strict=True):
        if not np.isfinite(part).all():
            raise InvalidValueError(f"where the reference robot is must be finite; {name} is not")

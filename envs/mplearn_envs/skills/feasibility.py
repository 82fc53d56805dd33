"""Whether a robot can perform a motion, and if not why, before it tries."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, fields
from numbers import Real
from typing import Literal, TypeAlias

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn_envs.lru_cache import LRUCache
from mplearn_envs.mechanics.inverse_dynamics import InverseDynamics
from mplearn_envs.mechanics.reference import (
    Reference,
    reference_robot,
    rest_reference,
    tracked_columns,
)
from mplearn_envs.planning.footwork import Footwork, Lift
from mplearn_envs.planning.plan import Motion, Plan
from mplearn_envs.planning.planner import Planner

SLOWER = 0.8  # share of the speed that is tried next
_LEAST_MARGIN = 0.5  # of the margin at the edge is enough while one motion gives way to another
_PLACES = 4096  # of about 1 kB each: from where it is known whether the robot comes to rest
_WAYS_IN = 8  # the last ones, of some 300 kB each: a verdict asks twice
_AT_LIMIT = 1e-3  # so near its limit a joint is what does not reach [rad]
ProblemKind: TypeAlias = Literal["flight", "limit", "velocity", "reach", "torque", "balance"]


@dataclass(frozen=True)
class FeasibilityConfig:
    """What is still allowed.

    Attributes:
        flight_m: How high both soles may be over the floor at once [m]: nothing carries then.
        overshoot: How far the motion may go beyond the tracked coordinates' limits, where it is
            cut off [m, rad].
        slowest: Smallest share of the wanted speed that still counts as performing the motion.
        reach_error: How far feet, COG and base may stay off what is wanted [m, rad].
        torque_share: Share of the torque limits that may be used.
        zmp_margin_m: How near the zero-moment point may come to the edge of the soles [m].
        transitions: Whether what can follow a primitive only by way of standing upright
            (`Skills.plan`) is masked. Each two are planned when that is first asked.

    Raises:
        InvalidValueError: A limit is no number from 0 on, ``slowest`` is 0, or ``transitions`` is
            neither true nor false.

    Example:
        >>> FeasibilityConfig(torque_share=0.8, transitions=True).slowest
        0.3
    """

    flight_m: float = 0.06
    overshoot: float = 0.25
    slowest: float = 0.3
    reach_error: float = 0.01
    torque_share: float = 0.9
    zmp_margin_m: float = 0.015
    transitions: bool = False

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            told = isinstance(value, (bool, np.bool_))
            if each.name == "transitions":
                if not told:
                    raise InvalidValueError(f"transitions must be True or False, not {value!r:.80}")
            elif told or not isinstance(value, (Real, np.number)) or not float(value) >= 0.0:
                raise InvalidValueError(
                    f"{each.name} must be a number from 0 on, not {value!r:.80}"
                )
        if not self.slowest > 0.0:
            raise InvalidValueError("slowest must be above 0")


@dataclass(frozen=True)
class Problem:
    """One reason why a motion cannot be performed.

    Attributes:
        kind: What is violated.
        where: The joints, channel or foot concerned.
        value: What the motion needs.
        allowed: What is allowed.

    Example:
        >>> problem = Problem("torque", "knee_l", value=140.0, allowed=120.0)
        >>> f"{problem.where} needs {problem.value / problem.allowed:.0%} of its {problem.kind}"
        'knee_l needs 117% of its torque'
    """

    kind: ProblemKind
    where: str
    value: float
    allowed: float

    def __str__(self) -> str:
        """Return the reason in a few words."""
        return f"{self.kind} of {self.where}: {self.value:.3g}, allowed {self.allowed:.3g}"


@dataclass(frozen=True)
class Feasibility:
    """The verdict on a motion.

    Attributes:
        problems: Why it cannot be performed; empty where it can.
        speed: Speed at which it is performed, as a share of the human's.
        zmp_margin_m: Smallest distance of the planned zero-moment point from the edge of the soles,
            negative outside [m]; NaN where no plan was made.
        torque_share: Largest share of a torque limit that is needed; NaN where no plan was made.
        tempo: Duration of the motion over that of its performance, time to shift the weight
            included; NaN where no plan was made.
        starts_up: Side of the foot that is in the air at the start, 0 left, 1 right, -1 none. A
            robot that stands otherwise lowers and raises its feet first.
        ends_up: The same at the end.

    Example:
        >>> verdict = Feasibility(problems=(), speed=0.5, zmp_margin_m=0.02, torque_share=0.6)
        >>> verdict.feasible
        True
    """

    problems: tuple[Problem, ...]
    speed: float
    zmp_margin_m: float
    torque_share: float
    tempo: float = np.nan
    starts_up: int = -1
    ends_up: int = -1

    @property
    def feasible(self) -> bool:
        """Whether the robot can perform the motion."""
        return not self.problems


class FeasibilityCheck:
    """Judges motions by planning them from their own start posture.

    Velocities never exceed the limits, for the plan slows down; so does this check where balance or
    torques ask for it. A motion that must become slower than ``config.slowest`` is refused.

    Args:
        planner: Plans for the robot.
        config: What is allowed.

    Example:
        >>> import numpy as np
        >>> from mplearn_envs.mechanics import reference_robot
        >>> from mplearn_envs.robot import humanoid
        >>> planner = Planner(humanoid())
        >>> ref = reference_robot(humanoid())
        >>> still = np.tile(planner.hold(rest_reference(humanoid()), 1.0).end.target, (50, 1))
        >>> FeasibilityCheck(planner).judge(Motion(still, 50.0), speed=0.5).feasible
        True
    """

    def __init__(self, planner: Planner, config: FeasibilityConfig | None = None) -> None:
        self.planner = planner
        self.config = config or FeasibilityConfig()
        self._dynamics = InverseDynamics(planner.robot)
        self._columns = tracked_columns(planner.robot)
        self._leads_home = LRUCache(_PLACES)
        self._ways_in = LRUCache(_WAYS_IN)

    def judge(self, motion: Motion, speed: float, key: Hashable = None) -> Feasibility:
        """Return whether a motion can be performed.

        Args:
            motion: See `Planner.motion`.
            speed: Wanted speed, as a share of the human's.
            key: Names the motion, see `Planner.plan`.
        """
        footwork = motion.footwork
        feet = (-1, -1) if footwork is None else (footwork.up_at(False), footwork.up_at(True))
        problems = (*self._flight(motion), *self._overshoot(motion))
        if problems:  # nothing to plan
            return Feasibility(problems, speed, np.nan, np.nan, np.nan, *feet)
        start = self.way_in(motion, key).end
        wanted = speed
        while True:
            plan = self.planner.plan(start, motion, speed, key)
            margin = float(np.nan_to_num(plan.zmp_margin_m, nan=-np.inf).min())
            share, joint = self._load(plan)
            shaky = margin < self.config.zmp_margin_m or share > self.config.torque_share
            speed = plan.speed
            hopeless = plan.error.max() > self.config.reach_error
            if not shaky or hopeless or speed * SLOWER < self.config.slowest * wanted:
                break
            speed *= SLOWER
        found = [*self._too_slow(speed, wanted), *self._out_of_reach(plan)]
        if share > self.config.torque_share:
            found.append(Problem("torque", joint, share, self.config.torque_share))
        if margin < self.config.zmp_margin_m:
            found.append(Problem("balance", "the soles", margin, self.config.zmp_margin_m))
        tempo = motion.duration_s / plan.duration_s
        return Feasibility(tuple(found), speed, margin, share, tempo, *feet)

    def judge_plan(self, plan: Plan) -> tuple[Problem, ...]:
        """Return why a plan from anywhere cannot be performed: out of reach, or out of balance.

        Args:
            plan: Of one motion after another, what is between them included.
        """
        margin = float(np.nan_to_num(plan.zmp_margin_m, nan=-np.inf).min())
        found = list(self._out_of_reach(plan))
        if margin < _LEAST_MARGIN * self.config.zmp_margin_m:
            least = _LEAST_MARGIN * self.config.zmp_margin_m
            found.append(Problem("balance", "the soles", margin, least))
        return tuple(found)

    def leads_home(self, place: Reference) -> bool:
        """Return whether the robot can go from somewhere to where it stands at rest.

        Args:
            place: Where the reference robot is.
        """
        key = tuple(part.tobytes() for part in place)
        known: bool | None = self._leads_home.get(key)
        if known is None:
            finite = all(np.isfinite(part).all() for part in place)
            known = finite and not self.judge_plan(self.planner.home(place))
            self._leads_home.put(key, known)
        return known

    def way_in(self, motion: Motion, key: Hashable = None) -> Plan:
        """Return how the robot goes from rest to where a motion begins, on one foot or on two.

        Args:
            motion: See `Planner.motion`.
            key: Names the motion, see `Planner.plan`.
        """
        plan: Plan | None = None if key is None else self._ways_in.get(key)
        if plan is None:
            plan = self._way_in(motion)
            if key is not None:
                self._ways_in.put(key, plan)
        return plan

    def _way_in(self, motion: Motion) -> Plan:
        """Plan how the robot goes from rest to where a motion begins."""
        here = rest_reference(self.planner.robot)
        first = np.repeat(motion.frames[:1], 2, axis=0)
        stance = motion.stance
        if stance is not None:
            stance = stance._replace(heel=np.repeat(stance.heel[:1], 2, axis=0))
        footwork = motion.footwork
        up = -1 if footwork is None else footwork.up_at(False)
        if footwork is not None and up >= 0:
            legs, rise, apart = (
                np.repeat(part[:1], 2, axis=0)
                for part in (footwork.legs, footwork.rise, footwork.left_from_right)
            )
            return self.planner.plan(
                here, Motion(first, 1.0, Footwork(legs, rise, apart, (Lift(up, -1, 2),))), 1.0
            )
        return self.planner.plan(here, Motion(first, 1.0, stance=stance), 1.0)

    def _flight(self, motion: Motion) -> tuple[Problem, ...]:
        """Look for soles in the air while the base is higher than it can stand."""
        if motion.flight_m <= self.config.flight_m:
            return ()
        return (Problem("flight", "both feet", motion.flight_m, self.config.flight_m),)

    def _overshoot(self, motion: Motion) -> tuple[Problem, ...]:
        limits = reference_robot(self.planner.robot).limits
        tracked = motion.frames
        beyond = np.maximum(limits[:, 0] - tracked, tracked - limits[:, 1]).max(axis=0)
        return tuple(
            Problem(
                "limit",
                self.planner.robot.channels[self._columns[u]],
                float(beyond[u]),
                self.config.overshoot,
            )
            for u in np.flatnonzero(beyond > self.config.overshoot)
        )

    def _too_slow(self, speed: float, wanted: float) -> tuple[Problem, ...]:
        if speed >= self.config.slowest * wanted:
            return ()
        return (Problem("velocity", "the joints", wanted / speed, 1.0 / self.config.slowest),)

    def _out_of_reach(self, plan: Plan) -> tuple[Problem, ...]:
        knot = int(np.argmax(np.nan_to_num(plan.error, nan=np.inf)))
        worst = float(plan.error[knot])
        if worst <= self.config.reach_error:
            return ()
        robot = self.planner.robot
        legs, limits = robot.leg_joints, reference_robot(robot).stance.limits
        angles = plan.q[knot, 7:][legs]
        at_limit = (angles < limits[:, 0] + _AT_LIMIT) | (angles > limits[:, 1] - _AT_LIMIT)
        where = ", ".join(robot.joint_names[j] for j in legs[at_limit]) or "feet, COG or base"
        return (Problem("reach", where, worst, self.config.reach_error),)

    def _load(self, plan: Plan) -> tuple[float, str]:
        """Return the largest share of a torque limit, and whose that is."""
        share = self._dynamics.along(plan.q, plan.knot_s, plan.up)
        worst = np.nan_to_num(share, nan=np.inf).max(axis=0)
        joint = int(np.argmax(worst))
        return float(worst[joint]), self.planner.robot.joint_names[joint]

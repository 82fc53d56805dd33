"""What a robot makes of a library's primitives: motions, verdicts and plans."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from threading import RLock
from typing import Any, NamedTuple

import numpy as np

from mplearn.errors import InvalidValueError, LibraryError, RobotError
from mplearn.generation import StyleName, Trajectory
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.reference import N_BASE, Reference, rest_reference
from mplearn_envs.planning import Motion, Plan, Planner, joined
from mplearn_envs.robot import Retargeting, Robot

from .feasibility import Feasibility, FeasibilityCheck, FeasibilityConfig, Problem


class Foreknowledge(NamedTuple):
    """What was found out before of a library on one robot, at one speed and in one style.

    Attributes:
        verdicts: On primitives, by id.
        durations_s: How long each takes from where it starts [s], by id.
        transitions_s: How long one takes where another has just ended [s], by both ids; after None
            it is the robot at rest.

    Example:
        >>> known = Foreknowledge({}, {7: 1.4}, {(None, 7): 1.5})
        >>> known.durations_s[7], known.transitions_s[None, 7]
        (1.4, 1.5)
    """

    verdicts: Mapping[int, Feasibility]
    durations_s: Mapping[int, float]
    transitions_s: Mapping[tuple[int | None, int], float]


@dataclass(eq=False)
class Skill:
    """A primitive as one robot performs it.

    Attributes:
        frames: Its motion in the robot's channels, shape (T, 3 + n) [m, rad].
        motion: The same, ready to be planned: what is tracked, and what the feet do.
        version: How often the primitive's motion has changed.
        verdict: Whether the robot can perform it; None until that is asked.

    Example:
        >>> import numpy as np
        >>> from mplearn_envs.planning import Motion
        >>> frames = np.zeros((50, 33))
        >>> skill = Skill(frames, Motion(frames[:, :21], 50.0), version=0)
        >>> skill.lifts, skill.verdict is None  # nobody has asked whether the robot can do it
        (False, True)
    """

    frames: FloatArray
    motion: Motion
    version: int
    verdict: Feasibility | None = None

    @property
    def lifts(self) -> bool:
        """Whether a foot leaves the ground."""
        return self.motion.footwork is not None


class Skills:
    """The primitives of a library, as one robot performs them.

    What is found out about a primitive is kept until it changes; it depends on nothing else, so
    that several threads may ask.

    Args:
        library: The primitives.
        robot: The robot.
        speed: Speed of performance, as a share of the human's.
        style: How motions are generated from primitives.
        limits: What counts as feasible.
        upper_body: Whether only arms, head and the trunk's turn are performed, by a robot that
            stands: for motions whose legs it cannot follow.
        known: What was found out before, of this very library, robot, speed, style and limits.

    Attributes:
        library: The primitives, as `take` had them last.
        lock: Held while anything here changes.

    Raises:
        LibraryError: The library is for another body.
        InvalidValueError: The speed is not positive.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> from mplearn_envs.robot import humanoid
        >>> library = LibrarySource(None).now()  # the built-in one
        >>> skills = Skills(library, humanoid())
        >>> bow = library["bow down"].id
        >>> skills.feasibility(bow).feasible, skills.duration_s(bow) > library[bow].mean_duration_s
        (True, True)
    """

    def __init__(
        self,
        library: PrimitiveLibrary,
        robot: Robot,
        speed: float = 0.5,
        style: StyleName = "deterministic",
        limits: FeasibilityConfig | None = None,
        *,
        upper_body: bool = False,
        known: Foreknowledge | None = None,
    ) -> None:
        if not (np.isfinite(speed) and speed > 0):
            raise InvalidValueError(f"speed must be positive and finite, not {speed}")
        self.robot = robot
        self.speed = float(speed)
        self.style = style
        self.limits = limits
        self.upper_body = upper_body
        self.lock = RLock()
        self._foreknown = known or Foreknowledge({}, {}, {})
        self._version: dict[int, int] = {}
        self.forget()
        self.take(library)

    @cached_property
    def planner(self) -> Planner:
        """Plans for the robot."""
        return Planner(self.robot)

    @cached_property
    def _check(self) -> FeasibilityCheck:
        return FeasibilityCheck(self.planner, self.limits)

    @cached_property
    def _rest(self) -> Reference:
        return rest_reference(self.robot)

    def take(self, library: PrimitiveLibrary) -> None:
        """Take a newer snapshot; what is known of unchanged primitives is kept.

        Raises:
            LibraryError: The library is for another body.
        """
        try:
            retargeting = Retargeting(library.channels, library.body, self.robot)
        except RobotError as error:
            raise LibraryError(f"the library is not for this robot: {error}") from error
        with self.lock:
            self.library = library
            self._retargeting = retargeting
            for id in self._known.keys() - set(library.ids):
                del self._known[id]
            self._fresh.clear()

    def forget(self) -> None:
        """Forget all: what comes is another learner's, whose ids mean something else."""
        with self.lock:
            self._known: dict[int, Skill] = {}
            self._fresh: set[int] = set()  # ids whose skill is known to be this library's
            self._ends: dict[tuple[int, int], Reference] = {}
            self._transitions_s: dict[Hashable, float] = {}
            self._following: dict[Hashable, tuple[Problem, ...]] = {}

    def frames_of(self, generated: Trajectory) -> FloatArray:
        """Return a motion that the library generated, in the robot's channels, (T, 3 + n)."""
        return np.ascontiguousarray(self._retargeting(generated.frames))

    def __getitem__(self, id: int) -> Skill:
        """Return a primitive as the robot performs it."""
        with self.lock:
            if id not in self._fresh:
                self._renew(id)
                self._fresh.add(id)
            return self._known[id]

    def _renew(self, id: int) -> None:
        rng = np.random.default_rng(id)  # of styles that draw: the same motion everywhere
        generated = self.library.generate([id], style=self.style, rng=rng)
        frames = self.frames_of(generated)
        if self.upper_body:
            frames = self._standing(frames)
        if len(frames) == 1:
            frames = np.repeat(frames, 2, axis=0)
        known = self._known.get(id)
        if (
            known is None
            or known.motion.rate_hz != generated.rate_hz
            or not np.array_equal(known.frames, frames)
        ):
            version = self._version[id] = self._version.get(id, 0) + 1
            self._known[id] = Skill(frames, self.planner.motion(frames, generated.rate_hz), version)

    def _standing(self, frames: FloatArray) -> FloatArray:
        """Return frames, shape (T, 3 + n), in which base and legs are as the robot stands."""
        frames, base = frames.copy(), self._rest.target[:N_BASE]
        frames[:, :N_BASE] = base
        legs = self.robot.leg_joints
        frames[:, N_BASE + legs] = self._rest.q[7 + legs]
        return frames

    def feasibility(self, id: int) -> Feasibility:
        """Return whether the robot can perform a primitive; judged once."""
        if id in self._foreknown.verdicts:
            return self._foreknown.verdicts[id]
        with self.lock:
            skill = self[id]
            if skill.verdict is None:
                key = self.key(id)
                verdict = self._check.judge(skill.motion, self.speed, key)
                if verdict.feasible:  # now that its speed is known, so is how it comes from rest
                    found = [
                        problem
                        for plan in self._from_rest(id, verdict.speed)
                        for problem in self._check.judge_plan(plan)
                    ]
                    verdict = replace(verdict, problems=tuple(found))
                skill.verdict = verdict
            return skill.verdict

    def key(self, id: int) -> tuple[int, int]:
        """Return what tells a primitive's motion from all others, earlier versions included."""
        return id, self[id].version

    def duration_s(self, id: int) -> float:
        """Return how long a primitive that it can perform takes the robot from where it starts."""
        if id in self._foreknown.durations_s:
            return self._foreknown.durations_s[id]
        return self[id].motion.duration_s / self.feasibility(id).tempo

    def plan(self, start: Reference, id: int, speed: float = 1.0) -> Plan:
        """Return the commands that perform a primitive from the present reference.

        Where the robot stands so that it cannot begin at once, or could not come to rest after it,
        it goes to where it stands at rest, and from there to where the primitive begins. So what
        is feasible can follow whatever is feasible.

        Args:
            start: Where the reference robot is.
            id: The primitive.
            speed: As a share of the speed at which it is usually performed.
        """
        plan, verdict = self.at_once(start, id, speed), self.feasibility(id)
        if not verdict.feasible or not self.judge_plan(plan):
            return plan
        if speed != 1.0 and not self.judge_plan(usual := self.at_once(start, id)):
            return usual
        if not self.leads_home(start):
            return plan
        return joined([self.planner.home(start), *self._from_rest(id, verdict.speed)[:2]])

    def at_once(self, start: Reference, id: int, speed: float = 1.0) -> Plan:
        """Return the plan of a primitive from the present reference, sound or not; see `plan`."""
        with self.lock:
            motion, usual, key = self[id].motion, self.feasibility(id).speed, self.key(id)
        return self._settled(self.planner.plan(start, motion, usual * speed, key))

    def _from_rest(self, id: int, speed: float) -> list[Plan]:
        """Return the plans from rest to where a primitive begins, of it, and from there to rest."""
        motion, key = self[id].motion, self.key(id)
        way_in = self._check.way_in(motion, key)
        plan = self._settled(self.planner.plan(way_in.end, motion, speed, key))
        return [way_in, plan, self.planner.home(plan.end)]

    def leads_home(self, place: Reference) -> bool:
        """Return whether the robot can go from somewhere to where it stands at rest.

        From there it can perform whatever is feasible.

        Args:
            place: Where the reference robot is.
        """
        return self._check.leads_home(place)

    def transition_s(self, before: int | None, after: int) -> float:
        """Return how long a primitive takes the robot where another has just ended [s].

        Where it stands then does not depend on the way (see `plan`), so neither does this.

        Args:
            before: The one that has ended; None is the robot at rest, arms hanging.
            after: The one that is performed.
        """
        known = self._foreknown.transitions_s
        if (before, after) in known:
            return known[before, after]
        with self.lock:
            key = (None if before is None else self.key(before), self.key(after))
            if key not in self._transitions_s:
                self._transitions_s[key] = self.plan(self.end(before), after).duration_s
            return self._transitions_s[key]

    def follows(self, before: int, after: int) -> tuple[Problem, ...]:
        """Return why a primitive cannot follow another at once where that has ended; empty if so.

        Args:
            before: The one that has ended, which the robot can perform.
            after: The one that is performed then, which it can perform from where it starts.
        """
        with self.lock:
            key = (self.key(before), self.key(after))
            if key not in self._following:
                plan = self.at_once(self.end(before), after)
                self._following[key] = self._check.judge_plan(plan)
            return self._following[key]

    def judge_plan(self, plan: Plan) -> tuple[Problem, ...]:
        """Return why a plan from anywhere is not performed; empty where it is.

        It cannot be, or after it the robot could not come to rest.
        """
        problems = self._check.judge_plan(plan)
        if not problems and not self._check.leads_home(plan.end):
            problems = self._check.judge_plan(self.planner.home(plan.end))
        return problems

    def foreknown_s(self, before: int, after: int) -> float | None:
        """Return what `transition_s` does where that was found out before; None elsewhere."""
        return self._foreknown.transitions_s.get((before, after))

    def end(self, id: int | None) -> Reference:
        """Return where a primitive ends; None: where the robot stands at rest."""
        if id is None:
            return self._rest
        key = self.key(id)
        if key not in self._ends:
            start = self._check.way_in(self[id].motion, key).end
            self._ends[key] = self.at_once(start, id).end
        return self._ends[key]

    def hold(self, start: Reference, duration_s: float) -> Plan:
        """Return the commands that come to rest in the present posture."""
        return self._settled(self.planner.hold(start, duration_s))

    def _settled(self, plan: Plan) -> Plan:
        """Return a plan whose end is such that the same place recurs, to the last bit.

        The legs are solved for to about 1e-5 and depend that much on the way; and with both feet
        down it does not matter how they swung.
        """
        end = plan.end
        if end.lifted >= 0:
            return plan
        q = np.round(end.q, 4)
        q[3:7] /= np.linalg.norm(q[3:7])
        still = {"swing": self._rest.swing, "swing_velocity": self._rest.swing_velocity}
        return plan._replace(end=end._replace(q=q, **still))

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what can be worked out again, and is large."""
        left_out = ("lock", "planner", "_check")
        return {name: value for name, value in self.__dict__.items() if name not in left_out}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.lock = RLock()

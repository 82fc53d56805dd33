"""Get somewhere in the least time: a hand to a point, a posture, or a primitive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias, get_args

import numpy as np
from gymnasium import spaces

from mplearn.errors import InvalidValueError, NoPathError
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray
from mplearn_envs.execution.earliest_arrival import Arrival, earliest_arrivals
from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.soonest import Way, soonest

from .base import Choice, Scene, Task, padded
from .best import Clock, Scale, time_held
from .goals import Goal, GoalKind, HandGoals, PostureGoals, PrimitiveGoals

KindName: TypeAlias = Literal["hand", "posture", "primitive"]


@dataclass
class GoalTask(Task):
    """Reach a goal, and soon.

    The goal is drawn anew for each episode, from what the library can reach: the place of a hand or
    the posture at the end of a primitive, or the primitive itself. It is reached if the robot is
    there at the end of a macro step. Then the episode ends; so it does after ``deadline_s``.

    ======== ========================================= =============== =======================
    term     formula                                   paid            extremes
    ======== ========================================= =============== =======================
    hurry    - ``hurry``                               per second      - ``hurry`` .. 0
    reached  ``reached``                               at the goal     0 .. ``reached``
    fall     - ``fallen``                              at a fall       - ``fallen`` .. 0
    ======== ========================================= =============== =======================

    So a return lies between - ``hurry`` / (-ln gamma) - ``fallen`` and ``reached``.

    The task's observation (the time left is a share of ``deadline_s``):

    ========= ========= ================================================= ========= ======
    kind      num       meaning                                           bounds    unit
    ========= ========= ================================================= ========= ======
    hand      0, 1      which hand: left, right                           0, 1
    hand      2-4       point, from the middle of the soles, x forward    +-3       m
    hand      5-7       point minus where the hand is                     +-6       m
    hand      8         time left                                         0 .. 1
    posture   0..n+2    wanted base height, roll, pitch, joint angles     +-10      m, rad
    posture   ..2n+5    wanted minus present ones                         +-20      m, rad
    posture   last      time left                                         0 .. 1
    primitive 0..C-1    1 at the slot of the primitive                    0, 1
    primitive C         time left                                         0 .. 1
    ========= ========= ================================================= ========= ======

    Attributes:
        kind: "hand", "posture" or "primitive".
        target: The same goal in each episode: for a hand ("left", (x, y, z)) or ("right", ...) [m];
            for a posture a mapping of some of the robot's channels to values [m, rad]; for a
            primitive its id or name. None draws goals. ``reset(options={"target": ...})`` gives one
            for an episode.
        steps: Drawn goals have quickest ways of so many primitives, from the least to the most;
            None: of any number.
        deadline_s: When the episode ends [s].
        tolerance_m: How near a hand must come [m].
        tolerance_rad: How near each coordinate of a posture must come [rad]; 0.2 m of height count
            as much as 1 rad.
        far_m: Drawn points are at least so far from where the hand is at the start [m]; drawn
            postures differ by more than their tolerance from the start.
        hurry: Price of a second.
        reached: Reward of the goal.
        fallen: Price of a fall.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> task = GoalTask("primitive", target="squat down")
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task=task, dynamics="kinematic")
        >>> observation, info = env.reset(seed=1)
        >>> info["is_success"]
        False
    """

    kind: KindName = "hand"
    target: Any = None
    steps: tuple[int, int] | None = None
    deadline_s: float = 30.0
    tolerance_m: float = 0.05
    tolerance_rad: float = 0.2
    far_m: float = 0.15
    hurry: float = 0.1
    reached: float = 1.0
    fallen: float = 10.0
    terms: ClassVar[tuple[str, ...]] = ("hurry", "reached")
    reset_options: ClassVar[tuple[str, ...] | None] = ("target",)

    def __post_init__(self) -> None:
        if self.kind not in get_args(KindName):
            raise InvalidValueError(f"kind must be one of {get_args(KindName)}, not {self.kind!r}")
        for name in ("deadline_s", "tolerance_m", "tolerance_rad", "far_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InvalidValueError(f"{name} must be positive and finite, not {value}")
        if self.steps is not None:
            self.steps = (int(self.steps[0]), int(self.steps[1]))
            if not 1 <= self.steps[0] <= self.steps[1]:
                raise InvalidValueError(f"steps must be from 1, the least first, not {self.steps}")
        self._looked: tuple[PrimitiveLibrary, bytes] | None = None

    def space(self, repertoire: Repertoire) -> spaces.Box:
        """Return the bounds of the observation, see the table."""
        low, high = self._goals(repertoire).bounds()
        return spaces.Box(np.append(low, 0.0), np.append(high, 1.0), dtype=np.float64)

    def reset(self, scene: Scene) -> None:
        """Draw a goal.

        Raises:
            NoPathError: The given target cannot be reached, or nothing can; the message says what
                comes nearest.
            InvalidValueError: The target is none of this kind.
        """
        repertoire = scene.repertoire
        looked = repertoire.library, scene.choices.mask.tobytes()
        if self._looked is None or self._looked[0] is not looked[0] or self._looked[1] != looked[1]:
            self._look(scene)
            self._looked = looked
        target = scene.options.get("target", self.target)
        self.goal = self._drawn(scene) if target is None else self._kind.given(target)
        self._slots, self._least_time_s = self._ways(self.goal, repertoire)
        self._capacity = repertoire.capacity
        self._now, self._time_s = scene.measured, scene.time_s
        self._success = False
        clock = Clock.of(repertoire, scene.discount)
        soonest_s, wait_s = self._least_time_s, time_held(self.deadline_s, scene.hold_s)
        self._scale = Scale(
            self.reached * clock.worth(soonest_s) - self.hurry * clock.held(soonest_s),
            -self.hurry * clock.held(wait_s),
        )

    def observe(self) -> FloatArray:
        """Return goal, way left and time left, see the table."""
        left = max(0.0, 1.0 - self._time_s / self.deadline_s)
        return np.append(self.goal.show(self._now), left)

    def bonuses(self, choice: Choice) -> dict[str, float]:
        """Return nothing: choosing alone earns nothing."""
        return {}

    def rates(self, report: TrackingReport) -> dict[str, FloatArray]:
        """Return the term ``hurry``."""
        return {"hurry": np.full(len(report.time_s), -self.hurry)}

    def arrive(self, scene: Scene) -> dict[str, float]:
        """Return the term ``reached``."""
        self._now, self._time_s = scene.measured, scene.time_s
        self._success = self.goal.gap(scene.current, scene.measured) <= self.goal.tolerance
        return {"reached": self.reached if self._success else 0.0}

    @property
    def done(self) -> bool:
        """Whether the goal is reached, or the time is over."""
        return self._success or self._time_s >= self.deadline_s

    def report(self) -> dict[str, Any]:
        """Return success, the goal's slots, the time it takes at best, and the best return."""
        return {
            "success": self._success,
            "slots": padded(self._slots, self._capacity),
            "least_time_s": self._least_time_s,
            **self._scale.report(),
        }

    # ---- which goal

    def _look(self, scene: Scene) -> None:
        """Find out what can be reached, and how soon."""
        repertoire = scene.repertoire
        self._kind = self._goals(repertoire)
        self._far: Mapping[int, Way] = {}
        if self.steps is not None:
            self._far = soonest(repertoire, None, scene.choices)
        if self.steps is not None and self.kind == "primitive":  # how it stands does not matter
            here = scene.reference, scene.measured
            self._arrivals = {id: Arrival(way.time_s, *here) for id, way in self._far.items()}
        else:
            self._arrivals = earliest_arrivals(repertoire, scene.choices)

    def _goals(self, repertoire: Repertoire) -> GoalKind:
        if self.kind == "hand":
            return HandGoals(repertoire, self.tolerance_m, self.far_m)
        if self.kind == "posture":
            return PostureGoals(repertoire, self.tolerance_rad)
        return PrimitiveGoals(repertoire)

    def _drawn(self, scene: Scene) -> Goal:
        """Return one of the goals that can be reached in time and are not reached already."""
        goals = [
            goal
            for id, arrival in self._arrivals.items()
            if arrival.time_s <= self.deadline_s and self._is_far_enough(id)
            for goal in self._kind.at(id, arrival.measured, scene.measured)
        ]
        if not goals:
            raise NoPathError(
                f"the robot can reach no goal of kind {self.kind!r} within {self.deadline_s} s"
                + ("" if self.steps is None else f", {self.steps} primitives away")
                + ": "
                f"{len(self._arrivals)} primitives can be reached at all"
            )
        return goals[int(scene.rng.integers(len(goals)))]

    def _is_far_enough(self, id: int) -> bool:
        least, most = self.steps or (0, 0)
        return self.steps is None or least <= self._far[id].n_steps <= most

    def _ways(self, goal: Goal, repertoire: Repertoire) -> tuple[tuple[int, ...], float]:
        """Return the slots of the primitives at whose end a goal is reached, and how soon [s].

        Raises:
            NoPathError: There are none, or none in time.
        """
        soon_s = {
            id: arrival.time_s
            for id, arrival in self._arrivals.items()
            if goal.gap(id, arrival.measured) <= goal.tolerance
        }
        if not soon_s:
            why = self._kind.missed(goal, self._arrivals)
            raise NoPathError(f"the robot cannot reach {goal}: {why}")
        least_s = min(soon_s.values())
        if least_s > self.deadline_s:
            raise NoPathError(
                f"{goal} takes at least {least_s:.1f} s, longer than the deadline of "
                f"{self.deadline_s} s"
            )
        return tuple(sorted(repertoire.slots[id] for id in soon_s)), least_s

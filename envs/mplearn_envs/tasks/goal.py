"""Get somewhere in the least time: a hand to a point, a posture, or a primitive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from gymnasium import spaces

from mplearn.errors import InvalidValueError, NoPathError
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray
from mplearn_envs.measurement import Measured
from mplearn_envs.performance import Performance
from mplearn_envs.reach import Arrival, soonest_arrivals
from mplearn_envs.repertoire import Repertoire

from .base import Choice, Scene, Task
from .targets import Goal, hand_bodies, hand_target, posture_gap, posture_target

GoalKind: TypeAlias = Literal["hand", "posture", "primitive"]
_FAR_M = 3.0  # no hand is farther from the feet
_NO_POINT = np.zeros(3)


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
        deadline_s: When the episode ends [s].
        tolerance_m: How near a hand must come [m].
        tolerance_rad: How near each coordinate of a posture must come [rad]; 0.2 m of height count
            as much as 1 rad.
        far_m: Drawn points are at least so far from where the hand is at the start [m]; drawn
            postures differ by more than their tolerance from the start.
        hurry: Price of a second.
        reached: Reward of the goal.
        fallen: Price of a fall.
    """

    kind: GoalKind = "hand"
    target: Any = None
    deadline_s: float = 30.0
    tolerance_m: float = 0.05
    tolerance_rad: float = 0.2
    far_m: float = 0.15
    hurry: float = 0.1
    reached: float = 1.0
    fallen: float = 10.0

    def __post_init__(self) -> None:
        if self.kind not in get_args(GoalKind):
            raise InvalidValueError(f"kind must be one of {get_args(GoalKind)}, not {self.kind!r}")
        for name in ("deadline_s", "tolerance_m", "tolerance_rad", "far_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InvalidValueError(f"{name} must be positive and finite, not {value}")
        self._library: PrimitiveLibrary | None = None

    def space(self, repertoire: Repertoire) -> spaces.Box:
        """Return the bounds of the observation, see the table."""
        if self.kind == "hand":
            hand_bodies(repertoire)
            high = np.array([1.0, 1.0, *[_FAR_M] * 3, *[2 * _FAR_M] * 3, 1.0])
            low = -high
            low[[0, 1, 8]] = 0.0
        elif self.kind == "posture":
            width = len(repertoire.robot.channels)
            high = np.concatenate((np.full(width, 10.0), np.full(width, 20.0), [1.0]))
            low = -high
            low[-1] = 0.0
        else:
            high = np.ones(repertoire.capacity + 1)
            low = np.zeros_like(high)
        return spaces.Box(low, high, dtype=np.float64)

    def reset(self, scene: Scene) -> None:
        """Draw a goal.

        Raises:
            NoPathError: The given target cannot be reached, or nothing can; the message says what
                comes nearest.
            InvalidValueError: The target is none of this kind.
        """
        repertoire = scene.repertoire
        if self._library is not repertoire.library:
            self._arrivals = soonest_arrivals(repertoire, repertoire.entries(scene.reference))
            self._library = repertoire.library
            self._hands = hand_bodies(repertoire) if self.kind == "hand" else ()
        target = scene.options.get("target", self.target)
        self.goal = self._drawn(scene) if target is None else self._given(target, scene)
        self._slots = scene.repertoire.slots
        self._capacity = scene.repertoire.capacity
        self._success = False
        self._look(scene)

    def observe(self) -> FloatArray:
        """Return goal, way left and time left, see the table."""
        goal = self.goal
        left = max(0.0, 1.0 - self._time_s / self.deadline_s)
        if self.kind == "hand":
            out = np.zeros(9)
            out[goal.side] = 1.0
            out[2:5] = goal.point
            out[5:8] = goal.point - self._now.bodies[self._hands[goal.side]]
            out[8] = left
            return np.minimum(np.maximum(out, -2 * _FAR_M), 2 * _FAR_M)
        if self.kind == "posture":
            present = self._now.posture
            wanted = np.where(np.isnan(goal.posture), present, goal.posture)
            apart = np.clip(wanted - present, -20.0, 20.0)
            return np.concatenate((np.clip(wanted, -10.0, 10.0), apart, [left]))
        out = np.zeros(self._capacity + 1)
        out[list(goal.slots)] = 1.0
        out[-1] = left
        return out

    def bonuses(self, choice: Choice) -> dict[str, float]:
        """Return nothing: choosing alone earns nothing."""
        return {}

    def rates(self, performance: Performance) -> dict[str, FloatArray]:
        """Return the term ``hurry``."""
        return {"hurry": np.full(len(performance.time_s), -self.hurry)}

    def fall(self) -> float:
        """Return the price of a fall."""
        return -self.fallen

    def arrive(self, scene: Scene) -> dict[str, float]:
        """Return the term ``reached``."""
        self._look(scene)
        self._success = self._is_there(scene)
        return {"reached": self.reached if self._success else 0.0}

    @property
    def done(self) -> bool:
        """Whether the goal is reached, or the time is over."""
        return self._success or self._time_s >= self.deadline_s

    def report(self) -> dict[str, Any]:
        """Return success, the goal's slots, and in which time it can be reached at best."""
        return {
            "success": self._success,
            "slots": self.goal.slots,
            "least_time_s": self.goal.least_time_s,
        }

    def _look(self, scene: Scene) -> None:
        self._now, self._time_s = scene.measured, scene.time_s

    def _is_there(self, scene: Scene) -> bool:
        if self.kind == "hand":
            return self._hand_gap(self.goal, scene.measured) <= self.tolerance_m
        if self.kind == "posture":
            return posture_gap(self.goal.posture, scene.measured) <= self.tolerance_rad
        return scene.current is not None and self._slots.get(scene.current) in self.goal.slots

    def _hand_gap(self, goal: Goal, there: Measured) -> float:
        return float(np.linalg.norm(there.bodies[self._hands[goal.side]] - goal.point))

    # ---- which goal

    def _drawn(self, scene: Scene) -> Goal:
        """Return one of the goals that can be reached in time and are not reached already."""
        start = scene.measured
        goals = []
        for arrival in self._in_time().values():
            there = arrival.measured
            if self.kind == "hand":
                for side, hand in enumerate(self._hands):
                    point = there.bodies[hand]
                    if np.linalg.norm(point - start.bodies[hand]) >= self.far_m:
                        goals.append((side, point, there.posture))
            elif posture_gap(there.posture, start) > self.tolerance_rad:
                goals.append((0, _NO_POINT, there.posture))
        if self.kind == "primitive":
            ids = sorted(self._in_time())
            if not ids:
                raise NoPathError(self._nothing())
            return self._primitive_goal(ids[int(scene.rng.integers(len(ids)))], scene)
        if not goals:
            raise NoPathError(self._nothing())
        side, point, posture = goals[int(scene.rng.integers(len(goals)))]
        return self._completed(Goal(side, point, posture, (), np.inf), scene, "")

    def _nothing(self) -> str:
        return (
            f"the robot can reach no goal of kind {self.kind!r} within {self.deadline_s} s: "
            f"{len(self._arrivals)} primitives can be reached at all"
        )

    def _given(self, target: Any, scene: Scene) -> Goal:
        if self.kind == "primitive":
            return self._primitive_goal(scene.repertoire.library[target].id, scene)
        if self.kind == "hand":
            side, point = hand_target(target)
            goal = Goal(side, point, np.zeros(0), (), np.inf)
            return self._completed(goal, scene, f"the {target[0]} hand to {point.tolist()}")
        posture = posture_target(target, scene.repertoire)
        return self._completed(Goal(0, _NO_POINT, posture, (), np.inf), scene, f"{dict(target)}")

    def _primitive_goal(self, id: int, scene: Scene) -> Goal:
        library = scene.repertoire.library
        arrival = self._arrivals.get(id)
        if arrival is None:
            problems = scene.repertoire.feasibility(id).problems
            why = "; ".join(map(str, problems)) or "no way leads there"
            raise NoPathError(f"the robot cannot reach primitive {library[id].name!r}: {why}")
        self._require_time(arrival, f"primitive {library[id].name!r}")
        slot = scene.repertoire.slots[id]
        return Goal(0, _NO_POINT, np.zeros(0), (slot,), arrival.time_s)

    def _completed(self, goal: Goal, scene: Scene, what: str) -> Goal:
        """Return the goal with the primitives at whose end it is reached.

        Raises:
            NoPathError: There are none.
        """
        gaps = {
            id: self._hand_gap(goal, arrival.measured)
            if self.kind == "hand"
            else posture_gap(goal.posture, arrival.measured)
            for id, arrival in self._arrivals.items()
        }
        allowed = self.tolerance_m if self.kind == "hand" else self.tolerance_rad
        ids = [id for id, gap in gaps.items() if gap <= allowed]
        if not ids:
            nearest = min(gaps, key=lambda id: gaps[id], default=None)
            near = (
                "no primitive can be reached at all"
                if nearest is None
                else f"the nearest, at the end of {scene.repertoire.library[nearest].name!r}, "
                f"misses by {gaps[nearest]:.3g}, allowed {allowed:.3g}"
            )
            raise NoPathError(f"the robot cannot bring {what}: {near}")
        soonest = min((self._arrivals[id] for id in ids), key=lambda arrival: arrival.time_s)
        self._require_time(soonest, what)
        slots = tuple(sorted(scene.repertoire.slots[id] for id in ids))
        return goal._replace(slots=slots, least_time_s=soonest.time_s)

    def _require_time(self, arrival: Arrival, what: str) -> None:
        if arrival.time_s > self.deadline_s:
            raise NoPathError(
                f"{what} takes at least {arrival.time_s:.1f} s, longer than the deadline of "
                f"{self.deadline_s} s"
            )

    def _in_time(self) -> dict[int, Arrival]:
        return {id: a for id, a in self._arrivals.items() if a.time_s <= self.deadline_s}

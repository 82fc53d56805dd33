"""Bring a hand to a point."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.execution.sensors import Measured

from .base import Goal, GoalKind

SIDES = ("left", "right")
FAR_M = 3.0  # no hand is farther from the feet


@dataclass(frozen=True, eq=False)
class HandGoal(Goal):
    """A hand at a point.

    Attributes:
        side: 0: the left hand, 1: the right one.
        point: Where it shall be, from the middle of the soles, x forward, shape (3,) [m].
        body: The hand's body.
        tolerance: How near it must come [m].
    """

    side: int
    point: FloatArray
    body: int
    tolerance: float

    def __str__(self) -> str:
        """Say what is wanted."""
        return f"the {SIDES[self.side]} hand at {np.round(self.point, 3).tolist()}"

    def show(self, now: Measured) -> FloatArray:
        """Return which hand, the point, and the point minus where the hand is, shape (8,)."""
        out = np.zeros(8)
        out[self.side] = 1.0
        out[2:5] = self.point
        out[5:8] = self.point - now.bodies[self.body]
        return np.minimum(np.maximum(out, -2 * FAR_M), 2 * FAR_M)

    def gap(self, id: int | None, there: Measured) -> float:
        """Return the distance from the hand to the point [m]."""
        return float(np.linalg.norm(there.bodies[self.body] - self.point))


@dataclass(frozen=True)
class HandGoals(GoalKind):
    """Goals of hands.

    Attributes:
        tolerance_m: How near a hand must come [m].
        far_m: Drawn points are at least so far from where the hand is at the start [m].

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> from mplearn_envs.robot import humanoid
        >>> from mplearn_envs.skills.repertoire import Repertoire
        >>> repertoire = Repertoire(LibrarySource(None).now(), humanoid())
        >>> goals = HandGoals(repertoire, tolerance_m=0.05, far_m=0.15)
        >>> str(goals.given(("left", (0.3, 0.2, 1.0))))
        'the left hand at [0.3, 0.2, 1.0]'
    """

    tolerance_m: float
    far_m: float

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the bounds of what goals show, shape (8,) each.

        Raises:
            InvalidValueError: The robot has no hands.
        """
        _ = self.hands
        high = np.array([1.0, 1.0, *[FAR_M] * 3, *[2 * FAR_M] * 3])
        low = -high
        low[:2] = 0.0
        return low, high

    def given(self, target: Any) -> HandGoal:
        """Return the goal of ("left" or "right", (x, y, z) [m]).

        Raises:
            InvalidValueError: It is no hand's target.
        """
        try:
            side, point = target
            point = np.array(point, dtype=np.float64)
            if side not in SIDES or point.shape != (3,) or not np.isfinite(point).all():
                raise ValueError
        except (TypeError, ValueError):
            raise InvalidValueError(
                f"a hand's target is ('left' or 'right', (x, y, z)) [m], not {target!r}"
            ) from None
        number = SIDES.index(side)
        return HandGoal(number, point, self.hands[number], self.tolerance_m)

    def at(self, id: int, there: Measured, start: Measured) -> Iterator[HandGoal]:
        """Yield where the hands are, if that is far from where they were."""
        for side, hand in enumerate(self.hands):
            point = there.bodies[hand]
            if np.linalg.norm(point - start.bodies[hand]) >= self.far_m:
                yield HandGoal(side, point, hand, self.tolerance_m)

    @cached_property
    def hands(self) -> tuple[int, ...]:
        """The bodies of the left and of the right hand.

        Raises:
            InvalidValueError: The robot has none.
        """
        robot = self.repertoire.robot
        roles = dict(robot.segments)
        if not {"hand_l", "hand_r"} <= set(roles):
            raise InvalidValueError(
                f"robot {robot.name!r} has no hands among its segments {sorted(roles)}; "
                "choose another kind of goal"
            )
        model = robot.model()
        return tuple(model.body(roles[role]).id for role in ("hand_l", "hand_r"))

"""Plans on what the robot will have seen when: the oracle where a library grows meanwhile.

What a learner has seen by a moment does not depend on what the robot does, so it can be looked at
beforehand. Then the graph is known for all times, and what is best on it is computed: for tasks
that name primitives by dynamic programming over time and place, for free motion, whose rewards look
back, by a beam search over what can be done next.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.skills.action_choices import HOLD

from .base import Policy, legal_actions
from .timeline import START, TICK_S, Place, Timeline, Way

_HORIZON_S, _BEAM = 12.0, 20  # of the beam search, as `Search` has them


class _Walk(NamedTuple):
    """A sequence that was tried.

    Attributes:
        value: What it earns, discounted to its start, as far as it lies within the horizon.
        worth: Discount of whatever follows.
        time_s: How long it takes [s].
        place: Where it ends.
        history: Ids of what was performed, before it too.
        first: Its first primitive; None holds.
    """

    value: float
    worth: float
    time_s: float
    place: Place
    history: tuple[int, ...]
    first: int | None


class Clairvoyant(Policy):
    """The oracle of an online environment: it knows what will be known when, and plans on that.

    What others miss of its return is their regret. With ``goal`` and ``recite`` it takes the way
    that is best on a grid of 0.1 s, with ``free`` the first step of the best sequence that a beam
    search finds for the next 12 s. Plans are taken at their word: nobody falls in them. Of speeds
    it takes the usual one.

    Args:
        env: An environment "mplearn/OnlinePrimitiveHumanoid-v0", whose insides it looks at.

    Raises:
        InvalidValueError: The environment or its task is another.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> options = {"dynamics": "kinematic", "warm_up_s": 20.0}
        >>> env = gym.make("mplearn/OnlinePrimitiveHumanoid-v0", **options)
        >>> policy = Clairvoyant(env)
        >>> observation, info = env.reset(seed=1)
        >>> bool(info["action_mask"][policy.act(observation, info)])
        True
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        # MuJoCo is not imported before it is needed
        from mplearn_envs.environment.online import OnlinePrimitiveHumanoidEnv
        from mplearn_envs.tasks import FreeTask, GoalTask, ReciteTask

        self._env: Any = env.unwrapped
        if not isinstance(self._env, OnlinePrimitiveHumanoidEnv):
            raise InvalidValueError(
                "this policy needs 'mplearn/OnlinePrimitiveHumanoid-v0', where what is known does "
                f"not depend on what the robot does, not {type(self._env).__name__}"
            )
        task = self._env.task
        if not isinstance(task, (FreeTask, GoalTask, ReciteTask)):
            raise InvalidValueError(
                f"this policy plans for the tasks 'free', 'goal' and 'recite', not for {task!r:.80}"
            )
        self._free, self._in_order = isinstance(task, FreeTask), isinstance(task, ReciteTask)
        self._timeline: Timeline | None = None

    def reset(self, seed: int | None = None) -> None:
        """Forget the episode."""
        self._timeline = None

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the action that is best, by what will be known when."""
        if self._timeline is None:
            self._timeline = Timeline(self._env)
            self._time_s, self._place = 0.0, START
            self._history: tuple[int, ...] = ()
            self._values: dict[tuple[int | None, ...], FloatArray] = {}
        else:
            self._time_s += info["duration_s"]
        current = int(info["primitive"])
        self._place = (self._place[0], True) if current < 0 else (current, False)
        slots, legal = self._env.repertoire.slots, legal_actions(info)
        ways = [
            way
            for way in self._timeline.ways(self._place, self._time_s)
            if way.id is None or (way.id in slots and legal[slots[way.id]])
        ]
        best = (self._wander if self._free else self._arrive)(self._timeline, ways, info)
        if best is None:
            return HOLD
        self._history = (*self._history, best)
        return int(slots[best])

    # ---- to what the task wants

    def _arrive(self, timeline: Timeline, ways: list[Way], info: Mapping[str, Any]) -> int | None:
        """Return the primitive that leads best to what the task wants; None holds."""
        primitive = self._env.repertoire.primitive
        left = tuple(primitive(int(slot)) for slot in info["task"]["slots"] if slot >= 0)
        wanted, rest, pay = self._next(left)
        values, then = self._solved(timeline, left), self._solved(timeline, rest)

        def worth(way: Way) -> float:
            k = min(round((self._time_s + way.time_s) / TICK_S), len(values) - 1)
            reached = way.id is not None and way.id in wanted
            later = (then if reached else values)[k, timeline.number(way.to)]
            return float(way.paid + timeline.clock.worth(way.time_s) * (reached * pay + later))

        return max(ways, key=worth).id

    def _next(
        self, left: tuple[int | None, ...]
    ) -> tuple[set[int | None], tuple[int | None, ...], float]:
        """Return which primitives are wanted next, what is left then, and what they are paid."""
        task = self._env.task
        if not self._in_order:
            return set(left), (), task.reached
        return set(left[:1]), left[1:], task.said + (0.0 if left[1:] else task.complete)

    def _solved(self, timeline: Timeline, left: tuple[int | None, ...]) -> FloatArray:
        """Return what can be earned from each moment and place on, (N, P)."""
        if left not in self._values:
            wanted, rest, pay = self._next(left)
            then = self._solved(timeline, rest) if rest else None
            known = {id for id in wanted if id is not None}
            deadline_s = self._env.task.deadline_s
            values = timeline.values(deadline_s, known, pay, then)
            self._values[left] = values if left else np.zeros_like(values)
        return self._values[left]

    # ---- free motion

    def _wander(self, timeline: Timeline, ways: list[Way], info: Mapping[str, Any]) -> int | None:
        """Return the first primitive of the best sequence that is found; None holds."""
        here = _Walk(0.0, 1.0, 0.0, self._place, self._history, None)
        going = [self._continued(here, way, timeline) for way in ways]
        going = [walk._replace(first=way.id) for walk, way in zip(going, ways, strict=True)]
        ended: list[_Walk] = []
        while going:
            ended += [walk for walk in going if walk.time_s >= _HORIZON_S]
            going = [walk for walk in going if walk.time_s < _HORIZON_S]
            going = heapq.nsmallest(_BEAM, going, key=lambda walk: -walk.value / walk.time_s)
            going = [
                self._continued(walk, way, timeline)
                for walk in going
                for way in timeline.ways(walk.place, self._time_s + walk.time_s)
            ]
        return max(ended, key=lambda walk: walk.value).first

    def _continued(self, walk: _Walk, way: Way, timeline: Timeline) -> _Walk:
        """Return a sequence that goes on; what lies beyond the horizon is not paid for."""
        from mplearn_envs.tasks import Choice

        choice = Choice(way.id, True, way.probability, walk.history)
        paid = way.paid + sum(self._env.task.bonuses(choice).values())
        within = min(1.0, (_HORIZON_S - walk.time_s) / way.time_s)
        return _Walk(
            walk.value + walk.worth * within * paid,
            walk.worth * timeline.clock.worth(way.time_s),
            walk.time_s + way.time_s,
            way.to,
            walk.history if way.id is None else (*walk.history, way.id),
            walk.first,
        )

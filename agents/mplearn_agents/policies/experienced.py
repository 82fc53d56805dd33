"""Learns what actions lead to by trying them, and goes where its own experience says is best.

What an action takes, costs and risks is the same whatever one wants, so it is learned once, by
exploring: the action that was tried least often comes next. What is legal where is a matter of
luck, for it depends on the person; so each place keeps the sets of actions that were ever legal
there, and a way counts as much as it is to be expected (unlike on a pooled graph, which takes ways
of different people for one's own). What is seen in an episode holds for the rest of it. From all
this, value iteration finds what to do, for whatever goal.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.skills.action_choices import HOLD

from .base import Policy, legal_actions

EXPLORED = 8000  # macro steps of trying
_DOUBT = 10.0  # so many macro steps of the average weigh as much as one's own
_SWEEPS = 400
_CLOSE = 1e-6

Legal = tuple[int, ...]  # actions that are legal somewhere, hold not among them


@dataclass
class Experience:
    """What was found out, of A actions in each of C places: the primitive performed last.

    Attributes:
        capacity: Number of slots C; an action is a slot at one of some speeds.
        legal: How often which actions were legal in a place.
        tried: How often each action was tried in a place, shape (C, A).
        time_s: Sum of how long these took, (C, A) [s].
        worth: Sum of the discounts over these, (C, A).
        cost: Sum of what they earned, but for goals and falls, (C, A).
        falls: How many of them ended in a fall, (C, A).
    """

    capacity: int
    n_actions: int
    legal: defaultdict[int, Counter[Legal]] = field(default_factory=lambda: defaultdict(Counter))

    def __post_init__(self) -> None:
        shape = self.capacity, self.n_actions
        self.tried, self.time_s, self.worth = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        self.cost, self.falls = np.zeros(shape), np.zeros(shape)

    def note(
        self,
        place: int,
        action: int,
        duration_s: float,
        discount: float,
        cost: float,
        fallen: bool,
    ) -> None:
        """Remember what came of an action."""
        self.tried[place, action] += 1
        self.time_s[place, action] += duration_s
        self.worth[place, action] += discount
        self.cost[place, action] += cost
        self.falls[place, action] += fallen

    def expected(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return what each action is thought to cost, its discount, and its risk, (C, A) each.

        What was tried seldom is thought to be like the same action elsewhere, and that like all.
        """
        n = self.tried.sum(axis=0)
        risk = self.falls.sum() / max(n.sum(), 1.0)
        risk_of = (self.falls.sum(axis=0) + _DOUBT * risk) / (n + _DOUBT)
        risks = (self.falls + _DOUBT * risk_of) / (self.tried + _DOUBT)
        mean = [part.sum(axis=0) / np.maximum(n, 1.0) for part in (self.cost, self.worth)]
        all_ = [part.sum() / max(n.sum(), 1.0) for part in (self.cost, self.worth)]
        usual = [np.where(n > 0, own, every) for own, every in zip(mean, all_, strict=True)]
        cost, worth = (
            np.where(self.tried > 0, part / np.maximum(self.tried, 1.0), other)
            for part, other in zip((self.cost, self.worth), usual, strict=True)
        )
        return cost, worth, risks


class Experienced(Policy):
    """Goes to what the task wants, by what it has found out itself.

    Args:
        experience: What that is.
        in_order: Whether the task wants one slot after the other, or any of them.
        reached: What the task pays where it is fulfilled.
        fallen: What a fall costs.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task="recite", dynamics="kinematic")
        >>> policy = Experienced.for_env(env, steps=50, seed=1)
        >>> observation, info = env.reset(seed=1)
        >>> bool(info["action_mask"][policy.act(observation, info)])
        True
    """

    def __init__(
        self, experience: Experience, in_order: bool, reached: float = 1.0, fallen: float = 10.0
    ) -> None:
        self.experience, self.in_order = experience, in_order
        self.reached, self.fallen = reached, fallen
        self._cost, self._worth, self._risk = experience.expected()
        self._seen: dict[int, Legal] = {}
        self._values: dict[tuple[int, ...], FloatArray] = {}

    @classmethod
    def for_env(
        cls, env: gymnasium.Env[Any, Any], steps: int = EXPLORED, seed: int = 0
    ) -> Experienced:
        """Return the policy for an environment that `gymnasium.make` made, after exploring.

        It explores a kinematic twin; where there are several people, with those of "train".

        Raises:
            InvalidValueError: The environment was made otherwise.
        """
        from mplearn_envs.tasks import ReciteTask

        twin = twin_of(env)
        experience = explore(twin, steps, seed)
        twin.close()
        task: Any = env.unwrapped.task  # type: ignore[attr-defined]
        in_order = isinstance(task, ReciteTask)
        reached = task.said if in_order else getattr(task, "reached", 1.0)
        return cls(experience, in_order, reached, task.fallen)

    def reset(self, seed: int | None = None) -> None:
        """Forget what was seen in the episode."""
        self._seen, self._values = {}, {}

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the action from which the most is to be expected.

        Raises:
            InvalidValueError: The task names no slots.
        """
        slots = tuple(int(s) for s in info.get("task", {}).get("slots", ()) if s >= 0)
        if not slots:
            raise InvalidValueError(
                "this policy needs a task that names slots in info['task'], like 'goal' and "
                f"'recite'; info['task'] is {info.get('task')}"
            )
        place = int(observation["current_primitive"])
        legal = _legal(info, self.experience.capacity)
        if not legal:
            return HOLD
        if self._seen.get(place) != legal:
            self._seen[place] = legal
            self._values = {}
        goals = slots[:1] if self.in_order else slots
        if goals not in self._values:
            self._values[goals] = self._solved(goals)
        values = self._of_actions(np.full(len(legal), place), np.array(legal), goals)
        return legal[int(np.argmax(values(self._values[goals])))]

    def _of_actions(self, places: IntArray, actions: IntArray, goals: tuple[int, ...]) -> Any:
        """Return what says how good actions are, given how good places are."""
        to = actions % self.experience.capacity
        cost, worth, risk = (
            part[places, actions] for part in (self._cost, self._worth, self._risk)
        )
        there, stood = np.isin(to, goals), worth * (1.0 - risk)
        fixed = cost - risk * self.fallen * worth + stood * there * self.reached
        onward = stood * ~there
        return lambda values: fixed + onward * values[to]

    def _solved(self, goals: tuple[int, ...]) -> FloatArray:
        """Return how much is to be expected in each place, shape (C,), by value iteration."""
        places: list[int] = []
        sets: list[Legal] = []
        shares: list[float] = []
        for place, known in self.experience.legal.items():
            own = {self._seen[place]: 1} if place in self._seen else known
            total = sum(own.values())
            for legal, times in own.items():
                places.append(place)
                sets.append(legal)
                shares.append(times / total)
        sizes = [len(legal) for legal in sets]
        start = np.concatenate(([0], np.cumsum(sizes)[:-1])).astype(np.int64)
        each, share = np.array(places), np.array(shares)
        actions = np.concatenate([np.array(legal) for legal in sets])
        good = self._of_actions(np.repeat(each, sizes), actions, goals)
        values = np.zeros(self.experience.capacity)
        for _ in range(_SWEEPS):
            best = np.maximum.reduceat(good(values), start)
            after = np.zeros_like(values)
            np.add.at(after, each, share * best)
            change, values = np.abs(after - values).max(), after
            if change < _CLOSE:
                break
        return values


def twin_of(env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
    """Return a kinematic twin to explore; where there are several people, with those of "train".

    Raises:
        InvalidValueError: The environment was made otherwise than by `gymnasium.make`.
    """
    if env.spec is None:
        raise InvalidValueError("a twin needs env.spec, which gymnasium.make supplies")
    options = {**env.spec.kwargs, "dynamics": "kinematic", "render_mode": None}
    if hasattr(env.unwrapped, "people"):
        options["people"] = "train"
    return gymnasium.make(env.spec.id, **options, disable_env_checker=True)


def explore(
    env: gymnasium.Env[Any, Any],
    steps: int,
    seed: int = 0,
    watch: Callable[[Mapping[str, Any]], None] = lambda _: None,
) -> Experience:
    """Return what is found out by trying in each place what was tried there least.

    Args:
        env: The environment.
        steps: Macro steps.
        seed: Of the episodes, and of what is tried first.
        watch: Told of each observation.
    """
    actor: Any = env.unwrapped
    experience = Experience(actor.capacity, int(actor.action_space.n))
    rng = np.random.default_rng(seed)
    observation, info = env.reset(seed=seed)
    for _ in range(steps):
        watch(observation)
        place, legal = int(observation["current_primitive"]), _legal(info, experience.capacity)
        action = HOLD
        if legal:
            experience.legal[place][legal] += 1
            often = experience.tried[place, list(legal)] + rng.random(len(legal))
            action = legal[int(np.argmin(often))]
        observation, reward, terminated, truncated, info = env.step(action)
        terms = info["reward_terms"]
        goals = sum(terms.get(name, 0.0) for name in ("reached", "said", "complete", "fall"))
        cost = float(reward) - goals
        if action != HOLD:
            took_s, discount = info["duration_s"], info["discount"]
            experience.note(place, action, took_s, discount, cost, bool(info["fallen"]))
        if terminated or truncated:
            observation, info = env.reset()
    return experience


def _legal(info: Mapping[str, Any], capacity: int) -> Legal:
    """Return the legal actions, without holding at whichever speed."""
    return tuple(a for a in np.flatnonzero(legal_actions(info)).tolist() if a % capacity != HOLD)

"""Follows a demonstrator by planning in many futures of his at once (hindsight optimisation).

Futures are drawn from what one thinks of the demonstrator; for each the best plan is computed by
dynamic programming, as if that future were known; and an action is worth what it earns on average
when one goes on so. Alone that would be too good a plan, for it waits in the belief of knowing all
a moment later [Yoon2008]; so for the next few decisions futures are told apart only by what will
have been recognised until then.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import gymnasium
import networkx as nx
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.skills.action_choices import HOLD, drawn_slot
from mplearn_envs.skills.repertoire import Repertoire

from .base import Policy, legal_actions, transition_prior
from .futures import Futures, Shown, Steps, worth

if TYPE_CHECKING:
    from mplearn_envs.tasks import FollowTask

_TRIES = 20  # at a future that agrees with what is seen


class Seen(NamedTuple):
    """What one sees of the demonstrator.

    Attributes:
        slot: Of the motion recognised last; 0 where none is.
        share: Time since it began, as a share of how long it usually takes.
        next: How likely each primitive comes after it, by what the robot knows, shape (C,).
        time_s: Time in the episode [s].
    """

    slot: int
    share: float
    next: FloatArray
    time_s: float

    @classmethod
    def of(cls, shown: FloatArray, capacity: int, deadline_s: float) -> Seen:
        """Return what an observation of the task ``follow`` shows.

        Raises:
            InvalidValueError: It is another task's.
        """
        if len(shown) != 3 * capacity + 2:
            raise InvalidValueError(
                f"this policy needs the task 'follow', which shows {3 * capacity + 2} numbers, "
                f"not {len(shown)}"
            )
        slot = int(np.argmax(shown[:capacity])) if shown[:capacity].any() else HOLD
        following = np.array(shown[capacity : 2 * capacity])
        return cls(slot, float(shown[-2]), following, (1.0 - float(shown[-1])) * deadline_s)


class Outlook(ABC):
    """What one thinks of the demonstrator, and of what one can do oneself, in C slots.

    Attributes:
        usual_s: How long each motion usually takes the demonstrator, shape (C,) [s].
        grows: Whether what the demonstrator shows becomes legal where it was shown.
    """

    usual_s: FloatArray
    grows: bool = False

    def begin(self) -> None:  # noqa: B027  (one may know all beforehand)
        """Forget what was seen in an episode."""

    def notice(self, seen: Seen, place: int, info: Mapping[str, Any]) -> None:  # noqa: B027
        """Take in what is seen before a choice.

        Args:
            seen: Of the demonstrator.
            place: Slot of what was performed last.
            info: The environment's.
        """

    @abstractmethod
    def likely(self, slot: int, time_s: float) -> FloatArray:
        """Return how likely the demonstrator goes on with each slot, shape (C,)."""

    @abstractmethod
    def lasts_s(self) -> FloatArray:
        """Return how long the robot takes for each slot after each, (C, C) [s]; NaN: illegal."""


@dataclass(frozen=True)
class Foresight:
    """How far to look ahead.

    Attributes:
        horizon_s: What comes later does not count [s].
        futures: How many.
        decisions: For how many, after the next one, futures are told apart by what is recognised.
        tick_s: Between the moments that are looked at [s].

    Example:
        >>> Foresight(horizon_s=10.0, tick_s=0.1).ticks
        100
    """

    horizon_s: float = 15.0
    futures: int = 32
    decisions: int = 3
    tick_s: float = 0.1

    def __post_init__(self) -> None:
        if not (self.tick_s > 0 and self.horizon_s >= self.tick_s):
            raise InvalidValueError(
                "tick_s must be positive and horizon_s no less, "
                f"not {self.tick_s} and {self.horizon_s}"
            )
        if self.futures < 1 or self.decisions < 0:
            raise InvalidValueError(
                "there is at least 1 future, and no fewer than 0 decisions, "
                f"not {self.futures} and {self.decisions}"
            )

    @property
    def ticks(self) -> int:
        """How many moments there are until the horizon."""
        return round(self.horizon_s / self.tick_s)


class Hindsight(Policy):
    """For the task ``follow``: takes what is best on average over many futures.

    Args:
        outlook: What it thinks of the demonstrator and of itself.
        task: The task's settings.
        discount: Of the environment, per second.
        hold_s: Duration of holding [s].
        foresight: How far it looks ahead.
        seed: Of the futures.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> from mplearn_agents.policies import hindsight
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task="follow", dynamics="kinematic")
        >>> policy = hindsight(env)
        >>> policy.reset(seed=1)
        >>> observation, info = env.reset(seed=1)
        >>> bool(info["action_mask"][policy.act(observation, info)])
        True
    """

    def __init__(
        self,
        outlook: Outlook,
        task: FollowTask,
        discount: float,
        hold_s: float,
        foresight: Foresight | None = None,
        seed: int | None = None,
    ) -> None:
        self.outlook, self.task = outlook, task
        self.discount, self.hold_s = discount, hold_s
        self.foresight = foresight or Foresight()
        self._rng = np.random.default_rng(seed)
        self._first: FloatArray | None = None
        self._place = HOLD  # the last one where something was performed

    @classmethod
    def for_env(cls, env: gymnasium.Env[Any, Any], outlook: Outlook) -> Hindsight:
        """Return the policy for an environment with the task ``follow``.

        Raises:
            InvalidValueError: It has another task.
        """
        actor: Any = env.unwrapped
        return cls(outlook, follow_task(env), actor.discount, actor.actions.hold_s)

    def reset(self, seed: int | None = None) -> None:
        """Forget the episode; with a seed, whatever follows is reproducible."""
        self._first, self._place = None, HOLD
        self.outlook.begin()
        if seed is not None:
            self._rng = np.random.default_rng(seed)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the action that is best on average.

        Raises:
            InvalidValueError: The observation is not that of the task ``follow``.
        """
        legal, capacity = legal_actions(info), len(self.outlook.usual_s)
        if self._first is None:
            self._first = transition_prior(info)[:capacity]
        seen = Seen.of(observation["task"], capacity, self.task.deadline_s)
        place = int(observation["current_primitive"])
        self.outlook.notice(seen, place, info)
        place = self._place = place if place != HOLD else self._place
        possible = [slot for slot in np.flatnonzero(legal[:capacity]).tolist() if slot != HOLD]
        if not possible:
            return HOLD
        lasts_s = self.outlook.lasts_s().copy()
        took_s = lasts_s[place, possible]
        lasts_s[place] = np.nan
        usual_s: FloatArray = self.outlook.usual_s[possible] * self.task.pace
        if np.isfinite(lasts_s).any():
            usual_s = np.full(len(possible), np.nanmedian(lasts_s))
        lasts_s[place, possible] = np.where(np.isfinite(took_s), took_s, usual_s)
        ticks = np.maximum(1.0, np.rint(lasts_s / self.foresight.tick_s))
        plan, places = self._plan(seen, ticks, place)
        return int(places[plan.best(int(np.searchsorted(places, place)), self.foresight.decisions)])

    def _plan(self, seen: Seen, ticks: FloatArray, place: int) -> tuple[_Plan, IntArray]:
        """Return what is best in drawn futures, and the places, which are numbered anew there."""
        far, n, n_futures = self.foresight, self.foresight.ticks, self.foresight.futures
        middle_s = (np.arange(n) + 0.5) * far.tick_s
        weights = np.asarray(self.task.agree * far.tick_s * self.discount**middle_s, np.float64)
        weights[middle_s > self.task.deadline_s - seen.time_s] = 0.0
        drawn = [self._future(seen) for _ in range(n_futures)]
        longest = max(len(slots) for slots, _, _ in drawn) - 1
        before, order = np.full((2, n_futures, longest), -1)
        known = np.full((n_futures, longest), n + 1)
        doing = np.empty((n_futures, n), np.int64)
        for k, (slots, ends_s, known_s) in enumerate(drawn):
            doing[k] = slots[np.searchsorted(ends_s, middle_s)]
            before[k, : len(slots) - 1], order[k, : len(slots) - 1] = slots[:-1], slots[1:]
            known[k, : len(slots) - 1] = np.ceil(known_s[1:] / far.tick_s - 1e-9)
        own = self.outlook.usual_s * self.task.pace / far.tick_s
        took = np.maximum(1, np.rint(own[order])).astype(np.int64)
        new = (before > 0) & ~np.isfinite(ticks[before, order]) & self.outlook.grows
        places, soonest = _within_reach(ticks, before[new], order[new], took[new], place, n)
        every = np.union1d(places, doing)
        first = np.full(len(every), n)
        first[np.searchsorted(every, places)] = soonest
        steps = Steps.of(ticks[np.ix_(every, every)], max(1, round(self.hold_s / far.tick_s)))
        within = np.zeros(len(ticks), np.bool_)
        within[every] = True
        new &= within[before] & within[order]
        shown = Shown.of(
            np.where(within[order], np.searchsorted(every, order), -2 - order),
            known,
            np.where(new, np.searchsorted(every, before), -1),
            took,
        )
        futures = Futures.of(np.searchsorted(every, doing), steps, shown, weights, first)
        return _Plan(steps, futures, shown), every

    def _future(self, seen: Seen) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return slots from the motion recognised last on, when they end, and are recognised [s].

        Times are counted from now. The first is the one recognised last; before there is any, it is
        what might have been before the first.
        """
        rng, task, outlook = self._rng, self.task, self.outlook
        since_s = seen.share * outlook.usual_s[seen.slot] if seen.slot else seen.time_s
        for _ in range(_TRIES):
            end_s = self._drawn_s(seen.slot) - since_s if seen.slot else -since_s
            prior = self._first if not seen.slot else outlook.likely(seen.slot, seen.time_s + end_s)
            assert prior is not None
            following = drawn_slot(prior, rng)
            lasts_s = self._drawn_s(following)
            if end_s + task.recognised_after * lasts_s > 0:
                break
        else:  # what is seen is unlikely: it goes on for another moment
            end_s = max(end_s, 0.0)
        slots, ends_s, known_s = [seen.slot], [end_s], [-since_s]
        while ends_s[-1] <= self.foresight.horizon_s:
            known_s.append(max(ends_s[-1] + task.recognised_after * lasts_s, 1e-6))
            ends_s.append(ends_s[-1] + lasts_s)
            slots.append(following)
            following = drawn_slot(outlook.likely(following, seen.time_s + ends_s[-1]), rng)
            lasts_s = self._drawn_s(following)
        return np.array(slots), np.array(ends_s), np.array(known_s)

    def _drawn_s(self, slot: int) -> float:
        """Return how long a motion may take the demonstrator [s]."""
        spread = np.exp(self.task.variation * self._rng.standard_normal())
        return float(self.outlook.usual_s[slot] * spread)


class _Plan(NamedTuple):
    """What is to be done in drawn futures.

    Attributes:
        steps: What can be done where.
        futures: What it is worth in each.
        shown: What is recognised when.
    """

    steps: Steps
    futures: Futures
    shown: Shown

    def best(self, place: int, decisions: int) -> int:
        """Return the place to which the best action leads; 0, hold's, for holding."""
        every = np.arange(len(self.futures.row))
        values = {
            performed: self.futures.earned(performed, ticks)
            + worth(every, to, ticks, decisions, *self)
            for performed, to, ticks in self.steps.at(place)
        }
        return max(values, key=lambda performed: (values[performed], -performed))


def follow_task(env: gymnasium.Env[Any, Any]) -> FollowTask:
    """Return an environment's task ``follow``.

    Raises:
        InvalidValueError: It has another task.
    """
    from mplearn_envs.tasks import FollowTask  # MuJoCo is not imported before it is needed

    task: Any = env.unwrapped.task  # type: ignore[attr-defined]
    if not isinstance(task, FollowTask):
        raise InvalidValueError(f"this policy needs the task 'follow', not {task!r:.80}")
    return task


def own_times(repertoire: Repertoire, ways: FloatArray) -> FloatArray:
    """Return how long the robot takes for each slot after each, (C, C) [s]; NaN where no way leads.

    Args:
        repertoire: What it can perform.
        ways: More than 0 where a way leads from slot to slot, (C, C).
    """
    out, skills = np.full(ways.shape, np.nan), repertoire.skills
    for before, after in zip(*np.nonzero(ways), strict=True):
        ids = repertoire.primitive(int(before)), repertoire.primitive(int(after))
        if ids[1] is not None:
            known_s = None if ids[0] is None else skills.foreknown_s(ids[0], ids[1])
            out[before, after] = skills.duration_s(ids[1]) if known_s is None else known_s
    return out


def _within_reach(
    ticks: FloatArray,
    new_before: IntArray,
    new_after: IntArray,
    new_took: IntArray,
    place: int,
    horizon: int,
) -> tuple[IntArray, IntArray]:
    """Return the places in which one can be before the horizon, in order, and how soon.

    Hold's place is the first of them, whether one can be there or not. The new ways are those that
    may become legal until then.
    """
    ways: nx.DiGraph[int] = nx.DiGraph()
    ways.add_nodes_from((HOLD, place))
    new = zip(new_before.tolist(), new_after.tolist(), new_took.tolist(), strict=True)
    ways.add_weighted_edges_from(new)
    before, after = np.nonzero(np.isfinite(ticks))
    took = ticks[before, after].astype(np.int64)
    ways.add_weighted_edges_from(zip(before.tolist(), after.tolist(), took.tolist(), strict=True))
    soonest = nx.single_source_dijkstra_path_length(ways, place, horizon)
    soonest.setdefault(HOLD, horizon)
    places = np.array(sorted(soonest))
    return places, np.array([soonest[each] for each in places.tolist()])

"""What different followers think of their demonstrator.

All that is so, what one may know beforehand, or what one has found out oneself.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.lru_cache import LRUCache
from mplearn_envs.skills.action_choices import HOLD
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.varied.people import varied_library

from .base import legal_actions
from .experienced import EXPLORED, Experience, explore, twin_of
from .hindsight import Hindsight, Outlook, Seen, follow_task, own_times

_TRUST = 2.0  # so many motions seen of the demonstrator weigh as much as what was thought before
_SKIPPED = 1.7  # of a motion's usual time: what began later came after another one


class KnowsTheGraph(Outlook):
    """The oracle: how the demonstrator really goes on, whoever it is and whatever habits he has.

    It knows when these will change, too; but not what is drawn, and no more of what is under way
    than is recognised. What the robot may do is what its environment allows now.

    Args:
        env: An environment with the task ``follow``, whose insides it looks at.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        actor: Any = env.unwrapped
        self._env, self._version = actor, ""
        self.usual_s = _usual_s(actor.repertoire, follow_task(env).pace)
        self.grows = actor.repertoire.growing

    def likely(self, slot: int, time_s: float) -> FloatArray:
        """Return what is so."""
        return np.asarray(self._env.task.likely(slot, max(time_s, 0.0)))

    def notice(self, seen: Seen, place: int, info: Mapping[str, Any]) -> None:
        """Look at what the robot may do by now."""
        if info["library_version"] != self._version:
            self._version = info["library_version"]
            self._lasts_s = _allowed(self._env)

    def lasts_s(self) -> FloatArray:
        """Return how long what is legal now takes."""
        return self._lasts_s


class _Corrected(Outlook):
    """What was thought before, mended in each episode by what is seen in it.

    Args:
        ways: How likely what comes after what, (C, C), rows of any sum.
        usual_s: See `Outlook`.
        lasts_s: How long the robot takes, (C, C); NaN where it is thought to be illegal.
        times_s: The same of whatever turns out to be legal, (C,).
    """

    def __init__(
        self, ways: FloatArray, usual_s: FloatArray, lasts_s: FloatArray, times_s: FloatArray
    ) -> None:
        self._before = ways / np.maximum(ways.sum(axis=1, keepdims=True), 1e-12)
        self.usual_s, self._known_s, self._times_s = usual_s, lasts_s, times_s
        self.begin()

    def begin(self) -> None:
        """Think as before."""
        self._ways, self._lasts_s = _TRUST * self._before, self._known_s.copy()
        self._last, self._began_s = HOLD, 0.0

    def notice(self, seen: Seen, place: int, info: Mapping[str, Any]) -> None:
        """Count what follows what, and see what is legal here."""
        legal = legal_actions(info)[: len(self.usual_s)].copy()
        legal[HOLD] = False
        if place != HOLD:
            took_s = np.where(
                np.isfinite(self._known_s[place]), self._known_s[place], self._times_s
            )
            self._lasts_s[place] = np.where(legal, took_s, np.nan)
        if not seen.slot:
            return
        began_s = seen.time_s - seen.share * self.usual_s[seen.slot]
        longest_s = _SKIPPED * self.usual_s[self._last]
        anew = began_s > self._began_s + 0.5 * self.usual_s[seen.slot]
        if seen.slot == self._last and not anew:
            return
        if self._last and began_s - self._began_s < longest_s:
            self._ways[self._last, seen.slot] += 1.0
        if not self._ways[seen.slot].any() or self._last == HOLD:  # what the robot has seen before
            self._ways[seen.slot] += seen.next
        self._last, self._began_s = seen.slot, began_s

    def likely(self, slot: int, time_s: float) -> FloatArray:
        """Return what is thought; where nothing is, anything."""
        row = self._ways[slot]
        return row if row.any() else np.ones(len(row)) * (self.usual_s > 0)

    def lasts_s(self) -> FloatArray:
        """Return how long what is thought to be legal takes."""
        return self._lasts_s


class KnowsWhatItMay(_Corrected):
    """What the people of "train" do together, and what the robot has seen of its demonstrator.

    In an environment whose robot knows one graph only, that graph.

    Args:
        env: An environment with the task ``follow``.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        actor: Any = env.unwrapped
        task, repertoire = follow_task(env), actor.repertoire
        self._env, self._version = actor, ""
        self.grows = repertoire.growing
        ways = _pooled(repertoire) if hasattr(actor, "people") else _graph(repertoire)
        usual_s = _usual_s(repertoire, task.pace)
        super().__init__(ways, usual_s, own_times(repertoire, ways), task.pace * usual_s)

    def notice(self, seen: Seen, place: int, info: Mapping[str, Any]) -> None:
        """Mend what is thought; of what grows, the robot knows itself what is legal."""
        if self.grows and info["library_version"] != self._version:
            self._version = info["library_version"]
            self._known_s = _allowed(self._env)
            self._lasts_s = self._known_s.copy()
        super().notice(seen, place, info)


class KnowsFromExperience(_Corrected):
    """What one has found out by exploring: what is legal where, how long it takes, who does what.

    Args:
        experience: Of one's own actions.
        watched: What was seen of demonstrators meanwhile, in order.
        pace: Speed of the demonstrator as a share of the robot's.
        hold_s: How long holding takes [s].

    Raises:
        InvalidValueError: Nothing was tried.
    """

    def __init__(
        self, experience: Experience, watched: list[Seen], pace: float, hold_s: float
    ) -> None:
        n = experience.capacity
        tried, time_s = experience.tried[:, :n], experience.time_s[:, :n]
        known = tried.any(axis=0)
        if not known.any():
            raise InvalidValueError("one must explore for at least 1 step to know anything")
        times_s = time_s.sum(axis=0) / np.maximum(tried.sum(axis=0), 1.0)
        times_s[~known] = np.median(times_s[known])
        times_s[HOLD] = 0.0
        lasts_s = np.full((n, n), np.nan)
        for place, sets in experience.legal.items():
            for action in max(sets, key=lambda legal: sets[legal]):
                to = action % n
                own = tried[place, to]
                lasts_s[place, to] = time_s[place, to] / own if own else times_s[to]
        stuck = ~np.isfinite(lasts_s).any(axis=1)  # there one holds, and begins anew
        anew = {a % n for legal in experience.legal.get(HOLD, ()) for a in legal}
        lasts_s[np.ix_(stuck, sorted(anew))] = hold_s + times_s[sorted(anew)]
        usual_s, ways = times_s / pace, np.zeros((n, n))
        for before, after in pairwise(watched):
            ways[before.slot, after.slot] += _follows(before, after, usual_s)
        super().__init__(ways, usual_s, lasts_s, times_s)


def oracle_follower(env: gymnasium.Env[Any, Any]) -> Hindsight:
    """Return who follows with all knowledge of the graph: what others miss of it is their regret.

    Raises:
        InvalidValueError: The environment has another task than ``follow``.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> from mplearn_agents.policies import oracle_follower
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task="follow", dynamics="kinematic")
        >>> policy = oracle_follower(env)
        >>> observation, info = env.reset(seed=1)
        >>> bool(info["action_mask"][policy.act(observation, info)])
        True
    """
    return Hindsight.for_env(env, KnowsTheGraph(env))


def hindsight(env: gymnasium.Env[Any, Any]) -> Hindsight:
    """Return who follows with what one may know beforehand, and what is seen.

    Raises:
        InvalidValueError: The environment has another task than ``follow``.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task="follow", dynamics="kinematic")
        >>> type(hindsight(env)).__name__
        'Hindsight'
    """
    return Hindsight.for_env(env, KnowsWhatItMay(env))


def experienced_follower(
    env: gymnasium.Env[Any, Any], steps: int = EXPLORED, seed: int = 0
) -> Hindsight:
    """Return who follows with what was found out by exploring a kinematic twin.

    Raises:
        InvalidValueError: The environment has another task than ``follow``, or was not made by
            `gymnasium.make`; or there are no steps.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task="follow", dynamics="kinematic")
        >>> policy = experienced_follower(env, steps=50, seed=1)
        >>> observation, info = env.reset(seed=1)
        >>> bool(info["action_mask"][policy.act(observation, info)])
        True
    """
    task, actor = follow_task(env), env.unwrapped
    experience, watched = _found_out(twin_of(env), task.deadline_s, steps, seed)
    hold_s: float = actor.actions.hold_s  # type: ignore[attr-defined]
    outlook = KnowsFromExperience(experience, watched, task.pace, hold_s)
    outlook.grows = actor.repertoire.growing  # type: ignore[attr-defined]
    return Hindsight.for_env(env, outlook)


_FOUND = LRUCache(4)  # explorations: each contest of a board wants the same


def _found_out(
    twin: gymnasium.Env[Any, Any], deadline_s: float, steps: int, seed: int
) -> tuple[Experience, list[Seen]]:
    """Return what exploring finds out, of one's own actions and of demonstrators."""
    key = repr(twin.spec), steps, seed
    found: tuple[Experience, list[Seen]] | None = _FOUND.get(key)
    if found is None:
        capacity: int = twin.unwrapped.capacity  # type: ignore[attr-defined]
        watched: list[Seen] = []

        def watch(observation: Mapping[str, Any]) -> None:
            seen = Seen.of(observation["task"], capacity, deadline_s)
            watched.append(seen._replace(next=np.zeros(0)))

        found = explore(twin, steps, seed, watch), watched
        _FOUND.put(key, found)
    twin.close()
    return found


def _follows(before: Seen, after: Seen, usual_s: FloatArray) -> bool:
    """Return whether one was seen to follow the other at once, in the same episode."""
    if not before.slot or not after.slot or after.time_s <= before.time_s:
        return False
    began_s = [each.time_s - each.share * usual_s[each.slot] for each in (before, after)]
    apart_s, lasts_s = began_s[1] - began_s[0], usual_s[before.slot]
    same = before.slot == after.slot and apart_s < 0.5 * lasts_s
    return bool(not same and apart_s < _SKIPPED * lasts_s)


def _usual_s(repertoire: Repertoire, pace: float) -> FloatArray:
    """Return how long each motion takes a demonstrator, shape (C,) [s]; 0: there is none."""
    out = np.zeros(repertoire.capacity)
    for id in repertoire.feasible_ids:
        out[repertoire.slots[id]] = repertoire.skills.duration_s(id) / pace
    return out


def _graph(repertoire: Repertoire) -> FloatArray:
    """Return the prior of each place, (C, C), without hold."""
    out = np.zeros((repertoire.capacity,) * 2)
    for id in repertoire.feasible_ids:
        out[repertoire.slots[id]] = repertoire.after(id).prior
    out[:, HOLD] = 0.0
    return out


def _allowed(env: Any) -> FloatArray:
    """Return how long each takes after each that is legal by now, (C, C) [s]; NaN: illegal.

    At a dead end one holds, and begins anew with what is near.
    """
    repertoire, hold_s = env.repertoire, env.actions.hold_s
    out = own_times(repertoire, _graph(repertoire))
    for id in repertoire.feasible_ids:
        slot = repertoire.slots[id]
        if repertoire.begins_with(id) and not np.isfinite(out[slot]).any():
            near = repertoire.entries(repertoire.skills.end(id)).prior > 0
            near[HOLD] = False
            anew = np.zeros_like(out)
            anew[HOLD] = near
            out[slot] = hold_s + own_times(repertoire, anew)[HOLD]
    return out


def _pooled(repertoire: Repertoire) -> FloatArray:
    """Return how the people of "train" go on together, in a repertoire's slots, (C, C)."""
    out, graph = np.zeros((repertoire.capacity,) * 2), varied_library().graph
    possible = set(repertoire.feasible_ids)
    for before in possible:
        row = graph.prior(before)
        for k in np.flatnonzero(row).tolist():
            if graph.ids[k] in possible:
                out[repertoire.slots[before], repertoire.slots[graph.ids[k]]] = row[k]
    return out

"""Walks to chosen primitives over the graph, by the likeliest, the shortest or the quickest way."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any, Literal, TypeAlias, get_args

import gymnasium
import networkx as nx
import numpy as np

from mplearn.errors import InvalidValueError, NoPathError, RobotError, UnknownPrimitiveError
from mplearn.graph import TransitionGraph
from mplearn.recording import FloatArray
from mplearn_envs.skills.action_choices import HOLD
from mplearn_envs.varied.people import varied_library

from .base import Policy, transition_prior

Prefer: TypeAlias = Literal["likely", "short", "quick"]


class PathToGoal(Policy):
    """Takes the legal action from which the rest of the way to a goal is best.

    It needs no memory of where it is: the prior holds the first step, the graph the others. Once
    there, it takes the best way around to the goal again.

    Args:
        graph: Actions as nodes, for "quick" each with its ``"duration_s"`` [s]; each edge with its
            ``"probability"``, and for "quick" with a ``"duration_s"`` where an action takes another
            time after the one before.
        goal: The action to reach, or several of which any will do.
        prefer: ``"likely"`` takes the path of greatest probability, ``"short"`` that of fewest
            primitives, and of those the more probable, ``"quick"`` that of the least time.

    Raises:
        UnknownPrimitiveError: The goal is not in the graph.
        InvalidValueError: ``prefer`` is none of these.

    Example:
        >>> import networkx as nx
        >>> import numpy as np
        >>> graph = nx.DiGraph()
        >>> graph.add_weighted_edges_from([(0, 1, 0.5), (1, 2, 1.0), (0, 0, 0.5)], "probability")
        >>> legal, prior = np.array([1, 1, 0]), np.array([0.5, 0.5, 0.0])
        >>> policy = PathToGoal(graph, goal=2)
        >>> policy.act(None, {"action_mask": legal, "transition_prior": prior})
        1
    """

    def __init__(
        self, graph: nx.DiGraph[int], goal: int | Collection[int], prefer: Prefer = "likely"
    ) -> None:
        goals = [goal] if isinstance(goal, int) else sorted(goal)
        unknown = [each for each in goals if each not in graph]
        if unknown or not goals:
            raise UnknownPrimitiveError(
                f"the goal {goal} is not in the graph; its nodes are {sorted(graph)}"
            )
        if prefer not in get_args(Prefer):
            raise InvalidValueError(f"prefer must be one of {get_args(Prefer)}, not {prefer!r}")
        self.graph, self.goal, self.prefer = graph, goal, prefer
        costs = nx.DiGraph()
        costs.add_nodes_from(graph)
        costs.add_weighted_edges_from(
            (after, before, self._cost(before, after, probability))
            for before, after, probability in graph.edges(data="probability")
            if probability > 0
        )
        self._rest: dict[int, float] = nx.multi_source_dijkstra_path_length(costs, set(goals))

    @classmethod
    def for_env(
        cls, env: gymnasium.Env[Any, Any], goal: int | str, prefer: Prefer = "likely"
    ) -> PathToGoal:
        """Return the policy that leads an environment's robot to a primitive, given by id or name.

        Raises:
            UnknownPrimitiveError: The library does not hold the goal.
            RobotError: The robot cannot perform it.
        """
        repertoire = env.unwrapped.repertoire  # type: ignore[attr-defined]
        target = repertoire.library[goal]
        verdict = repertoire.skills.feasibility(target.id)
        if not verdict.feasible:
            raise RobotError(
                f"the robot cannot perform the goal {target.name!r}: "
                f"{'; '.join(map(str, verdict.problems))}"
            )
        return cls(graph_of_actions(env), repertoire.slots[target.id], prefer)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the first action of the best path.

        Raises:
            NoPathError: There is a choice, and no legal action leads to the goal.
        """
        prior = transition_prior(info)
        possible = np.flatnonzero(prior)
        if len(possible) == 1:
            return int(possible[0])
        here = int(observation["current_primitive"]) if isinstance(observation, Mapping) else HOLD
        ways = {
            int(action): self._cost(here, int(action), prior[action]) + self._rest[int(action)]
            for action in possible
            if int(action) in self._rest
        }
        if not ways:
            raise NoPathError(f"none of the legal actions {possible.tolist()} leads to {self.goal}")
        return min(ways, key=lambda action: (ways[action], action))

    def _cost(self, before: int, action: int, probability: float) -> float:
        """Return what an action costs; where paths are to be short, each has a high toll."""
        if self.prefer == "quick":
            way = self.graph.get_edge_data(before, action) or {}
            return float(way.get("duration_s", self.graph.nodes[action]["duration_s"]))
        surprise = -math.log(probability)
        return surprise if self.prefer == "likely" else 1e6 + surprise


class PathToTask(Policy):
    """Walks to what the task wants, by `PathToGoal`: ``info["task"]["slots"]``.

    Args:
        graph: See `PathToGoal`.
        in_order: Whether the task wants one slot after the other, or any of them.
        prefer: See `PathToGoal`.
        renew: Returns the graph of now, where the library may change from episode to episode.
        correcting: Whether the graph may be another person's: where the prior shows other ways than
            the graph has, it is mended, for the rest of the episode.
        growing: Whether ways may become known meanwhile: where none leads to what the task wants,
            it does what the demonstrator does most often. Else that is an error.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> from mplearn_envs.tasks import GoalTask
        >>> task = GoalTask("primitive", target="squat down")
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task=task, dynamics="kinematic")
        >>> policy = PathToTask.for_env(env)
        >>> observation, info = env.reset(seed=1)
        >>> while not info["is_success"]:
        ...     step = env.step(policy.act(observation, info))
        ...     observation, reward, terminated, truncated, info = step
        >>> terminated
        True
    """

    def __init__(
        self,
        graph: nx.DiGraph[int],
        in_order: bool,
        prefer: Prefer = "quick",
        renew: Callable[[], nx.DiGraph[int]] | None = None,
        correcting: bool = False,
        growing: bool = False,
    ) -> None:
        self._growing = growing
        self._correcting, self._given, self._here = correcting, graph, 0
        self.graph, self.in_order, self.prefer = graph, in_order, prefer
        self._renew, self._version = renew, ""
        self._ways: dict[tuple[int, ...], PathToGoal] = {}

    @classmethod
    def for_env(
        cls, env: gymnasium.Env[Any, Any], prefer: Prefer = "quick", pooled: bool = False
    ) -> PathToTask:
        """Return the policy for an environment's library, robot and task.

        Args:
            env: The environment.
            prefer: See `PathToGoal`.
            pooled: Whether it knows, of an environment of several people, no person's graph but
                that of the people of "train" together; an agent may know no more.
        """
        from mplearn_envs.tasks import ReciteTask

        in_order = isinstance(env.unwrapped.task, ReciteTask)  # type: ignore[attr-defined]
        if pooled and hasattr(env.unwrapped, "people"):
            pool = graph_of_actions(env, varied_library().graph)
            return cls(pool, in_order, prefer, correcting=True)
        growing: bool = env.unwrapped.repertoire.growing  # type: ignore[attr-defined]
        renew = partial(graph_of_actions, env)
        return cls(renew(), in_order, prefer, renew, growing=growing)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the first action of the best path to what the task wants next.

        Raises:
            InvalidValueError: The task names no slots.
            NoPathError: No way leads there, nor will one become known.
            UnknownPrimitiveError: What it wants cannot be performed, nor will it become known.
        """
        named = info.get("task", {}).get("slots", ())
        slots = tuple(int(slot) for slot in named if slot >= 0)
        if not slots:
            raise InvalidValueError(
                "this policy needs a task that names slots in info['task'], like 'goal' and "
                f"'recite'; info['task'] is {info.get('task')}"
            )
        version = info.get("library_version", "")
        if self._renew is not None and version != self._version:
            self.graph, self._version, self._ways = self._renew(), version, {}
        if self._correcting:
            self._correct(transition_prior(info))
        goals = slots[:1] if self.in_order else slots
        try:
            if goals not in self._ways:
                self._ways[goals] = PathToGoal(self.graph, goals, self.prefer)
            self._here = self._ways[goals].act(observation, info)
        except (NoPathError, UnknownPrimitiveError):
            if not self._growing:
                raise
            self._here = int(np.argmax(transition_prior(info)))
        return self._here

    def reset(self, seed: int | None = None) -> None:
        """Forget what was seen in the episode."""
        self._here = 0
        if self._correcting and self.graph is not self._given:
            self.graph, self._ways = self._given, {}

    def _correct(self, prior: FloatArray) -> None:
        """Let the graph have the ways that the prior shows from the present primitive."""
        shown = set((np.flatnonzero(prior[1:]) + 1).tolist())
        if self._here == 0 or set(self.graph.successors(self._here)) == shown:
            return
        self.graph, self._ways = self.graph.copy(), {}
        known = dict(self.graph[self._here])
        self.graph.remove_edges_from(list(self.graph.out_edges(self._here)))
        for after in shown:
            way = known.get(after, {}) | {"probability": float(prior[after])}
            self.graph.add_edge(self._here, after, **way)


def graph_of_actions(
    env: gymnasium.Env[Any, Any], known: TransitionGraph | None = None
) -> nx.DiGraph[int]:
    """Return what an environment's robot can do after what: actions as nodes, see `PathToGoal`.

    Args:
        env: The environment.
        known: Transitions between its primitives; None takes those of the environment.
    """
    repertoire = env.unwrapped.repertoire  # type: ignore[attr-defined]
    graph: nx.DiGraph[int] = nx.DiGraph()
    possible = repertoire.feasible_ids
    for id in possible:
        slot = repertoire.slots[id]
        graph.add_node(slot, duration_s=repertoire.skills.duration_s(id))
    for id in possible:
        if known is None:
            prior = repertoire.after(id).prior
            following = {int(after): float(prior[after]) for after in np.flatnonzero(prior[1:]) + 1}
        else:
            row = known.prior(id)
            following = {
                repertoire.slots[known.ids[k]]: float(row[k])
                for k in np.flatnonzero(row)
                if known.ids[k] in possible
            }
        for after, probability in following.items():
            graph.add_edge(repertoire.slots[id], after, probability=probability)
            time_s = repertoire.skills.foreknown_s(id, repertoire.primitive(after))
            if time_s is not None:
                graph.edges[repertoire.slots[id], after]["duration_s"] = time_s
    return graph

"""Walks to a chosen primitive over the graph, by the shortest or by the most likely path."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, TypeAlias

import gymnasium
import networkx as nx
import numpy as np

from mplearn.errors import InvalidValueError, NoPathError, RobotError, UnknownPrimitiveError

from .base import Policy, transition_prior

Prefer: TypeAlias = Literal["likely", "short"]


class PathToGoal(Policy):
    """Takes the legal action from which the rest of the way to the goal is best.

    It needs no memory of where it is: the prior holds the first step, the graph the others. Once
    there, it takes the best way around to the goal again.

    Args:
        graph: Actions as nodes; each edge with its ``"probability"``.
        goal: The action to reach.
        prefer: ``"likely"`` takes the path of greatest probability, ``"short"`` that of fewest
            primitives, and of those the more probable.

    Raises:
        UnknownPrimitiveError: The goal is not in the graph.
        InvalidValueError: ``prefer`` is neither.
    """

    def __init__(self, graph: nx.DiGraph[int], goal: int, prefer: Prefer = "likely") -> None:
        if goal not in graph:
            raise UnknownPrimitiveError(
                f"the goal {goal} is not in the graph; its nodes are {sorted(graph)}"
            )
        if prefer not in ("likely", "short"):
            raise InvalidValueError(f"prefer must be 'likely' or 'short', not {prefer!r}")
        self.graph, self.goal, self.prefer = graph, goal, prefer
        costs = nx.DiGraph()
        costs.add_nodes_from(graph)
        costs.add_weighted_edges_from(
            (after, before, self._cost(probability))
            for before, after, probability in graph.edges(data="probability")
            if probability > 0
        )
        self._rest: dict[int, float] = nx.single_source_dijkstra_path_length(costs, goal)

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
        verdict = repertoire.feasibility(target.id)
        if not verdict.feasible:
            raise RobotError(
                f"the robot cannot perform the goal {target.name!r}: "
                f"{'; '.join(map(str, verdict.problems))}"
            )
        possible = [id for id in repertoire.ids if repertoire.feasibility(id).feasible]
        graph = repertoire.library.graph.to_networkx().subgraph(possible)
        slots = nx.relabel_nodes(graph, repertoire.slots)
        return cls(slots, repertoire.slots[target.id], prefer)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the first action of the best path.

        Raises:
            NoPathError: There is a choice, and no legal action leads to the goal.
        """
        prior = transition_prior(info)
        possible = np.flatnonzero(prior)
        if len(possible) == 1:
            return int(possible[0])
        ways = {
            int(action): self._cost(prior[action]) + self._rest[int(action)]
            for action in possible
            if int(action) in self._rest
        }
        if not ways:
            raise NoPathError(f"none of the legal actions {possible.tolist()} leads to {self.goal}")
        return min(ways, key=lambda action: (ways[action], action))

    def _cost(self, probability: float) -> float:
        """Return what a transition costs; where paths are to be short, each has a high toll."""
        surprise = -math.log(probability)
        return surprise if self.prefer == "likely" else 1e6 + surprise

"""The best way between two primitives, by a weight of the edges, and the next best ones."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Container, Iterator, Mapping
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

from ..errors import NoPathError

if TYPE_CHECKING:
    import networkx as nx


class Found(NamedTuple):
    """A way, and the effort of finding it.

    Attributes:
        nodes: From start to goal, both included.
        cost: Sum of the weights of its edges.
        n_expanded: How many nodes were looked at.
    """

    nodes: tuple[int, ...]
    cost: float
    n_expanded: int


def best_path(
    view: nx.DiGraph,
    start: int,
    goal: int,
    weight: str,
    *,
    avoid: Collection[int] = (),
    within: Container[int] | None = None,
) -> Found | None:
    """Return the best path (Dijkstra's algorithm); None where there is none.

    Args:
        view: Edges have an attribute ``weight``, at least 0.
        start: First node.
        goal: Last node.
        weight: Name of what is added up.
        avoid: Nodes that must not be passed.
        within: The only nodes that may be passed; None for all.
    """
    costs = {start: 0.0}
    came_from: dict[int, int] = {}
    queue = [(0.0, start)]
    expanded: set[int] = set(avoid)
    n_avoided = len(expanded)
    while queue:
        cost, node = heapq.heappop(queue)
        if node in expanded:
            continue
        expanded.add(node)
        if node == goal:
            way = tuple(_followed(came_from, goal))[::-1]
            return Found(way, cost, len(expanded) - n_avoided)
        for follower, edge in view.adj[node].items():
            reached = cost + edge[weight]
            if within is not None and follower not in within:
                continue
            if follower not in expanded and reached < costs.get(follower, float("inf")):
                costs[follower] = reached
                came_from[follower] = node
                heapq.heappush(queue, (reached, follower))
    return None


def costs_to(view: nx.DiGraph, goal: int, weight: str, avoid: Collection[int]) -> dict[int, float]:
    """Return the least cost from each node that leads to a goal."""
    import networkx as nx

    left = nx.restricted_view(view, avoid, ()) if avoid else view
    if goal not in left:
        return {}
    costs: dict[int, float] = nx.single_source_dijkstra_path_length(
        left.reverse(copy=False), goal, weight=weight
    )
    return costs


def simple_paths(
    view: nx.DiGraph, start: int, goal: int, avoid: Collection[int], weight: str, k: int
) -> tuple[tuple[int, ...], ...]:
    """Return up to ``k`` paths without a loop, best first (Yen's algorithm)."""
    if k == 1:
        found = best_path(view, start, goal, weight, avoid=avoid)
        if found is not None:
            return (found.nodes,)
    elif start not in avoid and goal not in avoid:
        import networkx as nx

        left = nx.restricted_view(view, avoid, ()) if avoid else view
        try:
            paths = islice(nx.shortest_simple_paths(left, start, goal, weight=weight), k)
            return tuple(tuple(path) for path in paths)
        except nx.NetworkXNoPath:
            pass
    raise NoPathError(no_path(start, goal, f"avoiding {sorted(set(avoid))}" if avoid else ""))


def no_path(start: int, goal: int, *asked: str) -> str:
    """Return the sentence that says what there is not."""
    return " ".join([f"no path leads from primitive {start} to {goal}", *filter(None, asked)])


def _followed(came_from: Mapping[int, int], node: int) -> Iterator[int]:
    yield node
    while node in came_from:
        node = came_from[node]
        yield node

"""Paths between primitives: the most likely, the shortest, the quickest; k best; constrained."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator
from itertools import islice
from typing import TYPE_CHECKING

from ..errors import InvalidValueError, NoPathError

if TYPE_CHECKING:
    import networkx as nx

MAX_VISITS = 12
_MAX_STATES = 2_000_000


def simple_paths(
    view: nx.DiGraph, start: int, goal: int, avoid: Collection[int], weight: str, k: int
) -> tuple[tuple[int, ...], ...]:
    """Return up to ``k`` paths without a loop, best first (Yen's algorithm)."""
    import networkx as nx

    left = nx.restricted_view(view, avoid, ()) if avoid else view
    try:
        if k == 1:
            return (tuple(nx.dijkstra_path(left, start, goal, weight=weight)),)
        found = islice(nx.shortest_simple_paths(left, start, goal, weight=weight), k)
        return tuple(tuple(path) for path in found)
    except nx.NetworkXNoPath:
        raise NoPathError(_reason(start, goal, avoid, (), None)) from None


def constrained_walks(
    view: nx.DiGraph,
    start: int,
    goal: int,
    *,
    avoid: Collection[int],
    visit: Collection[int],
    length: int | None,
    weight: str,
    k: int,
) -> tuple[tuple[int, ...], ...]:
    """Return up to ``k`` walks that pass all of ``visit``, of ``length`` primitives if given.

    Dijkstra's algorithm over (primitive, what has been visited, length so far), each state taken up
    to ``k`` times: exact for walks, which may pass a primitive more than once.
    """
    if len(set(visit)) > MAX_VISITS:
        raise InvalidValueError(f"visit may name at most {MAX_VISITS} primitives, not {len(visit)}")
    n_states = len(view) * 2 ** len(set(visit)) * (1 if length is None else length)
    if n_states * k > _MAX_STATES:
        raise InvalidValueError(
            f"a search over {n_states * k} states is too large (at most {_MAX_STATES}): "
            "ask for a smaller length, k or visit"
        )
    walks = tuple(islice(_best_walks(view, start, goal, avoid, visit, length, weight, k), k))
    if not walks:
        raise NoPathError(_reason(start, goal, avoid, visit, length))
    return walks


def _best_walks(
    view: nx.DiGraph,
    start: int,
    goal: int,
    avoid: Collection[int],
    visit: Collection[int],
    length: int | None,
    weight: str,
    k: int,
) -> Iterator[tuple[int, ...]]:
    bit = {node: 1 << i for i, node in enumerate(sorted(set(visit)))}
    everything = (1 << len(bit)) - 1
    if start in avoid or goal in avoid:
        return
    trail = [(start, -1)]  # every walk begun: its newest primitive, and where its past stands
    queue = [(0.0, 0, bit.get(start, 0), 1)]  # equal costs leave in the order of their entry
    taken: dict[tuple[int, int, int], int] = {}
    while queue:
        cost, place, seen, steps = heapq.heappop(queue)
        node = trail[place][0]
        state = (node, seen, 0 if length is None else steps)
        if taken.get(state, 0) >= k:
            continue
        taken[state] = taken.get(state, 0) + 1
        if node == goal and seen == everything and length in (None, steps):
            yield _followed_back(trail, place)
        if length is not None and steps >= length:
            continue
        for follower, edge in view.adj[node].items():
            if follower not in avoid:
                entry = (cost + edge[weight], len(trail), seen | bit.get(follower, 0), steps + 1)
                heapq.heappush(queue, entry)
                trail.append((follower, place))


def _followed_back(trail: list[tuple[int, int]], place: int) -> tuple[int, ...]:
    nodes = []
    while place >= 0:
        node, place = trail[place]
        nodes.append(node)
    return tuple(reversed(nodes))


def _reason(
    start: int,
    goal: int,
    avoid: Collection[int],
    visit: Collection[int],
    length: int | None,
) -> str:
    parts = [f"no path leads from primitive {start} to {goal}"]
    if avoid:
        parts.append(f"avoiding {sorted(set(avoid))}")
    if visit:
        parts.append(f"by way of {sorted(set(visit))}")
    if length is not None:
        parts.append(f"in exactly {length} primitives")
    return " ".join(parts)

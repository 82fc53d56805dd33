"""Graphs over inner nodes of the tree, and the search above first, below then [Kulic2012, 3]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from ..errors import InvalidValueError, NoPathError, UnknownPrimitiveError
from .search import Found, best_path, no_path

if TYPE_CHECKING:
    from .transition_graph import TransitionGraph


def tree_levels(parents: Mapping[int, int | None]) -> tuple[dict[int, int], ...]:
    """Return which node each leaf lies below, from just above the leaves to just below the root.

    Args:
        parents: Parent of each node of a tree; None at the root.

    Returns:
        A mapping leaf -> ancestor for each depth at which there is something to tell apart, the
        deepest first. A leaf that ends above that depth stands for itself.

    Example:
        >>> tree_levels({0: None, 1: 0, 2: 1, 3: 1, 4: 0})  # leaves 2, 3 and 4
        ({2: 1, 3: 1, 4: 4},)
    """
    inner = {parent for parent in parents.values() if parent is not None}
    ways = {}  # leaf -> the nodes from below the root down to it
    for leaf in parents:
        way: list[int] = []
        node: int | None = leaf
        while leaf not in inner and node is not None and parents[node] is not None:
            way.insert(0, node)
            node = parents[node]
        if way:
            ways[leaf] = way
    deepest = max(map(len, ways.values()), default=0)
    return tuple(
        {leaf: way[min(depth, len(way)) - 1] for leaf, way in ways.items()}
        for depth in range(deepest - 1, 0, -1)
    )


class LevelledGraph:
    """A graph of primitives with graphs over groups of them above it.

    Args:
        graph: The primitives; a snapshot of it is taken.
        groups: Group of each primitive at each level above, fine groups first; a primitive that is
            not named is a group of its own. Each group lies inside one of the next level.

    Attributes:
        graphs: Graph of each level, the primitives first.

    Raises:
        InvalidValueError: A group lies in two groups of the next level.

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> graph = TransitionGraph()
        >>> for id in (1, 2, 3, 4):
        ...     graph.add_node(id)
        >>> for previous, next_id in ((1, 2), (2, 3), (3, 4)):
        ...     graph.observe(previous, next_id, 1.0)
        >>> groups = {1: 10, 2: 10, 3: 11, 4: 11}  # nodes of the tree above the primitives
        >>> LevelledGraph(graph, [groups]).path(1, 4).nodes
        (1, 2, 3, 4)
    """

    def __init__(self, graph: TransitionGraph, groups: Sequence[Mapping[int, int]]) -> None:
        self.graphs = [graph.snapshot()]
        self._up: list[dict[int, int]] = []  # node -> group, from each level to the next
        at = {id: id for id in graph.ids}
        for level, group_of in enumerate(groups):
            above = {id: group_of.get(id, id) for id in graph.ids}
            up: dict[int, int] = {}
            for id, group in above.items():
                if up.setdefault(at[id], group) != group:
                    raise InvalidValueError(
                        f"group {at[id]} of level {level} lies in two groups of the level above: "
                        f"{up[at[id]]} and {group}"
                    )
            self._up.append(up)
            self.graphs.append(self.graphs[-1].grouped(up).snapshot())
            at = above

    def path(self, start: int, goal: int) -> Found:
        """Return a likely path, found on the highest level first, then inside what it passes.

        At each level the search keeps to the groups that the path of the level above passes; where
        there is no way inside them, it searches the whole level. So the path exists if one exists;
        it need not be the most likely one, that of `TransitionGraph.path`.

        Returns:
            The path; its `n_expanded` counts the nodes looked at on all levels.

        Raises:
            UnknownPrimitiveError: A primitive is not a node.
            NoPathError: There is no path.
        """
        for id in (start, goal):
            if id not in self.graphs[0]:
                raise UnknownPrimitiveError(f"primitive {id} is not in the graph")
        ends = [(start, goal)]
        for up in self._up:
            ends.append((up[ends[-1][0]], up[ends[-1][1]]))
        corridor: set[int] | None = None
        n_expanded = 0
        found = None
        for level in range(len(self.graphs) - 1, -1, -1):
            view = self.graphs[level].view()
            found = best_path(view, *ends[level], "cost", within=corridor)
            if found is None and corridor is not None:
                n_expanded += len(corridor)
                found = best_path(view, *ends[level], "cost")
            if found is None:
                break
            n_expanded += found.n_expanded
            if level:
                passed = set(found.nodes)
                corridor = {node for node, above in self._up[level - 1].items() if above in passed}
        if found is None:
            raise NoPathError(no_path(start, goal))
        return found._replace(n_expanded=n_expanded)

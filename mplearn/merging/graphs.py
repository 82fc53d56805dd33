"""Graphs of transitions that were counted apart, as one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..graph import TransitionGraph


def merge_graphs(parts: Iterable[tuple[TransitionGraph, Mapping[int, int]]]) -> TransitionGraph:
    """Return a graph with the counts of some together; none of them changes.

    Counts do not depend on the order of the graphs, nodes are in the order of their coming.

    Args:
        parts: Each graph, and the names that its primitives have in the merged one.

    Example:
        >>> graph = TransitionGraph()
        >>> graph.add_node(1), graph.add_node(2), graph.observe(1, 2, 0.5)
        (None, None, None)
        >>> merge_graphs([(graph, {1: 1, 2: 2}), (graph, {1: 7, 2: 2})]).edge_rows()[:, :3].tolist()
        [[1, 2, 1], [7, 2, 1]]
    """
    merged = TransitionGraph()
    for graph, new_id in parts:
        merged.add(graph, new_id)
    return merged

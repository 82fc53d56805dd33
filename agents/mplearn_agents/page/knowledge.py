"""What is known, as plain values that the page can draw."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mplearn.library import PrimitiveLibrary
from mplearn.people import PeopleTree

from .messages import Header, brief


def knowledge(library: PrimitiveLibrary, tree: PeopleTree) -> Header:
    """Return primitives, tree and graph.

    Args:
        library: What is known.
        tree: Where it was learned: it knows what is yet to be confirmed.
    """
    confirmed = tree.config.confirmed
    primitives = []
    with tree.still():
        for each in library.primitives:
            node = tree.node(each.id)
            primitives.append(
                {
                    "id": each.id,
                    "name": brief(each.name),
                    "n": node.n_placed,
                    "of": confirmed if node.n_placed < confirmed else 0,
                    "frozen": node.frozen,
                    "duration_s": round(each.mean_duration_s, 3),
                }
            )
    return {
        "kind": "knowledge",
        "primitives": primitives,
        "nodes": _nodes(library),
        "edges": _edges(library),
    }


def _nodes(library: PrimitiveLibrary) -> list[dict[str, Any]]:
    """Return the nodes of the tree, without what lies below primitives (people's own leaves)."""
    parents: Mapping[int, int | None] = {node.id: node.parent for node in library.tree}
    ids = set(library.ids)

    def below_primitive(id: int) -> bool:
        above = parents[id]
        while above is not None:
            if above in ids:
                return True
            above = parents[above]
        return False

    return [
        {"id": node.id, "parent": node.parent, "n": node.n_exemplars}
        for node in library.tree
        if not below_primitive(node.id)
    ]


def _edges(library: PrimitiveLibrary) -> list[list[float]]:
    """Return the transitions: from, to, count, probability, mean duration [s]."""
    rows = library.graph.edge_rows()
    if not len(rows):
        return []
    sources, counts = rows[:, 0], rows[:, 2]
    _, place = np.unique(sources, return_inverse=True)
    totals = np.bincount(place, weights=counts)[place]
    shares, durations = counts / totals, rows[:, 3] / counts / 1000.0
    return [
        [int(source), int(target), int(count), round(float(p), 4), round(float(s), 3)]
        for source, target, count, p, s in zip(
            sources, rows[:, 1], counts, shares, durations, strict=True
        )
    ]

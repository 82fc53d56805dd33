"""When a primitive is born: complete-link clusters of what waits in a node [Kulic2012, eq. 7]."""

from __future__ import annotations

import numpy as np

from .clustering import clusters_below
from .node import Node
from .placement import ROOT, Change
from .search import mean_nearest
from .spread import moments
from .structure import Structure


def form_primitives(structure: Structure, node: Node, when: int) -> Change:
    """Form a leaf of each cluster in a node that grew; what else waits in the root may join it.

    Args:
        structure: The tree.
        node: The root; as printed, any node.
        when: Segments seen.
    """
    config = structure.config
    change = Change()
    while True:
        loose = [i for i, number in enumerate(node.members) if number not in node.settled]
        matrix = node.matrix[np.ix_(loose, loose)]
        groups = clusters_below(matrix, cutoff(structure, node), config.min_exemplars)
        if not groups:
            return change
        places = [loose[i] for i in groups[0]]
        members = [node.members[i] for i in places]
        rest = np.delete(np.arange(len(node.members)), places)
        row = mean_nearest(node.matrix[np.ix_(rest, places)], config.n_nearest)
        others = [node.members[i] for i in rest]
        child = structure.child(node, members, when)
        moved = tuple((number, child.id) for number in members)
        change = change.then(Change(born=(child.id,), moved=moved))
        if node.id == ROOT and not config.local:
            radius = structure.index.radius(child.id)
            inside = [n for n, distance in zip(others, row, strict=True) if distance <= radius]
            change = change.then(structure.take_in(child, inside))


def cutoff(structure: Structure, node: Node) -> float:
    """Return the largest distance inside a cluster that becomes a node, D_cutoff."""
    if structure.config.local:
        mu, sigma = moments(node.matrix)
        return mu - structure.config.cutoff * sigma
    return structure.memory.scale()

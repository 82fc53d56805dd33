"""When a primitive is born: complete-link clusters of what waits in a node [Kulic2012, eq. 7]."""

from __future__ import annotations

from collections.abc import Sequence

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
        limit = cutoff(structure, node)
        groups = clusters_below(matrix, limit, structure.least, config.pair_share)
        if not groups:
            return change
        places = [loose[i] for i in groups[0]]
        members = [node.members[i] for i in places]
        same = None if config.local else _leaf_of(structure, members, limit)
        if same is not None:
            change = change.then(structure.take_in(same, members))
            continue
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


def _leaf_of(structure: Structure, members: Sequence[int], limit: float) -> Node | None:
    """Return the leaf that a cluster is one motion with: all of both lie within the limit.

    A motion must not become a primitive twice.
    """
    bank = structure.memory.bank
    best, found = limit, None
    for leaf in structure.nodes.values():
        if leaf.id == ROOT or not leaf.is_leaf:
            continue
        far = 0.0
        for number in members:
            far = max(far, float(bank.distances(bank[number], leaf.members).max()))
            if far > best:
                break
        if far <= best:
            best, found = far, leaf
    return found


def forget_chances(structure: Structure, when: int) -> Change:
    """Forget the provisional primitives that nothing has joined for long: they came by chance.

    Args:
        structure: The tree.
        when: Segments seen.
    """
    config = structure.config
    leaves = [n for n in structure.nodes.values() if n.id != ROOT and n.is_leaf]
    patience = max(config.patience, 4 * len(leaves))
    change = Change()
    for leaf in leaves:
        by_hand = leaf.whole or leaf.apart or len(leaf.history) > 1
        if leaf.n_placed < config.confirmed and when - leaf.born_at > patience and not by_hand:
            change = change.then(structure.remove(leaf, when, forget=True))
    return change


def cutoff(structure: Structure, node: Node) -> float:
    """Return the largest distance inside a cluster that becomes a node, D_cutoff."""
    if structure.config.local:
        mu, sigma = moments(node.matrix)
        return mu - structure.config.cutoff * sigma
    return structure.memory.scale()

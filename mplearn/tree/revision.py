"""When what was learned is revised: leaves of several motions are split, leaves of one merged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .clustering import gap, separation, two_branches
from .node import Node
from .placement import Change, Match
from .structure import Structure


def split_mixed(structure: Structure, leaf: Node, when: int) -> Change:
    """Split a leaf if its two branches lie too far apart.

    On average, by what is inside them and by how wide other leaves are; and with a break between
    them. Few exemplars look like two groups by chance, so the leaf must keep all that it may.
    """
    config = structure.config
    if leaf.whole or len(leaf.members) < config.max_exemplars:
        return Change()
    matrix = structure.memory.bank.matrix(leaf.members, forms_only=True)
    branches = two_branches(matrix, config.min_branch)
    if branches is None:
        return Change()
    between = float(matrix[np.ix_(*branches)].mean())
    if (
        separation(matrix, *branches) <= config.split_ratio
        or gap(matrix, *branches) <= config.split_gap
        or between <= config.split_scale * structure.index.scale(but=leaf.id)
    ):
        return Change()
    return structure.split(leaf, [[leaf.members[i] for i in branch] for branch in branches], when)


def merge_duplicates(structure: Structure, matches: Sequence[Match], when: int) -> Change:
    """Merge the two leaves that a segment lies in, if they are no farther apart than inside."""
    inside = [match.node for match in matches if match.ratio <= 1]
    if len(inside) < 2:
        return Change()
    older, younger = sorted((structure.nodes[id] for id in inside[:2]), key=lambda node: node.id)
    if older.id in younger.apart or younger.id in older.apart:
        return Change()
    joint = structure.joint(older, younger)
    first, second = np.split(np.arange(len(joint)), [len(older.members)])
    if separation(joint, first, second) >= structure.config.merge_ratio:
        return Change()
    return structure.merge(older, younger, joint, when)

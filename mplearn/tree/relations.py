"""Which motions are related: mirror images of each other, or alike in a part of the channels.

Two primitives are compared as a segment is with a primitive when it is recognised: by the distance
of the one's exemplars to those of the other, over the other's radius. What differs is what is
looked at: the mirror image, or a part of the channels (the arms, say, whatever the legs do).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray
from .exemplars.bank import ExemplarBank
from .exemplars.normalisation import centred, normalised, points_of
from .exemplars.spread import ChannelSpread
from .mirror import MirrorMap
from .nodes.node import Node
from .nodes.search import NodeIndex, mean_nearest
from .placement import ROOT
from .tree import PrimitiveTree

MOVES = 0.3  # a part that varies less than this share of its usual standard deviation is at rest
NEAR = 1.0  # radii


class Relation(NamedTuple):
    """A primitive that another is related to.

    Attributes:
        primitive: Its id; the primitive's own where it is its own mirror image.
        ratio: Median distance of the exemplars to it, over its radius.

    Example:
        >>> related_to = (Relation(primitive=7, ratio=0.6), Relation(primitive=3, ratio=0.9))
        >>> min(related_to, key=lambda relation: relation.ratio).primitive
        7
    """

    primitive: int
    ratio: float


def related(
    tree: PrimitiveTree,
    id: int,
    *,
    mirror: MirrorMap | None = None,
    channels: Sequence[int] | None = None,
    near: float = NEAR,
) -> tuple[Relation, ...]:
    """Return the primitives that one is related to, nearest first.

    Args:
        tree: Holds them.
        id: The primitive.
        mirror: Compare its mirror image; as it is where not given.
        channels: Numbers of the channels to look at; all where not given.
        near: Largest distance of a relation, in radii.

    Returns:
        Empty where the primitive is at rest in those channels.

    Raises:
        UnknownPrimitiveError: There is no such primitive.
        InvalidValueError: Neither a mirror nor channels are given, or a channel does not exist.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import MirrorMap, PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> t = np.linspace(0, np.pi, 60)
        >>> left = np.stack((np.sin(t), 0.1 * np.sin(2 * t)), axis=1)  # the left hand is lifted
        >>> sides = (left, left[:, ::-1])
        >>> placed = [tree.insert(k * side) for k in (1, 1.01, 0.99) for side in sides]
        >>> first, second = tree.leaves
        >>> mirror = MirrorMap.of(("hand_l.z", "hand_r.z"))
        >>> related(tree, first, mirror=mirror)[0].primitive == second
        True
    """
    if mirror is None and channels is None:
        raise InvalidValueError("a relation needs a mirror, or channels to look at")
    seen = list(range(tree.n_channels) if channels is None else channels)
    if not seen or min(seen) < 0 or max(seen) >= tree.n_channels:
        raise InvalidValueError(f"channels must lie in [0, {tree.n_channels}), not {seen}")
    mine = [
        (each if mirror is None else mirror.apply(each))[:, seen] for each in tree.exemplars(id)
    ]
    leaves = {leaf: [each[:, seen] for each in tree.exemplars(leaf)] for leaf in tree.leaves}
    points = {
        leaf: [points_of(each, tree.config.normalisation) for each in group]
        for leaf, group in leaves.items()
    }
    spread = ChannelSpread(np.array(tree.groups, np.int64)[seen])
    for group in points.values():
        for each in group:
            spread.update(each)
    if not _moves(mine, spread.variances()):
        return ()
    bank, index = _index(tree, points, spread.variances())
    asked = [bank.model(normalised(each, tree.config.normalisation)) for each in mine]
    found = []
    for k, leaf in enumerate(index.ids.tolist()):
        if leaf == id and mirror is None:
            continue
        rows = np.stack([bank.distances(each, index.members[k]) for each in asked])
        distance = float(np.median(mean_nearest(rows, tree.config.n_nearest)))
        found.append(Relation(leaf, distance / max(index.radius(leaf), 1e-12)))
    return tuple(sorted((each for each in found if each.ratio <= near), key=lambda r: r.ratio))


def _moves(exemplars: Sequence[FloatArray], variances: FloatArray) -> bool:
    """Return whether a motion moves at all in the channels that are looked at."""
    own = np.mean([np.nanvar(each, axis=0).mean() for each in exemplars])
    return bool(own > MOVES**2 * variances.mean())


def _index(
    tree: PrimitiveTree, points: dict[int, list[FloatArray]], variances: FloatArray
) -> tuple[ExemplarBank, NodeIndex]:
    """Return all primitives as they are in the channels that are looked at."""
    bank = ExemplarBank(tree.config, len(variances), tree.config.variance_floor**2 * variances)
    index = NodeIndex(tree.config, bank)
    index.limit = np.inf
    number = 0
    for leaf, group in points.items():
        node = Node(leaf, ROOT, 0)
        for each in group:
            bank.add(number, bank.model(centred(each, tree.config.normalisation)))
            node.members += (number,)
            number += 1
        node.matrix = bank.matrix(node.members)
        index.put(node, bank)
    return bank, index

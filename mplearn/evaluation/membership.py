"""Where each segment is in the tree, kept up to date by what the tree says."""

from __future__ import annotations

from ..tree import Placement


class Membership:
    """Which node each placed segment is in.

    Attributes:
        home: Id of its node, by the number of the segment; the root's where it is in no primitive.
        gone: Ids of nodes that are no primitives any more.
    """

    def __init__(self) -> None:
        self.home: dict[int, int] = {}
        self.gone: set[int] = set()

    def take(self, placement: Placement) -> None:
        """Take what the tree said of the next segment."""
        self.home[placement.number] = placement.node_id
        self.home.update(placement.moved)
        self.gone.update(split.node for split in placement.splits)
        self.gone.update(placement.removed)
        for merge in placement.merges:
            self.gone.add(merge.absorbed)
            self.home |= {n: merge.kept for n, node in self.home.items() if node == merge.absorbed}

    def members(self, node: int) -> list[int]:
        """Return the numbers of the segments in a node."""
        return [number for number, home in self.home.items() if home == node]


def recognised_as(placement: Placement) -> int:
    """Return the primitive that a segment was recognised as, which it may have split at once."""
    for split in placement.splits:
        if placement.node_id in split.into:
            return split.node
    return placement.node_id

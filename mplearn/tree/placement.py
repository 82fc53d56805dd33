"""What the tree says about a segment, and what changes in it."""

from __future__ import annotations

from typing import NamedTuple

ROOT = 0


class Match(NamedTuple):
    """A node that a segment was compared with.

    Attributes:
        node: Its id.
        distance: Symmetric likelihood distance [nat a frame] [Kulic2012, eq. 5].
        ratio: Distance over radius, on the scale of the tree's rules; at most 1 inside.
    """

    node: int
    distance: float
    ratio: float


class Split(NamedTuple):
    """A leaf that turned out to hold several motions.

    Attributes:
        node: The leaf; it stays in the tree as the node above.
        into: The new leaves, the larger one first.
    """

    node: int
    into: tuple[int, ...]


class Merge(NamedTuple):
    """Two leaves that turned out to be one.

    Attributes:
        kept: The leaf that stays.
        absorbed: The leaf that is gone.
    """

    kept: int
    absorbed: int


class Reparent(NamedTuple):
    """A node that was hung below another.

    Attributes:
        node: The node.
        parent: The node that it lies below now.
    """

    node: int
    parent: int


class Change(NamedTuple):
    """What changed in the tree, by its rules or by a person.

    Attributes:
        born: Ids of the primitives that were formed, splits included.
        splits: Leaves that were split.
        merges: Leaves that were merged.
        moved: Earlier segments that were moved: number and new node.
        reparented: Nodes that were hung below another.
        removed: Ids of the nodes that are gone, but for absorbed ones.
    """

    born: tuple[int, ...] = ()
    splits: tuple[Split, ...] = ()
    merges: tuple[Merge, ...] = ()
    moved: tuple[tuple[int, int], ...] = ()
    reparented: tuple[Reparent, ...] = ()
    removed: tuple[int, ...] = ()

    def then(self, later: Change) -> Change:
        """Return this change and a later one as one."""
        return Change(
            self.born + later.born,
            self.splits + later.splits,
            self.merges + later.merges,
            self.moved + later.moved,
            self.reparented + later.reparented,
            self.removed + later.removed,
        )


class Placement(NamedTuple):
    """Where a segment was put, and what came of it.

    Attributes:
        number: The segment's number, counted from 0.
        node_id: The node that it is in now; `ROOT` where nothing is like it.
        recognised: Whether it was placed in a primitive that was known before it came.
        distance: To the nearest primitive [nat a frame]; inf where there is none.
        ratio: That over the primitive's radius; above 1 outside. An open-set score.
        born: Ids of the primitives that its arrival formed, splits included.
        splits: Leaves that its arrival split.
        merges: Leaves that its arrival merged.
        moved: Earlier segments that its arrival moved: number and new node.
        refused: Why it was not taken up at all; empty where it was.
        reparented: Nodes that its arrival hung below another.
        removed: Nodes that are gone: provisional primitives that nothing confirmed, and inner nodes
            that held nothing else.
        nearest: The primitive that it was nearest to when it came, within its radius or not; None
            where there was none.
        like: Number of the segment that it is most like among those that wait to become a
            primitive, where the two may show one motion; None where there is none.
    """

    number: int
    node_id: int
    recognised: bool
    distance: float
    ratio: float
    born: tuple[int, ...] = ()
    splits: tuple[Split, ...] = ()
    merges: tuple[Merge, ...] = ()
    moved: tuple[tuple[int, int], ...] = ()
    refused: str = ""
    reparented: tuple[Reparent, ...] = ()
    removed: tuple[int, ...] = ()
    nearest: int | None = None
    like: int | None = None

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

    Example:
        >>> matches = (Match(3, distance=0.4, ratio=0.5), Match(7, distance=2.1, ratio=2.6))
        >>> [match.node for match in matches if match.ratio <= 1.0]
        [3]
    """

    node: int
    distance: float
    ratio: float


class Split(NamedTuple):
    """A leaf that turned out to hold several motions.

    Attributes:
        node: The leaf; it stays in the tree as the node above.
        into: The new leaves, the larger one first.

    Example:
        >>> Split(node=4, into=(7, 8)).into
        (7, 8)
    """

    node: int
    into: tuple[int, ...]


class Merge(NamedTuple):
    """Two leaves that turned out to be one.

    Attributes:
        kept: The leaf that stays.
        absorbed: The leaf that is gone.

    Example:
        >>> merge = Merge(kept=1, absorbed=4)
        >>> {1: "bow", 4: "bow?"}[merge.absorbed]
        'bow?'
    """

    kept: int
    absorbed: int


class Reparent(NamedTuple):
    """A node that was hung below another.

    Attributes:
        node: The node.
        parent: The node that it lies below now.

    Example:
        >>> Reparent(node=7, parent=3).parent
        3
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
        parts: Those of them that were born of parts of a motion.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift) for k in (1.0, 1.01, 0.99, -1.0, -1.01, -0.99)]
        >>> change = tree.merge(*tree.leaves)
        >>> change.merges, change.born
        ((Merge(kept=1, absorbed=2),), ())
    """

    born: tuple[int, ...] = ()
    splits: tuple[Split, ...] = ()
    merges: tuple[Merge, ...] = ()
    moved: tuple[tuple[int, int], ...] = ()
    reparented: tuple[Reparent, ...] = ()
    removed: tuple[int, ...] = ()
    parts: tuple[int, ...] = ()

    def then(self, later: Change) -> Change:
        """Return this change and a later one as one."""
        return Change(
            self.born + later.born,
            self.splits + later.splits,
            self.merges + later.merges,
            self.moved + later.moved,
            self.reparented + later.reparented,
            self.removed + later.removed,
            self.parts + later.parts,
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
        removed: Nodes that are gone: provisional primitives that nothing confirmed, those that
            were born of parts of a motion, and inner nodes that held nothing else.
        nearest: The primitive that it was nearest to when it came, within its radius or not; None
            where there was none.
        like: Number of the segment that it is most like among those that wait to become a
            primitive, where the two may show one motion; None where there is none.
        parts: Those of the nodes that are gone that were born of parts of a motion.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift) for k in (1.0, -1.0, 1.01, -1.01)]
        >>> placement = tree.insert(0.99 * lift)
        >>> placement.number, placement.recognised, placement.node_id == placed[2].born[0]
        (4, True, True)
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
    parts: tuple[int, ...] = ()

    def then(self, later: Change) -> Placement:
        """Return where the segment is, and what came of it, after a later change, too.

        Example:
            >>> first = Placement(4, ROOT, False, 2.1, 3.0, born=(7,))
            >>> both = first.then(Change(born=(8,), moved=((2, 8), (4, 8))))
            >>> both.born, both.node_id, both.moved
            ((7, 8), 8, ((2, 8),))
        """
        moved = dict(later.moved)
        home = moved.pop(self.number, self.node_id)
        home = next((merge.kept for merge in later.merges if merge.absorbed == home), home)
        others = tuple(move for move in later.moved if move[0] != self.number)
        before = Change(*(getattr(self, name) for name in Change._fields))
        change = before.then(later._replace(moved=others))
        return self._replace(node_id=home, **change._asdict())

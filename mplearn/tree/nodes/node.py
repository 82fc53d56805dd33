"""A node of the tree: a group of similar segments."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np

from ...recording import FloatArray, IntArray
from ...state import Array, Blob, Count, SharedState, newer, require
from ..exemplars.spread import without
from .clustering import most_redundant

Happening: TypeAlias = Literal["born", "split", "merged", "moved", "undone", "kept"]


class Table(Protocol):
    """What notices changes of the nodes in it."""

    def notice(self, id: int) -> None:
        """Take note that a node has changed."""


class StoodFor(NamedTuple):
    """What one exemplar of a full node stands for, besides itself.

    Attributes:
        number: The exemplar.
        n: Segments that went, and were nearest to it.
        n_frames: Frames of those.
    """

    number: Count
    n: Count
    n_frames: Count


@dataclass(frozen=True, eq=False)
class NodeState(SharedState):
    """A node with its exemplars; attributes are those of `Node`.

    Attributes:
        frames: The exemplars as they came, shape (L, D) each.
    """

    id: Count
    parent: Count | None
    born_at: Count
    members: Annotated[IntArray, Array("k", low=0)]
    frames: tuple[Annotated[Blob, Array(None, "d", nan=True)], ...]
    matrix: Annotated[FloatArray, Array("k", "k", low=0.0)]
    n_placed: Count
    n_frames: Count
    children: tuple[Count, ...]
    settled: tuple[Count, ...]
    history: tuple[tuple[Happening, Count], ...]
    whole: bool
    apart: tuple[Count, ...]
    frozen: bool = False
    stood_for: tuple[StoodFor, ...] = newer((), absent=())

    def exemplars(self) -> Iterator[tuple[int, Blob]]:
        """Go through the numbers and frames of the exemplars."""
        return zip(self.members.tolist(), self.frames, strict=True)

    def check(self) -> None:
        """Check that nothing is there twice, and that distances are distances."""
        members = set(self.members.tolist())
        require(len(members) == len(self.members), "members", "must differ")
        require(len(set(self.children)) == len(self.children), "children", "must differ")
        require(len(self.frames) == len(members), "frames", f"must be {len(members)} segments")
        for name, numbers in (
            ("settled", self.settled),
            ("stood_for", [each.number for each in self.stood_for]),
        ):
            require(members.issuperset(numbers), name, f"must be among {sorted(members)}")
        require(np.array_equal(self.matrix, self.matrix.T), "matrix", "must be symmetric")


@dataclass
class Node:
    """A group of similar segments; a leaf is a primitive.

    Nothing of it is changed in place but by setting an attribute, which is noticed.

    Attributes:
        id: Identity, for life.
        parent: Id of the node above; None at the root.
        born_at: How many segments the tree had seen when it was formed.
        members: Numbers of its kept exemplars, in the order of their arrival.
        matrix: Distances among them, shape (k, k).
        n_placed: Segments ever placed in it.
        n_frames: Frames of those.
        children: Ids of the nodes below.
        settled: Those of its exemplars that went to one of them; in the root, that are fragments of
            executions of one.
        history: Kind and time of what happened to it: ("born", n), ("split", n), ("merged", n),
            ("moved", n), ("undone", n), ("kept", n).
        whole: Whether a person said that it is one motion: the rules never split it.
        apart: Ids of leaves that a person said are other motions: the rules never merge them.
        frozen: Whether a person said that it is to stay as it is: nothing changes its exemplars.
        stood_for: Segments and frames that went for want of room, by the exemplar nearest to them.
        revision: Another object after each change, and in each node, of whatever process.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift) for k in (1.0, 1.01, 0.99, -1.0, -1.01)]
        >>> leaf = tree.node(tree.leaves[0])
        >>> leaf.is_leaf, leaf.n_placed, leaf.matrix.shape
        (True, 3, (3, 3))
    """

    id: int
    parent: int | None
    born_at: int
    members: tuple[int, ...] = ()
    matrix: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    n_placed: int = 0
    n_frames: int = 0
    children: tuple[int, ...] = ()
    settled: frozenset[int] = frozenset()
    history: tuple[tuple[Happening, int], ...] = ()
    whole: bool = False
    apart: frozenset[int] = frozenset()
    frozen: bool = False
    stood_for: Mapping[int, tuple[int, int]] = field(default_factory=dict)
    revision: object = field(init=False, repr=False)
    _kept: tuple[object, NodeState] | None = field(init=False, repr=False, default=None)
    _table: ClassVar[Table | None] = None  # in each node that is in one, that one

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute, and let its state be looked at anew."""
        self.__dict__.update({name: value, "revision": object()})
        if self._table is not None:
            self._table.notice(self.id)

    def __getstate__(self) -> dict[str, Any]:
        """Return its attributes: not the table that it is in."""
        return {name: value for name, value in self.__dict__.items() if name != "_table"}

    def __eq__(self, other: object) -> bool:
        """Whether it is a node of the same content, frames apart."""
        if not isinstance(other, Node):
            return NotImplemented
        same = self._plain() == other._plain()
        return same and np.array_equal(self.matrix, other.matrix)

    @property
    def is_leaf(self) -> bool:
        """Whether there is no node below."""
        return not self.children

    @property
    def by_hand(self) -> bool:
        """Whether a person, or a merge, had a hand in it: it is no chance."""
        return bool(self.whole or self.frozen or self.apart or len(self.history) > 1)

    @property
    def diameter(self) -> float:
        """Largest distance between its exemplars, D_max^G."""
        return float(self.matrix.max()) if self.matrix.size else 0.0

    def add(self, number: int, row: FloatArray) -> None:
        """Take an exemplar, ``row`` being its distances to the members, shape (k,)."""
        k = len(self.members)
        grown = np.zeros((k + 1, k + 1))
        grown[:k, :k] = self.matrix
        grown[k, :k] = grown[:k, k] = row
        self.matrix = grown
        self.members += (number,)

    def remove(self, positions: list[int]) -> list[int]:
        """Let exemplars go, and return their numbers."""
        gone, places = [self.members[i] for i in positions], set(positions)
        self.members = tuple(m for i, m in enumerate(self.members) if i not in places)
        self.matrix = without(self.matrix, positions)
        self.settled -= set(gone)
        self.stood_for = {n: of for n, of in self.stood_for.items() if n not in gone}
        return gone

    def thin(self, most: int, length_of: Callable[[int], int]) -> list[int]:
        """Let the least informative exemplars go until ``most`` are left; return their numbers.

        Those that are nearest to them stand for them from then on.

        Args:
            most: How many may be left, at least one.
            length_of: Returns the frames of an exemplar, by its number.
        """
        gone: list[int] = []
        while len(self.members) > most:
            at = most_redundant(self.matrix)
            others = self.matrix[at].copy()
            others[at] = np.inf
            nearest = self.members[int(others.argmin())]
            stood_for = self.stood_for.get(self.members[at], (0, 0))
            gone += self.remove([at])
            self.stand_for(nearest, 1 + stood_for[0], length_of(gone[-1]) + stood_for[1])
        return gone

    def stand_for(self, number: int, n: int, n_frames: int) -> None:
        """Let an exemplar stand for so many segments, and frames, more."""
        known = self.stood_for.get(number, (0, 0))
        self.stood_for = {**self.stood_for, number: (known[0] + n, known[1] + n_frames)}

    def state(self, blob_of: Callable[[int], Blob]) -> NodeState:
        """Return everything, with the exemplars: the same object as long as nothing has changed.

        What was set to what it is, as by who unfreezes what is not frozen, has not changed.

        Args:
            blob_of: Returns the frames of an exemplar, by its number.
        """
        kept = self._kept
        if kept is None or kept[0] is not self.revision:
            made = kept[1] if kept and self._is(kept[1]) else self._described(blob_of)
            kept = self.__dict__["_kept"] = self.revision, made
        return kept[1]

    @classmethod
    def from_state(cls, state: NodeState) -> Node:
        """Return the node that `state` described."""
        node = cls(
            id=state.id,
            parent=state.parent,
            born_at=state.born_at,
            members=tuple(state.members.tolist()),
            matrix=state.matrix,
            n_placed=state.n_placed,
            n_frames=state.n_frames,
            children=state.children,
            settled=frozenset(state.settled),
            history=state.history,
            whole=state.whole,
            apart=frozenset(state.apart),
            frozen=state.frozen,
            stood_for={number: (n, n_frames) for number, n, n_frames in state.stood_for},
        )
        node.__dict__["_kept"] = node.revision, state
        return node

    def _described(self, blob_of: Callable[[int], Blob]) -> NodeState:
        """Return everything, see `state`."""
        return NodeState(
            id=self.id,
            parent=self.parent,
            born_at=self.born_at,
            members=np.array(self.members, np.int64),
            frames=tuple(map(blob_of, self.members)),
            matrix=self.matrix,
            n_placed=self.n_placed,
            n_frames=self.n_frames,
            children=self.children,
            settled=tuple(sorted(self.settled)),
            history=self.history,
            whole=self.whole,
            apart=tuple(sorted(self.apart)),
            frozen=self.frozen,
            stood_for=tuple(StoodFor(n, *of) for n, of in sorted(self.stood_for.items())),
        )

    def _is(self, state: NodeState) -> bool:
        """Whether a state describes it as it is."""
        return self.matrix is state.matrix and self._plain() == Node.from_state(state)._plain()

    def _plain(self) -> tuple[Any, ...]:
        """Return all but the distances, for comparison."""
        return (
            *(self.id, self.parent, self.born_at, self.n_placed, self.n_frames),
            *(self.whole, self.frozen, self.members, self.children, self.history),
            *(self.settled, self.apart, self.stood_for),
        )


def without_one(ids: tuple[int, ...], gone: int) -> tuple[int, ...]:
    """Return ids less one of them."""
    return tuple(id for id in ids if id != gone)

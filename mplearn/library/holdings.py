"""What a library holds, and how it is found there."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from ..errors import InvalidValueError, UnknownPrimitiveError
from ..graph import TransitionGraph
from .primitive import Primitive

if TYPE_CHECKING:
    from ..tree import Recogniser

Key: TypeAlias = int | str


class TreeNode(NamedTuple):
    """A node of the tree that the primitives were learned in.

    Attributes:
        id: Identity; that of its primitive, if it is a leaf.
        parent: Node above it; None at the root.
        n_exemplars: How many segments were placed in it.
    """

    id: int
    parent: int | None
    n_exemplars: int


@dataclass(frozen=True, eq=False)
class Holdings:
    """Primitives and their transitions, frozen.

    Attributes:
        primitives: The primitives.
        graph: Their transitions; a snapshot that refuses changes, its `copy` can grow.
        channels: Name of each channel, length D.
        rate_hz: Frame rate of models and exemplars [1/s].
        body: Name of the body that moves; empty where the channels are no body's.
        tree: The nodes of the tree.
        recogniser: What recognises segments; None in a library that only acts.
    """

    primitives: tuple[Primitive, ...]
    graph: TransitionGraph = field(repr=False)
    channels: tuple[str, ...]
    rate_hz: float
    body: str = ""
    tree: tuple[TreeNode, ...] = field(default=(), repr=False)
    recogniser: Recogniser | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "primitives", tuple(self.primitives))
        object.__setattr__(self, "channels", tuple(self.channels))
        object.__setattr__(self, "tree", tuple(TreeNode(*node) for node in self.tree))
        ids = [primitive.id for primitive in self.primitives]
        names = [primitive.name for primitive in self.primitives]
        for what, values in (("ids", ids), ("names", names), ("channels", self.channels)):
            if len(set(values)) != len(values):
                raise InvalidValueError(f"{what} of a library must differ, not {values}")
        for primitive in self.primitives:
            if primitive.hmm.n_channels != len(self.channels):
                raise InvalidValueError(
                    f"primitive {primitive.id} has {primitive.hmm.n_channels} channels, "
                    f"the library {len(self.channels)}"
                )
            if primitive.rate_hz != self.rate_hz:
                raise InvalidValueError(
                    f"primitive {primitive.id} has rate_hz {primitive.rate_hz}, "
                    f"the library {self.rate_hz}"
                )
        strangers = set(self.graph.ids) - set(ids)
        if strangers:
            raise InvalidValueError(f"the graph names {sorted(strangers)}, which are no primitives")
        graph, missing = self.graph, [id for id in ids if id not in self.graph]
        if missing:
            graph = graph.copy()
            for id in missing:
                graph.add_node(id)
        object.__setattr__(self, "graph", graph.snapshot())

    def __len__(self) -> int:
        """Number of primitives."""
        return len(self.primitives)

    def __getitem__(self, key: Key) -> Primitive:
        """Return a primitive by id or name.

        Raises:
            UnknownPrimitiveError: There is none.
        """
        found = self._by_key.get(key)
        if found is None:
            names = ", ".join(primitive.name for primitive in self.primitives[:30])
            raise UnknownPrimitiveError(
                f"no primitive {key!r} in the library; it holds {len(self)}: {names}"
            )
        return found

    def __contains__(self, key: object) -> bool:
        """Whether there is a primitive of this id or name."""
        return key in self._by_key

    @property
    def ids(self) -> tuple[int, ...]:
        """Ids of the primitives."""
        return tuple(primitive.id for primitive in self.primitives)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the primitives."""
        return tuple(primitive.name for primitive in self.primitives)

    @cached_property
    def _by_key(self) -> dict[Key, Primitive]:
        keyed: dict[Key, Primitive] = {p.name: p for p in self.primitives}
        return keyed | {p.id: p for p in self.primitives}

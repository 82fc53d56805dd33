"""The nodes of a tree by id, and which of them have changed since somebody looked."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import takewhile
from operator import is_
from typing import Any, NamedTuple

from ...state import Blob, Block, Row
from .node import Node, NodeState

_BLOCK = 64  # ids of nodes whose states are kept together


class Mark(NamedTuple):
    """A moment in the life of a table.

    Attributes:
        life: That of the table; a copy of it, or a pickle, has another one.
        at: How many changes it had seen.
    """

    life: object
    at: int


class NodeTable(dict[int, Node]):
    """Nodes by id, in the order of their birth; whatever changes is noticed.

    ``table[id] = node``, ``del table[id]`` and the attributes of its nodes are all that changes it.

    Args:
        nodes: Those there are at first, in the order of their ids.
    """

    def __init__(self, nodes: Iterable[Node] = ()) -> None:
        super().__init__()
        self._life = object()
        self._n_changes = 0
        self._changed: dict[int, int] = {}  # the latest change of each id, the latest of all last
        self._known_from = 0
        self._described: tuple[Mark, dict[int, Block[NodeState]]] | None = None
        for node in nodes:
            self[node.id] = node

    def __setitem__(self, id: int, node: Node) -> None:
        """Take a node."""
        super().__setitem__(id, node)
        node.__dict__["_table"] = self
        self.notice(id)

    def __delitem__(self, id: int) -> None:
        """Let a node go."""
        super().__delitem__(id)
        self.notice(id)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make it again: of its nodes."""
        return NodeTable, (tuple(self.values()),)

    def notice(self, id: int) -> None:
        """Take note that a node has changed, or is gone."""
        self._n_changes += 1
        self._changed.pop(id, None)
        self._changed[id] = self._n_changes
        if len(self._changed) > 2 * len(self) + _BLOCK:  # most of them are long gone
            self._changed, self._known_from = {}, self._n_changes

    def mark(self) -> Mark:
        """Return this moment, for `changed_since`."""
        return Mark(self._life, self._n_changes)

    def changed_since(self, mark: Mark | None) -> dict[int, Node | None] | None:
        """Return the nodes that came, changed or went by id; None where that is not known."""
        if mark is None or mark.life is not self._life or mark.at < self._known_from:
            return None
        latest = reversed(self._changed.items())
        return {id: self.get(id) for id, _ in takewhile(lambda each: each[1] > mark.at, latest)}

    def states(self, blob_of: Callable[[int], Blob]) -> Row[NodeState]:
        """Return all nodes by id, with their exemplars: what has not changed as the same objects.

        Args:
            blob_of: Returns the frames of an exemplar, by its number.
        """
        mark, blocks = self._described or (None, {})
        changed: Iterable[int] | None = self.changed_since(mark)
        if changed is None:
            changed, blocks = self, {}
        for at in {id // _BLOCK for id in changed}:
            ids = range(at * _BLOCK, (at + 1) * _BLOCK)
            now = Block(self[id].state(blob_of) for id in ids if id in self)
            known = blocks.pop(at, Block())
            same = len(now) == len(known) and all(map(is_, now, known))
            if now:
                blocks[at] = known if same else now
        self._described = self.mark(), blocks
        return Row.of(blocks[at] for at in sorted(blocks))

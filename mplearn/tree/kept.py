"""A tree as it is kept: nodes and exemplars can be looked at before any model is made."""

from __future__ import annotations

from typing import Any

from ..recording import FloatArray
from ..state import validated
from .nodes.node import Node
from .tree import PrimitiveTree, TreeState

_MADE = ("_memory", "_structure", "_models")


class KeptTree(PrimitiveTree):
    """A tree that makes the models of its exemplars once something asks for them.

    Until then nodes, exemplars and the state are what was loaded, and cost nothing: whoever merges
    trees of different people asks for no more. Otherwise it is as every tree.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import TreeConfig
        >>> shapes = [np.outer(np.sin(k * np.linspace(0, 3, 50)), [1.0, k]) for k in (1, 2, 3)]
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> for shape in shapes * 4:
        ...     placement = tree.insert(shape)
        >>> kept = KeptTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> kept.load_state(tree.state())
        >>> kept.leaves == tree.leaves
        True
        >>> kept.insert(shapes[0]).node_id == tree.insert(shapes[0]).node_id
        True
    """

    _state: TreeState | None = None
    _least: int | None = None

    def load_state(self, state: TreeState) -> None:
        """Resume from what `state` returned, under the same configuration.

        Raises:
            StateError: Something in it does not fit this tree; nothing has changed. That a segment
                cannot be modelled is found out later.
        """
        state = validated(state)
        self._check_fits(state)
        self.n_seen, self.to_form, self._state = state.n_seen, state.to_form, state
        self._nodes = {node.id: Node.from_state(node) for node in state.nodes}
        for name in _MADE:
            self.__dict__.pop(name, None)

    def __getattr__(self, name: str) -> Any:
        """Make what is asked for: only the first time, it is an attribute then."""
        if name not in _MADE or self.__dict__.get("_state") is None:
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        self.wake()
        return self.__dict__[name]

    def wake(self) -> None:
        """Make all models now, if they are not made yet.

        Raises:
            StateError: A segment cannot be modelled.
        """
        state, self._state = self._state, None
        if state is not None:
            self._resume(state)
            if self._least is not None:
                super().require_exemplars(self._least)

    @property
    def leaves(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""
        if self._state is None:
            return super().leaves
        return tuple(sorted(id for id, node in self._nodes.items() if id and node.is_leaf))

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes, the root first, in the order of their birth."""
        return super().nodes if self._state is None else tuple(self._nodes.values())

    def node(self, id: int) -> Node:
        """Return a node.

        Raises:
            UnknownPrimitiveError: There is none of this id.
        """
        known = self._state is not None and id in self._nodes
        return self._nodes[id] if known else super().node(id)

    def exemplars(self, id: int) -> tuple[FloatArray, ...]:
        """Return the kept segments of a node as they came, shape (L, D) each."""
        if self._state is None:
            return super().exemplars(id)
        (node,) = (node for node in self._state.nodes if node.id == self.node(id).id)
        return tuple(blob.array for blob in node.frames)

    def require_exemplars(self, least: int) -> None:
        """Let clusters become nodes from so many members on, if that is more than by the rules."""
        self._least = least
        if self._state is None:
            super().require_exemplars(least)

    def state(self) -> TreeState:
        """Return all that the tree knows: `load_state` resumes bit for bit."""
        return super().state() if self._state is None else self._state

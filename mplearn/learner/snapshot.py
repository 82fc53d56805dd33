"""From what is being learned to a library, which is frozen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from ..body import View
from ..graph import TransitionGraph
from ..hmm import LeftRightHMM
from ..library import Primitive, PrimitiveLibrary, TreeNode
from ..people import PeopleTree
from ..recording import FloatArray
from ..state import SharedState
from ..tree import Node

_LOOKED_AT = 256  # primitives that `prepare` looks at in one part


@dataclass(frozen=True, eq=False)
class FrozenState(SharedState):
    """A primitive that stays as it was when it was frozen."""

    primitive: Primitive


class _Made(NamedTuple):
    """A primitive that was made of a node.

    Attributes:
        revision: That of the node.
        basis: What its model depends on besides it, see `PeopleTree.model_basis`.
        seen: Its model in the tree.
        primitive: What was made of it.
    """

    revision: object
    basis: FloatArray | None
    seen: LeftRightHMM
    primitive: Primitive


class Snapshots:
    """Takes libraries of a learner; a primitive that has not changed is made once.

    Args:
        view: How the tree sees the channels.
        channels: What the primitives are made of.
        rate_hz: Frames per second [1/s].
        body: Name of the body whose features the channels are; empty for none.

    Attributes:
        frozen: Primitives that stay as they were, by id.
    """

    def __init__(self, view: View, channels: tuple[str, ...], rate_hz: float, body: str) -> None:
        self._view = view
        self._channels = channels
        self._rate_hz = rate_hz
        self._body = body
        self._made: dict[int, _Made] = {}
        self._nodes: dict[int, TreeNode] = {}
        self._left: list[int] | None = None  # what `prepare` has still to look at
        self.frozen: dict[int, FrozenState] = {}

    def freeze(self, tree: PeopleTree, id: int) -> None:
        """Let a primitive be what it is now in all libraries to come."""
        (node,) = (node for node in tree.nodes if node.id == id)
        self.frozen[id] = FrozenState(self._primitive(tree, node, tree.model_basis).primitive)

    def prepare(self, tree: PeopleTree) -> bool:
        """Make one of the primitives that `take` would have to make; return whether none is left.

        It goes through them once, a part at a time; what changes behind it is left to `take`.

        Args:
            tree: See `take`.
        """
        if self._left is None:
            self._left = list(reversed(tree.leaves))
        with tree.still():
            return self._prepare(tree, self._left)

    def _prepare(self, tree: PeopleTree, left: list[int]) -> bool:
        part = set(left[-_LOOKED_AT:]) & set(tree.leaves)
        nodes = {node.id: node for node in tree.nodes if node.id in part}
        basis = tree.model_basis
        for _ in range(min(len(left), _LOOKED_AT)):
            id = left.pop()
            if id in nodes:
                before, made = self._made.get(id), self._primitive(tree, nodes[id], basis)
                self._made[id] = made
                if before is None or before.primitive is not made.primitive:
                    return False
        if left:
            return False
        self._left = None
        return True

    def take(self, tree: PeopleTree, graph: TransitionGraph) -> PrimitiveLibrary:
        """Return the primitives and transitions that are known now.

        What several people do is one primitive, with a node of the tree for each person below it.

        Args:
            tree: Its leaves become primitives.
            graph: Their transitions.
        """
        with tree.still():
            nodes, basis = {node.id: node for node in tree.nodes}, tree.model_basis
            self._made = {id: self._primitive(tree, nodes[id], basis) for id in tree.leaves}
        self._nodes = {id: self._node(node) for id, node in nodes.items()}
        primitives = [
            replace(self.frozen[id].primitive, parent=made.primitive.parent)
            if id in self.frozen
            else made.primitive
            for id, made in self._made.items()
        ]
        return PrimitiveLibrary(
            primitives=tuple(primitives),
            graph=graph,
            channels=self._channels,
            rate_hz=self._rate_hz,
            body=self._body,
            tree=tuple(self._nodes.values()),
            recogniser=tree.recogniser(),
        )

    def _node(self, node: Node) -> TreeNode:
        """Return a node; the same object as in the library before, if it has not changed."""
        now = node.id, node.parent, node.n_placed
        known = self._nodes.get(node.id)
        return known if known is not None and known == now else TreeNode(*now)

    def _primitive(self, tree: PeopleTree, node: Node, basis: FloatArray | None) -> _Made:
        """Return a primitive as its node is now: the same object, if it has not changed."""
        known = self._made.get(node.id)
        if known and known.revision is node.revision and known.basis is basis is not None:
            return known
        seen = tree.model(node.id)  # the same one, as long as the exemplars are
        mean_duration_s = node.n_frames / node.n_placed / self._rate_hz
        if known is not None and known.seen is seen:
            now, made = (node.n_placed, mean_duration_s, node.parent), known.primitive
            if (made.n_exemplars, made.mean_duration_s, made.parent) == now:
                return _Made(node.revision, basis, seen, made)
        view = self._view
        made = Primitive.from_exemplars(
            node.id,
            read_model(view, seen),
            [view.read(frames) for frames in tree.exemplars(node.id)],
            self._rate_hz,
            n_exemplars=node.n_placed,
            mean_duration_s=mean_duration_s,
            parent=node.parent,
        )
        return _Made(node.revision, basis, seen, made)


def read_model(view: View, seen: LeftRightHMM) -> LeftRightHMM:
    """Return the model of frames that were seen so."""
    return LeftRightHMM(view.read(seen.means), view.read_variances(seen.variances), seen.log_stay)

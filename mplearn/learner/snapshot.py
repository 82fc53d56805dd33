"""From what is being learned to a library, which is frozen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ..body import View
from ..graph import TransitionGraph
from ..hmm import LeftRightHMM
from ..library import Primitive, PrimitiveLibrary, TreeNode
from ..people import PeopleTree
from ..recording import FloatArray
from ..state import SharedState
from ..tree import ROOT, Node
from ..tree.nodes.node_table import Mark

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
        self._primitives: dict[int, Primitive] = {}
        self._names: set[str] = set()
        self._mark: Mark | None = None  # when `take` looked at the nodes
        self._basis: FloatArray | None = None
        self._frozen: dict[int, FrozenState] = {}  # those that it took
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
        mark, basis, graph = tree.mark(), tree.model_basis, graph.snapshot()
        changed = tree.changed_since(self._mark)
        same_rules = basis is self._basis is not None and self._frozen == self.frozen
        with tree.still():
            known = same_rules and changed is not None and self._follow(tree, changed, graph)
            if not known:
                self._mark = None
                self._go_through(tree, basis)
        make = PrimitiveLibrary.of_fitting if known else PrimitiveLibrary
        library = make(
            primitives=tuple(self._primitives.values()),
            graph=graph,
            channels=self._channels,
            rate_hz=self._rate_hz,
            body=self._body,
            tree=tuple(self._nodes.values()),
            recogniser=tree.recogniser(),
        )
        self._mark, self._basis, self._frozen = mark, basis, dict(self.frozen)
        return library

    def _go_through(self, tree: PeopleTree, basis: FloatArray | None) -> None:
        """Look at all nodes."""
        nodes = {node.id: node for node in tree.nodes}
        self._made = {id: self._primitive(tree, nodes[id], basis) for id in tree.leaves}
        self._nodes = {id: self._node(node) for id, node in nodes.items()}
        self._primitives = {id: self._chosen(id) for id in self._made}
        self._names = {each.name for each in self._primitives.values()}

    def _follow(
        self, tree: PeopleTree, changed: Mapping[int, Node | None], graph: TransitionGraph
    ) -> bool:
        """Look at nodes that have changed; return False if all have to be looked at."""
        for id in sorted(changed):
            node, old = changed[id], self._primitives.get(id)
            if old is not None:
                self._names.discard(old.name)
            if node is None:
                self._nodes.pop(id, None)
            elif not _comes_last(id, self._nodes):
                return False
            else:
                self._nodes[id] = self._node(node)
            if node is None or not node.is_leaf or id == ROOT:
                self._made.pop(id, None)
                self._primitives.pop(id, None)
                if id in graph:
                    return False
                continue
            self._made[id] = self._primitive(tree, node, self._basis)
            now = self._chosen(id)
            if now.name in self._names or not (_comes_last(id, self._primitives) and id in graph):
                return False
            self._primitives[id] = now
            self._names.add(now.name)
        return len(graph) == len(self._primitives)

    def _chosen(self, id: int) -> Primitive:
        """Return what a primitive is in a library: as it was when it was frozen, if it is."""
        made, frozen = self._made[id].primitive, self.frozen.get(id)
        return made if frozen is None else replace(frozen.primitive, parent=made.parent)

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


def _comes_last(id: int, known: dict[int, Any]) -> bool:
    """Whether an id is known, or comes after all that are."""
    return id in known or not known or id > next(reversed(known))


def read_model(view: View, seen: LeftRightHMM) -> LeftRightHMM:
    """Return the model of frames that were seen so."""
    return LeftRightHMM(view.read(seen.means), view.read_variances(seen.variances), seen.log_stay)

"""The primitives of one person, and those of several, behind one protocol."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from operator import is_not
from typing import Protocol

import numpy as np

from ..errors import UnknownPrimitiveError
from ..hmm import LeftRightHMM
from ..recording import FloatArray, IntArray
from ..tree import Change, Exchange, Node, Placement, PrimitiveTree, Recogniser
from ..tree.nodes.node_table import Mark
from . import editing
from .common import CommonRecogniser, common_model
from .constraints import Key
from .reversal import PeopleEdit, exchanged
from .sharing import Sharing
from .sharing_state import SharingState


class Primitives(Protocol):
    """What a `PeopleTree` asks of its primitives, whoever performs them."""

    @property
    def next_id(self) -> int:
        """First id that was never used."""

    @property
    def leaves(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes, the root first."""

    @property
    def numbers(self) -> Mapping[int, Mapping[int, int]]:
        """Number here of each segment of a person's tree, by person; empty if they are the same."""

    @property
    def joined(self) -> Collection[int]:
        """Numbers of the segments in no leaf of their person that are in others' primitives."""

    def still(self) -> AbstractContextManager[None]:
        """While this lasts nothing changes: what is asked of many primitives is looked up once."""

    def mark(self) -> Mark | None:
        """Return this moment, for `changed_since`; None where changes are not noticed."""

    def changed_since(self, mark: Mark | None) -> dict[int, Node | None] | None:
        """Return the nodes that came, changed or went by id; None where that is not known."""

    def node(self, id: int) -> Node:
        """Return a node."""

    def radius(self, id: int) -> float:
        """Return the radius of a node below the root."""

    def exemplars(self, id: int) -> tuple[FloatArray, ...]:
        """Return the kept segments of a node, shape (L, D) each."""

    def model(self, id: int) -> LeftRightHMM:
        """Return a node's group model."""

    @property
    def model_basis(self) -> FloatArray | None:
        """What models depend on besides their exemplars; None where each has to be asked for."""

    def n_placed(self, id: int) -> int:
        """Return how many segments were ever placed in a node."""

    def nearest_others(self, person: int) -> tuple[IntArray, FloatArray]:
        """Return how far a person's exemplars are from others of their primitive."""

    def recogniser(self) -> Recogniser:
        """Return what would be recognised now, frozen."""

    def follow(self, person: int, placement: Placement, frames: FloatArray) -> Placement:
        """Take note of what a person's tree did with a segment; return what it means for all."""

    @property
    def in_turn(self) -> bool:
        """Whether a segment may form one primitive at most, and `form_next` the others."""

    @property
    def to_form(self) -> int:
        """Primitives that `form_next` may form yet, at most."""

    def form_next(self) -> Change:
        """Form one more of the primitives that the latest segment may form yet."""

    def split(self, id: int, groups: Sequence[Sequence[int]] | None) -> Change:
        """Split a primitive."""

    def merge(self, first: int, second: int) -> Change:
        """Merge two primitives."""

    def reparent(self, id: int, parent: int) -> Change:
        """Hang a node below another."""

    def remove(self, id: int, *, forget: bool) -> Change:
        """Take a primitive out."""

    def keep(self, id: int) -> Change:
        """Let the rules neither forget nor drop a primitive."""

    def freeze(self, id: int, frozen: bool) -> Change:
        """Let a primitive stay as it is, or change again."""

    def exchange(self, edit: PeopleEdit, exchanges: Mapping[int, Exchange]) -> Exchange:
        """Follow an edit that was undone in people's trees."""

    def state(self) -> SharingState | None:
        """Return what is kept beside the trees."""


class OnePersonsPrimitives:
    """The primitives of one person: the leaves of that person's tree.

    Args:
        tree: The tree.
        next_id: First id that was never used.
    """

    def __init__(self, tree: PrimitiveTree, next_id: int) -> None:
        self.tree = tree
        self.next_id = next_id

    @property
    def leaves(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""
        return self.tree.leaves

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes of the tree, the root first."""
        return self.tree.nodes

    @property
    def numbers(self) -> Mapping[int, Mapping[int, int]]:
        """Nothing: segments have the numbers of the tree."""
        return {}

    @property
    def joined(self) -> Collection[int]:
        """Nothing: there are no others."""
        return ()

    def still(self) -> AbstractContextManager[None]:
        """Return nothing to be done: the tree knows its nodes by id."""
        return nullcontext()

    def mark(self) -> Mark:
        """Return this moment in the life of the tree."""
        return self.tree.mark()

    def changed_since(self, mark: Mark | None) -> dict[int, Node | None] | None:
        """Return the nodes of the tree that came, changed or went."""
        return self.tree.changed_since(mark)

    def node(self, id: int) -> Node:
        """Return a node of the tree."""
        return self.tree.node(id)

    def radius(self, id: int) -> float:
        """Return the radius of a node of the tree."""
        return self.tree.radius(id)

    def exemplars(self, id: int) -> tuple[FloatArray, ...]:
        """Return the kept segments of a node of the tree."""
        return self.tree.exemplars(id)

    def model(self, id: int) -> LeftRightHMM:
        """Return the model of a node of the tree."""
        return self.tree.model(id)

    @property
    def model_basis(self) -> FloatArray | None:
        """What models of the tree depend on besides their exemplars."""
        return self.tree.model_basis

    def n_placed(self, id: int) -> int:
        """Return how many segments were ever placed in a node of the tree."""
        return self.tree.node(id).n_placed

    def nearest_others(self, person: int) -> tuple[IntArray, FloatArray]:
        """Return how far exemplars are from others of their leaf."""
        return np.array(self.tree.leaves, np.int64), self.tree.nearest_others()

    def recogniser(self) -> Recogniser:
        """Return what the tree would recognise now."""
        return self.tree.recogniser()

    def follow(self, person: int, placement: Placement, frames: FloatArray) -> Placement:
        """Return what the tree said."""
        self._count(placement.born)
        return placement

    @property
    def in_turn(self) -> bool:
        """True: nothing depends on which were formed at once."""
        return True

    @property
    def to_form(self) -> int:
        """Primitives that the tree may form yet."""
        return self.tree.to_form

    def form_next(self) -> Change:
        """Form one more in the tree."""
        return self._edited(self.tree.form_next())

    def split(self, id: int, groups: Sequence[Sequence[int]] | None) -> Change:
        """Split a leaf of the tree."""
        return self._edited(self.tree.split(id, groups))

    def merge(self, first: int, second: int) -> Change:
        """Merge two leaves of the tree."""
        return self._edited(self.tree.merge(first, second))

    def reparent(self, id: int, parent: int) -> Change:
        """Hang a node of the tree below another."""
        return self._edited(self.tree.reparent(id, parent))

    def remove(self, id: int, *, forget: bool) -> Change:
        """Take a leaf out of the tree."""
        return self._edited(self.tree.remove(id, forget=forget))

    def keep(self, id: int) -> Change:
        """Keep a leaf of the tree."""
        return self.tree.keep(id)

    def freeze(self, id: int, frozen: bool) -> Change:
        """Freeze a leaf of the tree."""
        return self.tree.freeze(id, frozen)

    def exchange(self, edit: PeopleEdit, exchanges: Mapping[int, Exchange]) -> Exchange:
        """Return what the only tree said."""
        (found,) = exchanges.values()
        return found

    def state(self) -> None:
        """Return nothing: all is in the tree."""

    def _edited(self, change: Change) -> Change:
        self._count(change.born)
        return change

    def _count(self, born: Sequence[int]) -> None:
        self.next_id = max((self.next_id, *(id + 1 for id in born)))


class SharedPrimitives:
    """The primitives of several people: each is a leaf a person, or several, of their trees.

    Args:
        sharing: Which leaves are one primitive.
    """

    def __init__(self, sharing: Sharing) -> None:
        self.sharing = sharing
        self._common = CommonRecogniser(sharing.config)
        self._models: dict[int, tuple[tuple[LeftRightHMM, ...], LeftRightHMM]] = {}
        self._still: tuple[dict[int, list[Key]], dict[int, Node]] | None = None

    @property
    def next_id(self) -> int:
        """First id that was never used."""
        return self.sharing.next_id

    @property
    def leaves(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""
        return self.sharing.primitives

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes, the root first: primitives, and below them a leaf for each person."""
        return self.sharing.nodes if self._still is None else tuple(self._still[1].values())

    @property
    def numbers(self) -> Mapping[int, Mapping[int, int]]:
        """Number here of each segment of a person's tree, by person."""
        return self.sharing.numbers

    @property
    def joined(self) -> Collection[int]:
        """Numbers of the segments that are in another person's primitive."""
        return self.sharing.provisional.homes()

    @contextmanager
    def still(self) -> Iterator[None]:
        """While this lasts nothing changes: leaves and nodes are gone through once."""
        leaves: dict[int, list[Key]] = {}
        for leaf in self.sharing.leaves:
            for id in {leaf.id, leaf.primitive}:
                leaves.setdefault(id, []).append(leaf.key)
        before, self._still = self._still, (leaves, {node.id: node for node in self.sharing.nodes})
        try:
            yield
        finally:
            self._still = before

    def mark(self) -> None:
        """Return nothing: nodes are put together whenever they are asked for."""

    def changed_since(self, mark: Mark | None) -> None:
        """Return nothing: any of them may be another one."""

    def node(self, id: int) -> Node:
        """Return a node.

        Raises:
            UnknownPrimitiveError: There is none of this id.
        """
        nodes = self._still[1] if self._still else {node.id: node for node in self.sharing.nodes}
        if id not in nodes:
            raise UnknownPrimitiveError(f"no node {id} in the tree; it holds {list(nodes)}")
        return nodes[id]

    def radius(self, id: int) -> float:
        """Return the radius of a primitive's widest leaf."""
        return max(self._trees[p].radius(leaf) for p, leaf in self._leaves_of(id))

    def exemplars(self, id: int) -> tuple[FloatArray, ...]:
        """Return the kept segments of all leaves."""
        return tuple(
            frames for p, leaf in self._leaves_of(id) for frames in self._trees[p].exemplars(leaf)
        )

    def model(self, id: int) -> LeftRightHMM:
        """Return the group model of all leaves together."""
        leaves = self._leaves_of(id)
        if len(leaves) == 1:
            person, leaf = leaves[0]
            return self._trees[person].model(leaf)
        models = tuple(self._trees[p].model(leaf) for p, leaf in leaves)
        known = self._models.get(id)
        if known is None or len(known[0]) != len(models) or any(map(is_not, known[0], models)):
            known = self._models[id] = models, common_model(models, self.exemplars(id))
        return known[1]

    @property
    def model_basis(self) -> None:
        """Nothing: nodes of several people are put together whenever they are asked for."""

    def n_placed(self, id: int) -> int:
        """Return how many segments were ever placed in any of the leaves."""
        return sum(self._trees[p].node(leaf).n_placed for p, leaf in self._leaves_of(id))

    def nearest_others(self, person: int) -> tuple[IntArray, FloatArray]:
        """Return how far a person's exemplars are from others; of several leaves the fullest's."""
        tree, fullest = self._trees[person], dict[int, tuple[int, int]]()
        for leaf in self.sharing.leaves:
            if leaf.person == person:
                size = len(tree.node(leaf.local).members)
                if size > fullest.get(leaf.primitive, (0, 0))[0]:
                    fullest[leaf.primitive] = size, leaf.local
        rows = np.searchsorted(tree.leaves, [local for _, local in fullest.values()])
        return np.array(list(fullest), np.int64), tree.nearest_others()[rows]

    def recogniser(self) -> Recogniser:
        """Return what would be recognised now, whoever moves."""
        leaves: dict[int, list[Key]] = {}
        for leaf in self.sharing.leaves:
            leaves.setdefault(leaf.primitive, []).append(leaf.key)
        return self._common.of(self._trees, leaves, self.sharing.numbers)

    def follow(self, person: int, placement: Placement, frames: FloatArray) -> Placement:
        """Take note of what a person's tree did with a segment; return what it means for all."""
        return self.sharing.follow(person, placement, frames)

    @property
    def in_turn(self) -> bool:
        """False: which leaves are one primitive is found out of all that are formed."""
        return False

    @property
    def to_form(self) -> int:
        """None: all were formed at once."""
        return 0

    def form_next(self) -> Change:
        """Form nothing."""
        return Change()

    def split(self, id: int, groups: Sequence[Sequence[int]] | None) -> Change:
        """Split a primitive, and people's leaves where their exemplars go apart."""
        return editing.split(self.sharing, id, groups)

    def merge(self, first: int, second: int) -> Change:
        """Merge two primitives, and the leaves of whoever has one in both."""
        return editing.merge(self.sharing, first, second)

    def reparent(self, id: int, parent: int) -> Change:
        """Hang a primitive below a node, or a person's leaf below a primitive."""
        return editing.move(self.sharing, id, parent)

    def remove(self, id: int, *, forget: bool) -> Change:
        """Take a primitive out, or a person's leaf of it."""
        return editing.remove(self.sharing, id, forget=forget)

    def keep(self, id: int) -> Change:
        """Keep all leaves of a primitive."""
        return editing.keep(self.sharing, id)

    def freeze(self, id: int, frozen: bool) -> Change:
        """Freeze all leaves of a primitive."""
        return editing.freeze(self.sharing, id, frozen)

    def exchange(self, edit: PeopleEdit, exchanges: Mapping[int, Exchange]) -> Exchange:
        """Let primitives follow what was undone in people's trees."""
        return exchanged(self.sharing, edit, exchanges)

    def state(self) -> SharingState:
        """Return what people share."""
        return self.sharing.state()

    @property
    def _trees(self) -> dict[int, PrimitiveTree]:
        return self.sharing.trees

    def _leaves_of(self, id: int) -> list[Key]:
        """Return the leaves of a primitive, or that one leaf, as person and id in its tree."""
        if self._still is not None:
            found = self._still[0].get(id, [])
        else:
            found = [leaf.key for leaf in self.sharing.leaves_of(id)]
        if not found:
            raise UnknownPrimitiveError(f"no primitive {id}; known are {list(self.leaves)}")
        return found

"""The tree of several people: a tree a person, and primitives that their leaves share."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager

import numpy as np

from ..errors import InvalidValueError
from ..hmm import LeftRightHMM
from ..recording import FloatArray, IntArray
from ..state import require, validated, within
from ..tree import (
    ROOT,
    Change,
    Exchange,
    KeptTree,
    MirrorMap,
    Node,
    Placement,
    PrimitiveTree,
    Recogniser,
    Repetition,
    TreeConfig,
)
from ..tree.nodes.node_table import Mark
from .config import PeopleConfig
from .editing import prune
from .people_state import PeopleState, PersonState
from .primitives import OnePersonsPrimitives, Primitives, SharedPrimitives
from .reversal import PeopleEdit
from .sharing import Sharing
from .sharing_state import SharingState


class PeopleTree:
    """Groups segments of several people; a primitive is one node, with a leaf a person below it.

    Each person has a tree as of a single person. A leaf that is born there is held against
    everybody's leaves (`matching`): it joins a primitive, or is one. A segment that is in none of
    its person's leaves, as all of a newcomer's are, can join another person's primitive. As long as
    there is one person, all is as in that person's tree.

    Args:
        config: The rules of each tree.
        n_channels: Channels of a frame, D.
        rate_hz: Frames per second [1/s].
        groups: See `PrimitiveTree`.
        people: What makes motions of different people one primitive.
        mirror: Which channel is the mirror image of which, where left and right are known.

    Attributes:
        n_seen: Segments seen, of all people.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import TreeConfig
        >>> t = np.linspace(0, 1, 50)
        >>> shapes = [(np.sin(np.pi * t), k * t * (1 - t)) for k in (-4.0, 4.0, 12.0)]
        >>> kinds = [np.stack(shape, axis=1) for shape in shapes]
        >>> rng = np.random.default_rng(0)
        >>> tree = PeopleTree(TreeConfig(), 2, 100.0)
        >>> for person in (0, 1):
        ...     for _ in range(4):
        ...         for kind in kinds:
        ...             placed = tree.insert(kind + rng.normal(0, 0.01, kind.shape), person)
        >>> tree.people, len(tree.leaves)
        ((0, 1), 3)
    """

    def __init__(
        self,
        config: TreeConfig,
        n_channels: int,
        rate_hz: float,
        groups: Sequence[int] | None = None,
        people: PeopleConfig | None = None,
        mirror: MirrorMap | None = None,
    ) -> None:
        self.config = config
        self.n_channels = n_channels
        self.rate_hz = rate_hz
        self.groups = groups
        self.people_config = people or PeopleConfig()
        self.mirror = mirror
        self.n_seen = 0
        self._trees: dict[int, PrimitiveTree] = {0: self._new_tree()}
        self._primitives: Primitives = OnePersonsPrimitives(self._trees[0], ROOT + 1)

    # ---- looking

    @property
    def people(self) -> tuple[int, ...]:
        """Numbers of the people whose motions were seen, in the order of their coming."""
        return tuple(self._trees)

    def of(self, person: int) -> PrimitiveTree:
        """Return a person's own tree, whose ids are its own.

        Raises:
            InvalidValueError: Nothing was seen of this person.
        """
        if person not in self._trees:
            raise InvalidValueError(f"no person {person}; known are {list(self._trees)}")
        return self._trees[person]

    @property
    def leaves(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""
        return self._primitives.leaves

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes, the root first: primitives, and below them a leaf for each person."""
        return self._primitives.nodes

    def still(self) -> AbstractContextManager[None]:
        """While this lasts nothing changes: much can be asked of many primitives at little cost."""
        return self._primitives.still()

    def mark(self) -> Mark | None:
        """Return this moment, for `changed_since`; None where changes are not noticed."""
        return self._primitives.mark()

    def changed_since(self, mark: Mark | None) -> dict[int, Node | None] | None:
        """Return the nodes that came, changed or went by id; None where that is not known."""
        return self._primitives.changed_since(mark)

    def node(self, id: int) -> Node:
        """Return a node.

        Raises:
            UnknownPrimitiveError: There is none of this id.
        """
        return self._primitives.node(id)

    def radius(self, id: int) -> float:
        """Return the radius of a node below the root: of a primitive, its widest leaf's."""
        return self._primitives.radius(id)

    def exemplars(self, id: int) -> tuple[FloatArray, ...]:
        """Return the kept segments of a node as they came, shape (L, D) each."""
        return self._primitives.exemplars(id)

    def model(self, id: int) -> LeftRightHMM:
        """Return a node's group model: fitted to its exemplars as they came, at their rate."""
        return self._primitives.model(id)

    @property
    def model_basis(self) -> FloatArray | None:
        """What models depend on besides their exemplars; None where each has to be asked for."""
        return self._primitives.model_basis

    def n_placed(self, id: int) -> int:
        """Return how many segments were ever placed in a node, those of all people.

        Raises:
            UnknownPrimitiveError: There is no such node.
        """
        return self._primitives.n_placed(id)

    def most_repeated(self) -> Repetition:
        """Return what comes nearest to a primitive among the segments that wait to become one."""
        found = [tree.most_repeated() for tree in self._trees.values()]
        best = max(found, key=lambda each: (each.times, -each.apart))
        return best._replace(n_unplaced=sum(each.n_unplaced for each in found))

    def unplaced(self) -> dict[int, tuple[FloatArray, LeftRightHMM]]:
        """Return the segments that are in no primitive, shape (L, D), and a model of each.

        They are what was shown once, or not yet often enough, by number; the latest are kept.
        """
        numbers, joined = self._primitives.numbers, self._primitives.joined
        found = {
            numbers[person][number] if numbers else number: segment
            for person, tree in self._trees.items()
            for number, segment in tree.unplaced().items()
        }
        return {number: found[number] for number in sorted(found) if number not in joined}

    def is_provisional(self, id: int) -> bool:
        """Return whether too few demonstrations have confirmed a primitive as yet.

        Raises:
            UnknownPrimitiveError: There is no such node.
        """
        return self.n_placed(id) < self.config.confirmed

    def nearest_others(self, person: int) -> tuple[IntArray, FloatArray]:
        """Return how far a person's own exemplars are from the nearest others of their primitive.

        Empty for a person of whom nothing was seen; of several leaves in one primitive the fullest
        counts.

        Returns:
            Ids of primitives, shape (n,), and distances as of `PrimitiveTree.nearest_others`.
        """
        if person not in self._trees:
            return np.zeros(0, np.int64), np.zeros((0, 0))
        return self._primitives.nearest_others(person)

    def recogniser(self) -> Recogniser:
        """Return what would be recognised now, whoever moves, frozen."""
        return self._primitives.recogniser()

    # ---- learning

    def insert(
        self,
        frames: FloatArray,
        person: int = 0,
        *,
        goes_on: bool = False,
        in_turn: bool = False,
    ) -> Placement:
        """Place a segment, shape (L, D), and let the trees grow.

        Args:
            frames: The segment.
            person: Who moves.
            goes_on: Whether it begins in the frame in which the person's one before it ended.
            in_turn: Whether it forms one primitive at most now, as long as there is one person; see
                `PrimitiveTree.insert`.

        Returns:
            As `PrimitiveTree.insert`, of primitives; its distance is that to the nearest of the
            person's own leaves, its ratio the smaller of that leaf's and that of the nearest of
            the other people's primitives.

        Raises:
            FrameError: The frames have another width, or hold infinite values.
        """
        if self.n_seen == 0:
            self._trees = {person: next(iter(self._trees.values()))}
        elif person not in self._trees:
            self.sharing()
            self._trees[person] = self._new_tree()
            self._require_exemplars()
        in_turn = in_turn and self._primitives.in_turn
        placement = self._trees[person].insert(frames, goes_on=goes_on, in_turn=in_turn)
        if placement.refused:
            return placement
        self.n_seen += 1
        return self._primitives.follow(person, placement, frames)

    @property
    def to_form(self) -> int:
        """Primitives that the latest segment may form yet, at most."""
        return self._primitives.to_form

    def form_next(self) -> Change:
        """Form one more of them; see `PrimitiveTree.form_next`."""
        return self._primitives.form_next()

    def pass_time(self) -> None:
        """Let a frame pass; see `PrimitiveTree.pass_time`."""
        for tree in self._trees.values():
            tree.pass_time()

    # ---- learning by hand

    def split(self, id: int, groups: Sequence[Sequence[int]] | None = None) -> Change:
        """Split a primitive, which the rules never merge again.

        Each person's leaf goes to one side, or is split itself where its exemplars do.

        Args:
            id: The primitive.
            groups: Positions in `exemplars` that belong together, every one in one group, at least
                2 of each leaf; the two main branches of complete-link clustering where not given,
                of the leaves if there are several.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
            InvalidValueError: The groups are wrong, or there are too few exemplars.
        """
        return self._primitives.split(id, groups)

    def merge(self, first: int, second: int) -> Change:
        """Merge two primitives into the older one, which the rules never split again.

        A person who has a leaf in both keeps one, as by `PrimitiveTree.merge`.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
            InvalidValueError: They are the same.
        """
        return self._primitives.merge(first, second)

    def reparent(self, id: int, parent: int) -> Change:
        """Hang a node below the root or another inner node; a person's leaf below a primitive.

        A leaf below the root or an inner node is a primitive of its own. Where it was taken from
        and where it was put, the rules leave it alone.

        Raises:
            UnknownPrimitiveError: There is no such node.
            InvalidValueError: The parent lies below the node, or cannot be above it.
        """
        return self._primitives.reparent(id, parent)

    def remove(self, id: int, *, forget: bool = False) -> Change:
        """Take a primitive out, or a person's leaf of it; see `PrimitiveTree.remove`.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
        """
        return self._primitives.remove(id, forget=forget)

    def keep(self, id: int) -> Change:
        """Let the rules neither forget nor drop a primitive; see `PrimitiveTree.keep`.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
        """
        return self._primitives.keep(id)

    def freeze(self, id: int, frozen: bool = True) -> Change:
        """Let a primitive stay as it is, whatever comes; see `PrimitiveTree.freeze`.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
        """
        return self._primitives.freeze(id, frozen)

    def exchange(self, edit: PeopleEdit) -> Exchange:
        """Put an edit's nodes of after in the place of those of before, whatever came since.

        So it is done again, and undone with ``edit.reversed()``; see `mplearn.tree.reversal`.
        """
        known = self._trees
        found = {each.person: known[each.person].exchange(each.nodes) for each in edit.trees}
        return self._primitives.exchange(edit, found)

    # ---- being merged, see `mplearn.merging`

    def sharing(self) -> Sharing:
        """Return what people share; where there is one person, as if others were to come."""
        primitives = self._primitives
        if not isinstance(primitives, SharedPrimitives):
            while primitives.to_form:
                primitives.form_next()
            rules = self.config, self.people_config
            sharing = Sharing(*rules, self._trees, primitives.next_id, self.mirror)
            self._primitives = primitives = SharedPrimitives(sharing)
            self._require_exemplars()
        return primitives.sharing

    def wake(self) -> None:
        """Let trees that were loaded lazily make their models now."""
        for tree in self._trees.values():
            if isinstance(tree, KeptTree):
                tree.wake()

    def prune(self) -> Change:
        """Let primitives wait again that have fewer members than several people need.

        They were born while each person was alone. Where there is one person, nothing changes.
        """
        primitives = self._primitives
        if not isinstance(primitives, SharedPrimitives) or len(self._trees) == 1:
            return Change()
        return prune(primitives.sharing)

    def adopt(self, trees: dict[int, PrimitiveTree], n_seen: int) -> None:
        """Go on with other trees, by person, that have seen so many segments."""
        self._trees, self.n_seen = trees, n_seen
        if isinstance(self._primitives, SharedPrimitives):
            self._primitives.sharing.trees = trees
            self._require_exemplars()
        else:
            tree = next(iter(trees.values()))
            next_id = 1 + max(node.id for node in tree.nodes)
            self._primitives = OnePersonsPrimitives(tree, next_id)

    def copy(self) -> PeopleTree:
        """Return a tree that knows the same, and goes on apart; exemplars are shared."""
        rules = self.config, self.n_channels, self.rate_hz, self.groups
        twin = PeopleTree(*rules, self.people_config, self.mirror)
        twin.load_state(self.state(), lazily=True)
        return twin

    # ---- keeping

    def state(self) -> PeopleState:
        """Return all that is known: `load_state` resumes bit for bit."""
        return PeopleState(
            n_seen=self.n_seen,
            next_id=self._primitives.next_id,
            trees=tuple(PersonState(person, tree.state()) for person, tree in self._trees.items()),
            sharing=self._primitives.state(),
        )

    def load_state(self, state: PeopleState, *, lazily: bool = False) -> None:
        """Resume from what `state` returned, under the same configuration.

        Args:
            state: That.
            lazily: Whether people's trees make their models only once they are asked for.

        Raises:
            StateError: Something in it is wrong, or does not fit this tree; nothing has changed.
        """
        state = validated(state)
        if state.sharing is not None:
            with within("sharing"):
                self._check_widths(state.sharing)
        trees: dict[int, PrimitiveTree] = {}
        for k, each in enumerate(state.trees):
            trees[each.person] = self._new_tree(KeptTree if lazily else PrimitiveTree)
            with within(f"trees[{k}].tree"):
                trees[each.person].load_state(each.tree)
        self.n_seen, self._trees = state.n_seen, trees
        if state.sharing is None:
            only = next(iter(trees.values()))
            self._primitives = OnePersonsPrimitives(only, state.next_id)
            return
        sharing = Sharing(self.config, self.people_config, {}, state.next_id, self.mirror)
        sharing.trees = trees
        sharing.load_state(state.sharing)
        self._primitives = SharedPrimitives(sharing)
        self._require_exemplars()

    def _check_widths(self, state: SharingState) -> None:
        """Check that shapes are such as this tree takes."""
        posture, movement = self.n_channels, self.n_channels * self.config.normalisation.n_points
        for k, leaf in enumerate(state.leaves):
            fits = (len(leaf.shape.posture), len(leaf.shape.movement)) == (posture, movement)
            require(fits, f"leaves[{k}].shape", f"must have shapes ({posture},) and ({movement},)")
        for k, each in enumerate(state.provisional):
            fits = (each.postures.shape[1], each.movements.shape[1]) == (posture, movement)
            require(
                fits, f"provisional[{k}].postures", f"must be {posture} wide, movements {movement}"
            )
        for k, offset in enumerate(state.offsets):
            require(
                len(offset.offset) == posture, f"offsets[{k}].offset", f"must be {posture} wide"
            )

    # ---- inside

    def _new_tree(self, kind: type[PrimitiveTree] = PrimitiveTree) -> PrimitiveTree:
        return kind(self.config, self.n_channels, self.rate_hz, self.groups)

    def _require_exemplars(self) -> None:
        """Let births be as rare as several people need them to be."""
        for tree in self._trees.values():
            tree.require_exemplars(self.people_config.min_exemplars)

"""The incremental tree of motion primitives [Kulic2012, 2.2, figure 2]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from ..errors import InvalidValueError, UnknownPrimitiveError
from ..hmm import LeftRightHMM
from ..hmm.sequences import as_frames
from ..recording import FloatArray, IntArray
from ..state import (
    Array,
    Blob,
    Count,
    Range,
    State,
    require,
    require_no_cycle,
    validated,
)
from .config import TreeConfig
from .editing import chosen_groups, leaf_of, pair_of, place_below, primitive_of
from .exemplars.bank import ExemplarBank
from .exemplars.memory import SegmentMemory
from .exemplars.neighbours import N_STEPS
from .exemplars.renewal import RenewalState
from .exemplars.spread import SampleState, SpreadState
from .models import GroupModels, Model
from .nodes.node import Node, NodeState
from .nodes.node_table import Mark, NodeTable
from .nodes.structure import Structure
from .placement import ROOT, Change, Placement
from .recogniser import Recogniser, refusal
from .repetitions import Repetition, most_repeated
from .reversal import Exchange, NodesEdit, exchange
from .rules import (
    drop_fragments,
    forget_chances,
    form_primitives,
    merge_duplicates,
    settle_fragments,
    shed_outliers,
    split_mixed,
)

_SHORTEST_S = 0.1
_LONGEST_S = 60.0
_LIKENESS = 1.1  # largest distance over the tree's scale at which two segments may show one motion


@dataclass(frozen=True, eq=False)
class TreeState(State):
    """A tree: what was ever seen, in sums, and the nodes with their exemplars.

    Attributes:
        n_seen: Segments ever seen.
        next_id: Id of the node that is formed next.
        floor: Smallest variance of each channel in the models of exemplars, shape (D,).
        spread: How much all motion varies.
        sample: Some of all segments.
        nodes: The nodes, the root first.
        renewal: Models on their way that will take the place of these; None for none.
        neighbours: See `exemplars.neighbours`; zeros in what was kept before there were any.
        follows: Numbers of the latest segments that began where the one before them ended, rising.
        to_form: Primitives that the latest segment may form yet, at most.
    """

    n_seen: Count
    next_id: Annotated[int, Range(1)]
    floor: Annotated[FloatArray, Array("d", low=1e-30)]
    spread: SpreadState
    sample: SampleState
    nodes: tuple[NodeState, ...]
    renewal: RenewalState | None = None
    neighbours: Annotated[FloatArray, Array(N_STEPS + 1, low=0.0)] = field(
        default_factory=lambda: np.zeros(N_STEPS + 1)
    )
    follows: Annotated[IntArray, Array(None, low=1)] = field(
        default_factory=lambda: np.zeros(0, np.int64)
    )
    to_form: Count = 0

    def check(self) -> None:
        """Check that the nodes make one tree, and that equal numbers are the same segment."""
        width = len(self.floor)
        require(len(self.spread.count) == width, "spread.count", f"must have shape ({width},)")
        growing = bool((np.diff(self.neighbours) >= 0).all())
        require(growing, "neighbours", "must not fall with the distance")
        rising = bool((np.diff(self.follows, append=self.n_seen) > 0).all())
        require(rising, "follows", f"must rise, and be below {self.n_seen}")
        _check_nodes(self.nodes, self.next_id)
        frames: dict[int, Blob] = {}
        parts: dict[str, NodeState | SampleState] = {"sample": self.sample}
        parts |= {f"nodes[{k}]": node for k, node in enumerate(self.nodes)}
        for place, part in parts.items():
            numbers = part.members if isinstance(part, NodeState) else part.numbers
            name = "members" if isinstance(part, NodeState) else "numbers"
            for i, (number, blob) in enumerate(zip(numbers.tolist(), part.frames, strict=True)):
                require(number < self.n_seen, f"{place}.{name}", f"{number} was never seen")
                same = frames.setdefault(number, blob)
                require(
                    same.array is blob.array
                    or np.array_equal(same.array, blob.array, equal_nan=True),
                    f"{place}.frames[{i}]",
                    f"must be those of segment {number} elsewhere",
                )


def _check_nodes(nodes: Sequence[NodeState], next_id: int) -> None:
    """Check that nodes make one tree below the root, each primitive with an exemplar."""
    known = {node.id: node for node in nodes}
    require(len(known) == len(nodes), "nodes", "must have different ids")
    require(
        bool(nodes) and nodes[0].id == ROOT and nodes[0].parent is None,
        "nodes[0]",
        f"must be the root, {ROOT}, below nothing",
    )
    for k, node in enumerate(nodes):
        place = f"nodes[{k}]"
        require(node.id < next_id, f"{place}.id", f"must be below next_id, {next_id}")
        for child in node.children:
            below = known.get(child)
            require(
                below is not None and below.parent == node.id,
                f"{place}.children",
                f"{child} does not lie below {node.id}",
            )
        for id in node.apart:
            require(0 < id < next_id, f"{place}.apart", f"there never was a node {id}")
        if k == 0:
            continue
        above = None if node.parent is None else known.get(node.parent)
        require(
            above is not None and node.id in above.children,
            f"{place}.parent",
            f"must be the node that {node.id} is a child of, not {node.parent}",
        )
        if not node.children:
            require(len(node.members) > 0, f"{place}.members", "must hold a number")
            require(node.n_placed > 0, f"{place}.n_placed", "must be at least 1")
            require(node.n_frames > 0, f"{place}.n_frames", "must be at least 1")
    places = {node.id: k for k, node in enumerate(nodes)}
    require_no_cycle(
        {node.id: node.parent for node in nodes}, lambda id: f"nodes[{places[id]}].parent"
    )


class PrimitiveTree:
    """Groups segments by similarity as they come; its leaves are the motion primitives.

    Every decision is deterministic. A leaf keeps its id for life. `insert` follows the rules; a
    person can `split`, `merge`, `reparent` and `remove` by hand, which the rules then respect.

    Args:
        config: The rules.
        n_channels: Channels of a frame, D.
        rate_hz: Frames per second [1/s].
        groups: A group number for each channel, 0, 1, ...; channels of a group share one variance,
            so they should share a unit. By default all do.

    Attributes:
        n_seen: Segments ever seen.
        to_form: Primitives that the latest segment may form yet, at most; see `form_next`.

    Raises:
        InvalidValueError: A value is out of range.

    Example:
        >>> import numpy as np
        >>> t = np.linspace(0, 1, 50)
        >>> shapes = [(np.sin(np.pi * t), k * t * (1 - t)) for k in (-4.0, 4.0, 12.0)]
        >>> kinds = [np.stack(shape, axis=1) for shape in shapes]
        >>> rng = np.random.default_rng(0)
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> for _ in range(4):
        ...     for kind in kinds:
        ...         placement = tree.insert(kind + rng.normal(0, 0.01, kind.shape))
        >>> len(tree.leaves), placement.recognised
        (3, True)
        >>> tree.recogniser().recognise(kinds[0]).primitive == tree.leaves[0]
        True
    """

    def __init__(
        self,
        config: TreeConfig,
        n_channels: int,
        rate_hz: float,
        groups: Sequence[int] | None = None,
    ) -> None:
        if n_channels < 1 or not (np.isfinite(rate_hz) and rate_hz > 0):
            raise InvalidValueError(
                f"n_channels >= 1 and rate_hz > 0 are needed, not {n_channels} and {rate_hz}"
            )
        numbers = np.zeros(n_channels, np.int64) if groups is None else np.array(groups, np.int64)
        if numbers.shape != (n_channels,) or numbers.min() < 0:
            raise InvalidValueError(f"groups must be {n_channels} numbers >= 0, not {groups}")
        self.config = config
        self.n_channels = n_channels
        self.rate_hz = rate_hz
        self.groups = tuple(int(group) for group in numbers)
        self.n_seen = 0
        self.to_form = 0
        self._memory = SegmentMemory(config, numbers)
        self._structure = Structure(config, self._memory)
        self._models = GroupModels(config, self._structure)
        self._time_passes = False
        self._ready_for = -1  # segment that all was done for that can be done before

    # ---- looking

    @property
    def leaves(self) -> tuple[int, ...]:
        """Ids of the primitives, in the order of their birth."""
        return self._structure.index.leaf_ids

    @property
    def members(self) -> list[list[int]]:
        """Numbers of the exemplars of each of the `leaves`; other ones are another list."""
        index = self._structure.index
        return [group for group, leaf in zip(index.members, index.leaves, strict=True) if leaf]

    def nearest_others(self) -> FloatArray:
        """Return how far each exemplar of each of the `leaves` is from the nearest others of it.

        Returns:
            The mean to the ``n_nearest`` of the rules, on their scale, shape (n, K); NaN where a
            leaf holds fewer exemplars, or only one.
        """
        return self._structure.index.nearest_others()

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes, the root first, in the order of their birth."""
        return tuple(self._structure.nodes.values())

    def mark(self) -> Mark:
        """Return this moment, for `changed_since`."""
        return self._structure.nodes.mark()

    def changed_since(self, mark: Mark | None) -> dict[int, Node | None] | None:
        """Return the nodes that came, changed or went by id; None where that is not known."""
        return self._structure.nodes.changed_since(mark)

    def node(self, id: int) -> Node:
        """Return a node.

        Raises:
            UnknownPrimitiveError: There is none of this id.
        """
        nodes = self._structure.nodes
        if id not in nodes:
            raise UnknownPrimitiveError(f"no node {id} in the tree; it holds {list(nodes)}")
        return nodes[id]

    def radius(self, id: int) -> float:
        """Return the radius of a node below the root, on the scale of the rules.

        Example:
            >>> import numpy as np
            >>> from mplearn.tree import PrimitiveTree, TreeConfig
            >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
            >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
            >>> placed = [tree.insert(k * lift) for k in (1.0, -1.0, 1.01, -1.01, 0.99, 0.98)]
            >>> nearest = tree.insert(lift)
            >>> nearest.distance <= tree.radius(nearest.node_id)
            True
        """
        self.node(id)
        index = self._structure.index
        if id not in index.ids:
            raise UnknownPrimitiveError(
                f"node {id} is not searched and has no radius; {index.ids.tolist()} have one"
            )
        return index.radius(id)

    def exemplars(self, id: int) -> tuple[FloatArray, ...]:
        """Return the kept segments of a node as they came, shape (L, D) each.

        Example:
            >>> import numpy as np
            >>> from mplearn.tree import PrimitiveTree, TreeConfig
            >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
            >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
            >>> placed = [tree.insert(k * lift) for k in (1.0, -1.0, 1.01, -1.01, 0.99, 0.98)]
            >>> [each.shape[1] for each in tree.exemplars(tree.leaves[0])]
            [2, 2, 2, 2]
        """
        return tuple(self._memory.frames[number] for number in self.node(id).members)

    def model(self, id: int) -> LeftRightHMM:
        """Return a node's group model: fitted to its exemplars as they came, at their rate.

        It has fewer states than configured where an exemplar is shorter than those; where the
        motion has more chains than one, it goes through the combinations that they visit, and where
        it has explicit durations, through its states in their mean times: see `motion_model`.

        Raises:
            UnknownPrimitiveError: There is none of this id.

        Example:
            >>> import numpy as np
            >>> from mplearn.tree import PrimitiveTree, TreeConfig
            >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
            >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
            >>> placed = [tree.insert(k * lift) for k in (1.0, -1.0, 1.01, -1.01, 0.99, 0.98)]
            >>> tree.model(tree.leaves[0]).n_states
            8
        """
        model = self.motion_model(id)
        return model if isinstance(model, LeftRightHMM) else model.left_right()

    def motion_model(self, id: int) -> Model:
        """Return a node's group model with all that it has.

        There are more chains than one where ``max_chains`` allows it and a primitive cannot be told
        apart from its neighbour by one [Kulic2008b]; with ``durations="explicit"`` it is a hidden
        semi-Markov model.

        Raises:
            UnknownPrimitiveError: There is none of this id.
        """
        self.node(id)
        return self._models.of(id)

    @property
    def model_basis(self) -> FloatArray | None:
        """What models depend on besides their exemplars: one object as long as that is the same.

        None where it is other nodes, too: then each model has to be asked for.
        """
        return self._models.basis

    @property
    def bank(self) -> ExemplarBank:
        """Models of the segments that the tree remembers, by number; only the tree changes it."""
        return self._memory.bank

    @property
    def limit(self) -> float:
        """Largest radius of a primitive, on the scale of the rules."""
        return self._structure.index.limit

    def recogniser(self) -> Recogniser:
        """Return what the tree would recognise now, frozen; at the stated rate, if there is one."""
        index, bank = self._structure.index.fork(), self._memory.bank.fork()
        frozen = Recogniser(self.config, bank, index, self.shortest_frames)
        return frozen.calibrated(self.config.false_acceptance)

    def most_repeated(self) -> Repetition:
        """Return what comes nearest to a primitive among the segments that wait to become one."""
        root = self._structure.root
        waits = [i for i, number in enumerate(root.members) if number not in root.settled]
        return most_repeated(root.matrix[np.ix_(waits, waits)], self._memory.scale())

    def unplaced(self) -> dict[int, tuple[FloatArray, LeftRightHMM]]:
        """Return the segments that wait to become part of a primitive, and a model of each.

        Returns:
            The segment as it came, shape (L, D), and the model of it alone, by its number.
        """
        root, frames = self._structure.root, self._memory.frames
        waiting = [number for number in root.members if number not in root.settled]
        return {number: (frames[number], self._models.of_segment(number)) for number in waiting}

    def is_provisional(self, id: int) -> bool:
        """Return whether too few demonstrations have confirmed a primitive as yet.

        Raises:
            UnknownPrimitiveError: There is no such node.
        """
        return self.node(id).n_placed < self.config.confirmed

    def require_exemplars(self, least: int) -> None:
        """Let clusters become nodes from so many members on, if that is more than by the rules."""
        self._structure.least = max(self.config.min_exemplars, least)

    # ---- learning

    def insert(
        self, frames: FloatArray, *, goes_on: bool = False, in_turn: bool = False
    ) -> Placement:
        """Place a segment, shape (L, D), and let the tree grow.

        A segment that is too short or too long for a motion, or lacks a channel for most of the
        time, is refused: it changes nothing.

        Args:
            frames: The segment.
            goes_on: Whether it begins in the frame in which the one before it ended.
            in_turn: Whether it forms one primitive at most now; `form_next` forms the others, as
                the next segment does that comes before that.

        Raises:
            FrameError: The frames have another width, or hold infinite values.
        """
        frames = as_frames(frames, self.n_channels)
        longest = round(_LONGEST_S * self.rate_hz)
        reason = refusal(frames, self.shortest_frames, longest)
        if reason:
            return Placement(-1, ROOT, False, np.inf, np.inf, refused=reason)
        late = Change()
        while self.to_form:
            late = late.then(self.form_next())
        structure, bank, number = self._structure, self._memory.bank, self.n_seen
        self.n_seen += 1
        self._memory.remember(number, frames.copy(), follows=goes_on and number > 0)
        matches, distances = structure.index.look(bank[number], bank)
        distance, ratio = (matches[0].distance, matches[0].ratio) if matches else (np.inf, np.inf)
        node = self.node(matches[0].node if ratio <= 1 else ROOT)
        recognised = node.id != ROOT and node.is_leaf
        structure.add(node, number)
        if self.config.ignore_fragments:
            settle_fragments(structure, number, longest)
        waiting = node.matrix[-1, :-1] if node.id == ROOT else np.zeros(0)
        self._memory.meet(np.concatenate([distances, waiting]))
        like = self._waiting_like(node)
        in_turn = in_turn and not self.config.local and np.isfinite(self.config.max_born)
        most = 1 if in_turn else self.config.max_born
        formed = Change()
        if node.id == ROOT or self.config.local:
            change = formed = form_primitives(structure, node, self.n_seen, most)
            recognised = recognised and (node.is_leaf or number in dict(change.moved))
        else:
            change = formed = shed_outliers(structure, node, self.n_seen, most)
            recognised = recognised and (number, ROOT) not in change.moved
            if not change.moved:
                change = split_mixed(structure, node, self.n_seen)
            if not change.moved:
                change = merge_duplicates(structure, matches, self.n_seen)
            if not change.moved and self._bore_lately():
                in_turn = in_turn and not change.merges  # who waits knows what is there
                most = most if in_turn else self.config.max_born
                formed = form_primitives(structure, structure.root, self.n_seen, most)
                change = change.then(formed)
        if self.config.drop_fragments and change == Change():
            change = formed = drop_fragments(structure, number, longest, self.n_seen, most)
        if in_turn and formed.born:
            self.to_form = int(self.config.max_born) - 1
        if not self.to_form:
            change = change.then(forget_chances(structure, self.n_seen))
        change = late.then(change)
        self._memory.release(number)
        self._renew()
        structure.tune()
        self._models.forget()
        nearest = matches[0].node if matches else None
        placement = Placement(
            number, node.id, recognised, distance, ratio, nearest=nearest, like=like
        )
        return placement.then(change)

    def form_next(self) -> Change:
        """Form one more of the primitives that the latest segment may form yet, if there is one.

        Once all are formed the tree is as if `insert` had formed them at once.

        Example:
            >>> import numpy as np
            >>> from mplearn.tree import PrimitiveTree, TreeConfig
            >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
            >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
            >>> sizes = (1.0, -1.0, 1.01, -1.01, 0.99, -0.99)
            >>> born = [tree.insert(k * lift, in_turn=True).born for k in sizes]
            >>> while tree.to_form:
            ...     change = tree.form_next()
            >>> tree.form_next() == Change()  # nothing is left
            True
        """
        if not self.to_form:
            return Change()
        change = form_primitives(self._structure, self._structure.root, self.n_seen, 1)
        self.to_form = self.to_form - 1 if change.born else 0
        if not self.to_form:
            change = change.then(forget_chances(self._structure, self.n_seen))
        return self._edited(change)

    def pass_time(self) -> None:
        """Let a frame pass: what takes long is done a little at a time by those who call this.

        Where nobody does, `insert` does it at once.
        """
        self._time_passes = True
        if self._ready_for != self.n_seen:
            self._memory.prepare(self.n_seen)
            self._ready_for = self.n_seen
        if self._memory.renewal is not None:
            matrices = self._memory.get_on(self._structure.groups)
            if matrices is not None:
                self._structure.remeasured(matrices)

    def _renew(self) -> None:
        """Begin to model all segments again where the variance of all motion has changed much."""
        memory, structure = self._memory, self._structure
        if memory.renewal is None:
            floor = memory.updated_floor()
            if floor is None:
                return
            memory.renew(floor, structure.groups)
        if not self._time_passes:
            structure.remeasured(memory.get_done(structure.groups))

    def place_unplaced(self) -> Change:
        """Place what waits in the root where it fits by now, or in primitives of its own."""
        structure, bank = self._structure, self.bank
        found = [(n, structure.index.search(bank[n], bank)[:1]) for n in structure.root.members]
        change = Change()
        for number, best in found:  # all are compared first: their order must not matter
            if best and best[0].ratio <= 1 and best[0].node in self.leaves:
                leaf = structure.nodes[best[0].node]
                change = change.then(structure.take_in(leaf, [number]))
        while not self.config.local:
            formed = form_primitives(structure, structure.root, self.n_seen, self.config.max_born)
            change = change.then(formed)
            if not formed.born:
                break
        return self._edited(change)

    def remeasure(self) -> None:
        """Measure all distances among segments again."""
        if self._memory.renewal is not None:
            self._structure.remeasured(self._memory.get_done(self._structure.groups))
        self._memory.measure()
        self._structure.remeasure()
        self._models.forget()

    # ---- learning by hand

    def split(self, id: int, groups: Sequence[Sequence[int]] | None = None) -> Change:
        """Split a primitive, which the rules never merge again.

        Args:
            id: The primitive.
            groups: Positions in `exemplars` that belong together, at least 2 each and every one in
                one group; the two main branches of complete-link clustering where not given.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
            InvalidValueError: The groups are wrong, or there are too few exemplars.

        Example:
            >>> import numpy as np
            >>> from mplearn.tree import PrimitiveTree, TreeConfig
            >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
            >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
            >>> placed = [tree.insert(k * lift) for k in (1.0, -1.0, 1.01, -1.01, 0.99, 0.98)]
            >>> change = tree.split(tree.leaves[0], [(0, 1), (2, 3)])
            >>> len(tree.leaves), len(change.splits[0].into)
            (3, 2)
        """
        leaf = leaf_of(self._structure, id)
        numbers = chosen_groups(leaf, groups)
        change = self._structure.split(leaf, numbers, self.n_seen)
        for born in change.born:
            self.node(born).apart = frozenset(change.born) - {born}
        return self._edited(change)

    def merge(self, first: int, second: int) -> Change:
        """Merge two primitives into the older one, which the rules never split again.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
            InvalidValueError: They are the same.
        """
        older, younger = pair_of(self._structure, first, second)
        joint = self._structure.joint(older, younger)
        change = self._structure.merge(older, younger, joint, self.n_seen)
        older.whole = True
        older.apart -= {older.id}
        return self._edited(change)

    def reparent(self, id: int, parent: int) -> Change:
        """Hang a node below the root or another inner node.

        Raises:
            UnknownPrimitiveError: There is no such node.
            InvalidValueError: The parent is a primitive, or lies below the node.
        """
        node, above = place_below(self._structure, id, parent)
        return self._edited(self._structure.reparent(node, above, self.n_seen))

    def remove(self, id: int, *, forget: bool = False) -> Change:
        """Take a primitive out; its exemplars wait to be placed again, unless they are forgotten.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
        """
        leaf = leaf_of(self._structure, id)
        return self._edited(self._structure.remove(leaf, self.n_seen, forget=forget))

    def keep(self, id: int) -> Change:
        """Let the rules neither forget nor drop a primitive: a person says that it is a motion.

        It goes on learning, and is split or merged as before.

        Raises:
            UnknownPrimitiveError: There is no such primitive.

        Example:
            >>> import numpy as np
            >>> from mplearn.tree import PrimitiveTree, TreeConfig
            >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
            >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
            >>> placed = [tree.insert(k * lift) for k in (1.0, -1.0, 1.01, -1.01)]
            >>> change = tree.keep(tree.leaves[0])
            >>> tree.node(tree.leaves[0]).by_hand
            True
        """
        leaf = primitive_of(self._structure, id)
        if not leaf.by_hand:
            leaf.history += (("kept", self.n_seen),)
        return Change()

    def freeze(self, id: int, frozen: bool = True) -> Change:
        """Let a primitive stay as it is, whatever comes, or let it change again.

        What is like it is recognised, and not learned; no rule and no hand changes it.

        Raises:
            UnknownPrimitiveError: There is no such primitive.

        Example:
            >>> import numpy as np
            >>> from mplearn.tree import PrimitiveTree, TreeConfig
            >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
            >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
            >>> placed = [tree.insert(k * lift) for k in (1.0, -1.0, 1.01, -1.01, 0.99, 0.98)]
            >>> change = tree.freeze(tree.leaves[0])
            >>> placed = tree.insert(1.02 * lift)
            >>> placed.node_id == tree.leaves[0], len(tree.exemplars(tree.leaves[0]))
            (True, 4)
        """
        primitive_of(self._structure, id).frozen = frozen
        return Change()

    def exchange(self, edit: NodesEdit) -> Exchange:
        """Put an edit's nodes of after in the place of those of before, whatever came since.

        So it is done again, and undone with ``edit.reversed()``; see `mplearn.tree.reversal`.
        """
        found = exchange(self._structure, edit, self.n_seen)
        self._models.forget()
        return found

    def _edited(self, change: Change) -> Change:
        self._structure.tune()
        self._models.forget()
        return change

    # ---- keeping

    def state(self) -> TreeState:
        """Return all that the tree knows: `load_state` resumes bit for bit."""
        memory = self._memory
        return TreeState(
            n_seen=self.n_seen,
            next_id=self._structure.next_id,
            floor=memory.bank.floor.copy(),
            spread=memory.spread(),
            sample=memory.sample(),
            nodes=self._structure.nodes.states(memory.blob),
            renewal=memory.renewal_state(),
            neighbours=memory.neighbours.counts.copy(),
            follows=np.array(self._memory.follows, np.int64),
            to_form=self.to_form,
        )

    def load_state(self, state: TreeState) -> None:
        """Resume from what `state` returned, under the same configuration.

        Raises:
            StateError: Something in it is wrong, or does not fit this tree; nothing has changed.
        """
        state = validated(state)
        self._check_fits(state)
        self._resume(state)

    def _resume(self, state: TreeState) -> None:
        """Resume from a state that was checked."""
        memory = SegmentMemory(self.config, np.array(self.groups, np.int64))
        memory.load(
            state.floor,
            state.spread,
            state.sample,
            [each for node in state.nodes for each in node.exemplars()],
        )
        memory.neighbours.counts = state.neighbours.copy()
        memory.follows = state.follows.tolist()
        self.n_seen, self.to_form = state.n_seen, state.to_form
        self._memory = memory
        self._structure = Structure(self.config, memory)
        self._structure.next_id = state.next_id
        nodes = sorted(state.nodes, key=lambda node: node.id)
        self._structure.nodes = NodeTable(map(Node.from_state, nodes))
        self._structure.reindex()
        self._structure.tune()
        if state.renewal is not None:
            memory.load_renewal(state.renewal, self._structure.groups)
        self._models = GroupModels(self.config, self._structure)

    def _check_fits(self, state: TreeState) -> None:
        """Check that segments are such as this tree takes up."""
        width, longest = self.n_channels, round(_LONGEST_S * self.rate_hz)
        floors = {"floor": state.floor}
        if state.renewal is not None:
            floors["renewal.floor"] = state.renewal.floor
        for place, floor in floors.items():
            require(len(floor) == width, place, f"must have shape ({width},)")
        born = self.config.max_born
        require(state.to_form < born, "to_form", f"must be below {born}, not {state.to_form}")
        most = self.config.max_exemplars
        for k, node in enumerate(state.nodes[1:], start=1):
            n_members = len(node.members)
            require(
                n_members <= most, f"nodes[{k}].members", f"must be at most {most}, not {n_members}"
            )
        parts = {"sample": state.sample.frames}
        parts |= {f"nodes[{k}]": node.frames for k, node in enumerate(state.nodes)}
        for place, segments in parts.items():
            for i, blob in enumerate(segments):
                reason = (
                    refusal(blob.array, self.shortest_frames, longest)
                    if blob.array.shape[1] == width
                    else f"must have {width} channels, not {blob.array.shape[1]}"
                )
                require(not reason, f"{place}.frames[{i}]", reason)

    def _bore_lately(self) -> bool:
        """Return whether a node was formed with the segment before: there may be more to form."""
        newest = next(reversed(self._structure.nodes.values()))
        return np.isfinite(self.config.max_born) and newest.born_at == self.n_seen - 1

    def _waiting_like(self, node: Node) -> int | None:
        """Return what the newest segment of the root is most like among those before it."""
        if node.id != ROOT or len(node.members) < 2:
            return None
        row = node.matrix[-1, :-1]
        nearest = int(row.argmin())
        alike = row[nearest] <= _LIKENESS * self._memory.scale()
        return node.members[nearest] if alike else None

    @property
    def shortest_frames(self) -> int:
        """Fewest frames of a segment that is taken up."""
        return max(2, round(_SHORTEST_S * self.rate_hz))

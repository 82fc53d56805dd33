"""What a person did to a learner is undone, and what was learned since stays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np

from ..graph import GraphEdit, GraphState
from ..people import PeopleEdit, PeopleState
from ..recording import IntArray
from ..state import Array, State
from .chain import ChainState
from .snapshot import FrozenState


class Known(NamedTuple):
    """What a learner knows of motions at one moment.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> learner = MotionLearner(LearnerConfig(("elbow",)))
        >>> known = learner.known()
        >>> len(known.people.trees), known.graph.ids.array.tolist()
        (1, [])
    """

    people: PeopleState
    graph: GraphState
    chain: ChainState
    frozen: tuple[FrozenState, ...]


@dataclass(frozen=True, eq=False)
class SegmentsEdit(State):
    """Segments of which an edit changed something, shape (n,) each; -1 stands for no primitive.

    Attributes:
        number: The segments.
        before: What it was.
        after: What it was then.
    """

    number: Annotated[IntArray, Array("n", low=0)]
    before: Annotated[IntArray, Array("n", low=-1)]
    after: Annotated[IntArray, Array("n", low=-1)]

    @classmethod
    def between(
        cls, before: ChainState, after: ChainState, what: Literal["primitive", "nearest"]
    ) -> SegmentsEdit:
        """Return what differs between a chain of one moment and another, in one respect."""
        old, new = (
            {
                number: primitive
                for block in state.segments
                for number, primitive in zip(
                    block.number.tolist(), getattr(block, what).tolist(), strict=True
                )
            }
            for state in (before, after)
        )
        rows = [(n, old[n], id) for n, id in new.items() if n in old and old[n] != id]
        columns = np.array(rows, np.int64).reshape(len(rows), 3)
        return cls(*(np.ascontiguousarray(columns[:, k]) for k in range(3)))

    def reversed(self) -> SegmentsEdit:
        """Return the edit that undoes this one."""
        return SegmentsEdit(self.number, self.after, self.before)

    def by_number(self) -> dict[int, tuple[int, int]]:
        """Return what was before and after, by the number of the segment."""
        pairs = zip(self.before.tolist(), self.after.tolist(), strict=True)
        return dict(zip(self.number.tolist(), pairs, strict=True))


@dataclass(frozen=True, eq=False)
class LearnerEdit(State):
    """What an edit changed: in the trees, in the graph, and in what segments are.

    `MotionLearner.undo` undoes it; it can do so long after, when much was learned since.

    Attributes:
        people: In the trees.
        graph: In the graph.
        segments: In what segments are.
        frozen_before: Frozen primitives that were others then, or none.
        frozen_after: What they were then.
        nearest: In what segments were nearest to; None where that was not noted.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
        >>> events = learner.learn_many(swing)
        >>> before = learner.known()
        >>> change = learner.remove(2)
        >>> edit = LearnerEdit.between(before, learner.known())
        >>> undone = learner.undo(edit)
        >>> undone.back, learner.snapshot().names
        ((2,), ('P1', 'P2'))
    """

    people: PeopleEdit
    graph: GraphEdit
    segments: SegmentsEdit
    frozen_before: tuple[FrozenState, ...]
    frozen_after: tuple[FrozenState, ...]
    nearest: SegmentsEdit | None = None

    @classmethod
    def between(cls, before: Known, after: Known) -> LearnerEdit:
        """Return what differs between what is known at one moment and another."""
        return cls(
            PeopleEdit.between(before.people, after.people),
            GraphEdit.between(before.graph, after.graph),
            SegmentsEdit.between(before.chain, after.chain, "primitive"),
            tuple(each for each in before.frozen if each not in after.frozen),
            tuple(each for each in after.frozen if each not in before.frozen),
            SegmentsEdit.between(before.chain, after.chain, "nearest"),
        )

    def reversed(self) -> LearnerEdit:
        """Return the edit that undoes this one."""
        return LearnerEdit(
            self.people.reversed(),
            self.graph.reversed(),
            self.segments.reversed(),
            self.frozen_after,
            self.frozen_before,
            None if self.nearest is None else self.nearest.reversed(),
        )

    @property
    def primitives(self) -> set[int]:
        """Ids of the primitives that it is about."""
        frozen = {each.primitive.id for each in (*self.frozen_before, *self.frozen_after)}
        return self.people.primitives | frozen

    @property
    def is_empty(self) -> bool:
        """Whether nothing changed."""
        nodes = any(each.nodes.before or each.nodes.after for each in self.people.trees)
        graph = len(self.graph.before.edges) + len(self.graph.after.edges)
        return not (nodes or graph or self.frozen_before or self.frozen_after)

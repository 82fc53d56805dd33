"""What has been observed of the order of primitives: nodes, edges, longer histories."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Self

import numpy as np

from ..errors import InvalidValueError, UnknownPrimitiveError
from ..recording import FloatArray, IntArray
from ..state import validated
from .edges import EdgeTable
from .graph_state import GraphState
from .history import HistoryTable


class TransitionCounts:
    """The counts behind a `TransitionGraph`: they only add, so they do not depend on order.

    Ids are listed in the order in which they were added; arrays over nodes follow that order.

    Attributes:
        order: Longest history that prediction looks at; 1 is a first-order Markov chain.
        concentration: Weight of what a shorter history predicts, in observations for each different
            primitive that has followed the longer one; 1 is Witten and Bell's [Witten1991].
        history_capacity: Largest number of entries kept about histories longer than one.
    """

    def __init__(
        self, *, order: int = 2, concentration: float = 1.0, history_capacity: int = 20_000
    ) -> None:
        if not 1 <= order <= 8:
            raise InvalidValueError(f"order must lie in [1, 8], not {order}")
        if not (concentration > 0 and math.isfinite(concentration)):
            raise InvalidValueError(f"concentration must be positive, not {concentration}")
        if history_capacity < 4:
            raise InvalidValueError(f"history_capacity must be at least 4, not {history_capacity}")
        self.order = order
        self.concentration = concentration
        self.history_capacity = history_capacity
        self._index: dict[int, int] = {}
        self._edges = EdgeTable()
        self._histories = HistoryTable(order, history_capacity)
        self._frozen = False
        self._snapshot: Self | None = None
        self._before_change()

    # ---- growing

    def add_node(self, id: int) -> None:
        """Add a primitive; one that is there already stays as it is."""
        if id not in self._index:
            self._before_change()
            self._index[id] = len(self._index)

    def observe(
        self, previous: int, next: int, duration_s: float, *, before: Sequence[int] = ()
    ) -> None:
        """Count a transition between two segments recognised one right after the other.

        Args:
            previous: The first primitive.
            next: The one that followed it.
            duration_s: Time from the start of ``previous`` to the start of ``next`` [s].
            before: The primitives recognised before ``previous`` without a break, oldest first:
                what prediction by longer histories learns from.

        Raises:
            UnknownPrimitiveError: One of them is not a node.
            InvalidValueError: The duration is negative, not finite or beyond a day.
        """
        self._require(previous, next, *before)
        self._before_change()
        self._edges.observe(previous, next, duration_s)
        if self.order > 1 and before:
            self._histories.observe((*before[-(self.order - 1) :], previous), next)

    def remove_node(self, id: int) -> None:
        """Remove a primitive and every transition that names it."""
        self._require(id)
        self._before_change()
        gone = (self._edges.sources == id) | (self._edges.targets == id)
        self._edges = self._edges.without(gone)
        self._histories = self._histories.without(id)
        self._index = {i: k for k, i in enumerate(i for i in self._index if i != id)}

    def merge_nodes(self, keep: int, merged: int) -> None:
        """Make two nodes one: what was counted for ``merged`` is added to ``keep``."""
        self._require(keep, merged)
        if keep != merged:
            self._rename({merged: keep})

    def add(self, other: TransitionCounts, new_id: Mapping[int, int] | None = None) -> None:
        """Add the nodes and counts of another graph, its ids replaced where ``new_id`` names them.

        Counts do not depend on the order in which graphs are added.
        """
        self._before_change()
        added = other.copy()
        if new_id is not None:
            added._require(*new_id)
            added._rename(dict(new_id))
        for node in added.ids:
            self.add_node(node)
        self._edges.add(added._edges.rows)
        self._histories.add(added._histories)

    # ---- looking

    def __len__(self) -> int:
        """Number of primitives."""
        return len(self._index)

    def __contains__(self, id: object) -> bool:
        """Whether a primitive is a node."""
        return id in self._index

    @property
    def ids(self) -> tuple[int, ...]:
        """The primitives, in the order in which they were added."""
        return tuple(self._index)

    @property
    def n_edges(self) -> int:
        """Number of different transitions that have been seen."""
        return len(self._edges)

    @property
    def n_transitions(self) -> int:
        """Number of transitions that have been seen."""
        return int(self._edges.counts.sum())

    def count(self, previous: int, next: int) -> int:
        """How often a transition has been seen."""
        self._require(previous, next)
        return self._edges.count(previous, next)

    def duration_s(self, previous: int, next: int) -> float:
        """Mean duration of a transition [s]; NaN where it has never been seen."""
        self._require(previous, next)
        return self._edges.time_s(previous, next)[0]

    def successors(self, id: int) -> tuple[int, ...]:
        """The primitives that have been seen to follow one, in the order of first sight."""
        self._require(id)
        return tuple(self._edges.targets[self._edges.sources == id].tolist())

    def seen(self, context: tuple[int, ...], next: int) -> bool:
        """Whether a primitive has been counted after a context, oldest first."""
        if len(context) < 2:
            return bool(context) and self._edges.count(context[0], next) > 0
        return next in self._histories.followers(context[-self.order :])

    def edge_rows(self) -> IntArray:
        """Return the edges, shape (E, 5): source, target, count, total [ms], squares [ms^2]."""
        return self._edges.rows

    def histories(self) -> Iterator[tuple[tuple[int, ...], int, int]]:
        """Yield (context, next, count) of the contexts longer than one primitive."""
        return self._histories.entries()

    # ---- keeping

    def state(self) -> GraphState:
        """Return all that was counted."""
        return GraphState(
            order=self.order,
            concentration=self.concentration,
            history_capacity=self.history_capacity,
            ids=np.array(self.ids, dtype=np.int64),
            edges=self._edges.rows,
            histories=self._histories.to_array(),
        )

    @classmethod
    def from_state(cls, state: GraphState) -> Self:
        """Return the graph whose `state` this is.

        Raises:
            StateError: The arrays do not describe a graph.
        """
        state = validated(state)
        graph = cls(
            order=state.order,
            concentration=state.concentration,
            history_capacity=state.history_capacity,
        )
        graph._index = {id: k for k, id in enumerate(state.ids.tolist())}
        graph._edges.add(state.edges)
        graph._histories = HistoryTable.from_array(
            graph.order, graph.history_capacity, state.histories
        )
        return graph

    def snapshot(self) -> Self:
        """Return a copy that refuses to be changed: the same one, as long as this one stays so."""
        if self._frozen:
            return self
        if self._snapshot is None:
            self._snapshot = self.copy()
            self._snapshot._frozen = True
        return self._snapshot

    def copy(self) -> Self:
        """Return an independent copy."""
        twin = type(self)(
            order=self.order,
            concentration=self.concentration,
            history_capacity=self.history_capacity,
        )
        twin._index = dict(self._index)
        twin._edges = self._edges.copy()
        twin._histories = self._histories.copy()
        return twin

    # ---- inside

    def _before_change(self) -> None:
        """Refuse a change to a snapshot; forget what was derived from the counts."""
        if self._frozen:
            raise InvalidValueError("this graph is a snapshot; its copy() can grow")
        self._snapshot = None

    def _require(self, *ids: int) -> None:
        for id in ids:
            if id not in self._index:
                raise UnknownPrimitiveError(
                    f"primitive {id} is not in the graph; it holds {_shortened(self.ids)}"
                )

    def _indices(self, ids: IntArray) -> IntArray:
        index = self._index
        return np.array([index[id] for id in ids.tolist()], dtype=np.int64)

    def followers(self, context: tuple[int, ...]) -> FloatArray:
        """How often each primitive followed a context (the empty one too), shape (n,)."""
        row = np.zeros(len(self))
        edges = self._edges
        if len(context) < 2:
            counted = edges.sources == context[0] if context else np.full(len(edges), True)
            np.add.at(row, self._indices(edges.targets[counted]), edges.counts[counted])
        else:
            for next_id, n in self._histories.followers(context).items():
                row[self._index[next_id]] = n
        return row

    def _rename(self, new_id: dict[int, int]) -> None:
        self._before_change()
        self._edges = self._edges.renamed(new_id)
        self._histories = self._histories.renamed(new_id)
        ids = dict.fromkeys(new_id.get(id, id) for id in self._index)
        self._index = {id: k for k, id in enumerate(ids)}


def _shortened(ids: tuple[int, ...]) -> str:
    shown = ", ".join(map(str, ids[:20]))
    return f"{len(ids)} primitives: {shown}" + (", ..." if len(ids) > 20 else "")

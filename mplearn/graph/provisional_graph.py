"""Transitions that a graph does not hold, read together with those that it does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..recording import FloatArray
from .prediction import History, Prediction, backed_off, most_likely, usable_context
from .transition_graph import TransitionGraph


class ProvisionalGraph:
    """A graph, and beside it transitions of what is no primitive yet; the graph stays as it is.

    Args:
        graph: The graph; its order and its weight of shorter histories hold for both.

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> graph = TransitionGraph()
        >>> for id in (1, 2):
        ...     graph.add_node(id)
        >>> graph.observe(1, 2, 0.9)
        >>> beside = ProvisionalGraph(graph)
        >>> beside.add_node(-1)  # a motion seen once
        >>> beside.observe(2, -1, 1.0)
        >>> beside.predict([2], k=1)[0].id, graph.ids
        (-1, (1, 2))
    """

    def __init__(self, graph: TransitionGraph) -> None:
        self._graph = graph
        self._beside = TransitionGraph(
            order=graph.order,
            concentration=graph.concentration,
            history_capacity=graph.history_capacity,
        )
        self._index = {id: k for k, id in enumerate(graph.ids)}

    def __len__(self) -> int:
        """Number of nodes."""
        return len(self._index)

    @property
    def ids(self) -> tuple[int, ...]:
        """The graph's primitives, then what was added, each in the order of addition."""
        return tuple(self._index)

    def add_node(self, id: int) -> None:
        """Add a node; one that is there already stays as it is."""
        self._index.setdefault(id, len(self))
        self._beside.add_node(id)

    def observe(
        self, previous: int, next: int, duration_s: float, *, before: Sequence[int] = ()
    ) -> None:
        """Count a transition that the graph does not hold; see `TransitionGraph.observe`."""
        for id in (*before, previous, next):
            self.add_node(id)
        self._beside.observe(previous, next, duration_s, before=before)

    def followers(self, context: tuple[int, ...]) -> FloatArray:
        """How often each node followed a context (the empty one too), shape (n,), as `ids`."""
        row = np.zeros(len(self))
        if all(id in self._graph for id in context):
            row[: len(self._graph)] = self._graph.followers(context)
        if all(id in self._beside for id in context):
            places = [self._index[id] for id in self._beside.ids]
            row[places] += self._beside.followers(context)
        return row

    def predict(self, history: History, k: int = 3) -> tuple[Prediction, ...]:
        """Return the ``k`` nodes most likely to come next; see `TransitionGraph.predict`."""
        context = usable_context(history, self._graph.order)
        p = backed_off(self, context, self._graph.concentration)
        return most_likely(self.ids, p, k, lambda id: self._time_s(context[-1:], id))

    def _time_s(self, last: tuple[int, ...], next_id: int) -> tuple[float, float]:
        known = bool(last) and last[0] in self._graph
        beside = not known or self._beside.seen(last, next_id)
        return (self._beside if beside else self._graph).time_s(last, next_id)

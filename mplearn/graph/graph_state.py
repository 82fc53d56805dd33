"""What a transition graph remembers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..state import WHOLE, Array, IntTable, Range, SharedState, require

_LONGEST_MS = 86_400_000


@dataclass(frozen=True, eq=False)
class GraphState(SharedState):
    """The counts of a graph.

    Attributes:
        order: Longest history that prediction looks at.
        concentration: Weight of what a shorter history predicts.
        history_capacity: Largest number of entries kept about histories longer than one.
        ids: The primitives, in the order in which they were added, shape (n,).
        edges: Source, target, count, total [ms], squares [ms^2], shape (E, 5).
        histories: Length, context padded with 0, next, count, shape (H, order + 3).

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> graph = TransitionGraph()
        >>> graph.add_node(1), graph.add_node(2), graph.observe(1, 2, 0.5)
        (None, None, None)
        >>> graph.state().ids.array.tolist(), graph.state().edges.array[0, :3].tolist()
        ([1, 2], [1, 2, 1])
    """

    order: Annotated[int, Range(1, 8)]
    concentration: Annotated[float, Range(1e-12)]
    history_capacity: Annotated[int, Range(4, 10_000_000)]
    ids: Annotated[IntTable, Array("n")]
    edges: Annotated[IntTable, Array(None, 5, high=2.0**62)]
    histories: Annotated[IntTable, Array(None, None)]

    def check(self) -> None:
        """Check that transitions name only nodes, and that counts and durations can be."""
        ids, edges, histories = self.ids.array, self.edges.array, self.histories.array
        order = self.order
        require(histories.shape[1] == order + 3, "histories", f"must have shape (H, {order + 3})")
        require(len(histories) <= self.history_capacity, "histories", "must not exceed capacity")
        require(len(set(ids.tolist())) == len(ids), "ids", "must differ")
        require(bool(np.isin(edges[:, :2], ids).all()), "edges", "must name only ids of nodes")
        pairs = set(map(tuple, edges[:, :2].tolist()))
        require(len(pairs) == len(edges), "edges", "must be of different pairs")
        count, total_ms = edges[:, 2].astype(np.float64), edges[:, 3]
        counted = bool(((count >= 1) & (count <= WHOLE)).all())
        require(counted, "edges", f"must have counts in [1, {WHOLE:g}]")
        fits = (total_ms >= 0) & (total_ms <= count * _LONGEST_MS) & (edges[:, 4] >= 0)
        squares = edges[:, 4].astype(np.float64)  # no less than of equal durations
        fits &= (squares >= 0.999 * total_ms**2.0 / count) & (squares <= count * _LONGEST_MS**2)
        require(bool(fits.all()), "edges", "must have durations of at least 0 and at most a day")
        lengths = histories[:, 0]
        inside = (lengths >= 2) & (lengths <= order)
        require(bool(inside.all()), "histories", f"must have lengths in [2, {order}]")
        used = np.arange(order) < lengths[:, None]
        named = np.concatenate((histories[:, 1:-2][used], histories[:, -2]))
        require(bool(np.isin(named, ids).all()), "histories", "must name only ids of nodes")
        counts = {(source, target): n for source, target, n in edges[:, :3].tolist()}
        seen = set()
        for length, *context, after, n in histories.tolist():
            seen.add((*context[:length], after))
            most = counts.get((context[length - 1], after), 0)
            require(1 <= n <= most, "histories", f"must have counts in [1, {most}] there, not {n}")
        require(len(seen) == len(histories), "histories", "must differ")

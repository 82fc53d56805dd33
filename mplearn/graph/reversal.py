"""Counts that an edit changed are put back, and what was counted since stays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, TypeAlias

import numpy as np

from ..recording import IntArray
from ..state import Array, Count, KeptBlocks, State
from .graph_state import GraphState

Key: TypeAlias = tuple[int, ...]
Counts: TypeAlias = dict[Key, list[int]]


@dataclass(frozen=True, eq=False)
class CountsState(State):
    """Rows of a graph that an edit changed; counts with their place among all rows.

    Attributes:
        edges: Place and edge, shape (E, 6), see `GraphState`.
        histories: Place and history, shape (H, order + 4).
    """

    edges: Annotated[IntArray, Array(None, 6, high=2.0**62)]
    histories: Annotated[IntArray, Array(None, None)]


@dataclass(frozen=True, eq=False)
class GraphEdit(State):
    """What an edit changed in a graph: its rows before and after.

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> graph = TransitionGraph()
        >>> for id in (1, 2):
        ...     graph.add_node(id)
        >>> before = graph.state()
        >>> graph.observe(1, 2, 0.9)
        >>> edit = GraphEdit.between(before, graph.state())
        >>> len(edit.before.edges), len(edit.after.edges), len(edit.reversed().after.edges)
        (0, 1, 0)
    """

    before: CountsState
    after: CountsState
    order: Count

    @classmethod
    def between(cls, before: GraphState, after: GraphState) -> GraphEdit:
        """Return what differs between a graph of one moment and another."""
        n_context = 1 + before.order
        edges = _changed(before.edges.array, after.edges.array, 2)
        histories = _changed(before.histories.array, after.histories.array, n_context)
        old, new = (CountsState(edges[side], histories[side]) for side in (0, 1))
        return cls(old, new, before.order)

    def reversed(self) -> GraphEdit:
        """Return the edit that undoes this one."""
        return GraphEdit(self.after, self.before, self.order)


def exchanged(
    now: GraphState, edit: GraphEdit, heirs: Mapping[int, int | None], ids: Iterable[int]
) -> GraphState:
    """Return a graph with the rows after an edit in the place of those before it.

    Args:
        now: The graph.
        edit: The rows that are to go (``before``), and those that are to come.
        heirs: Nodes that are gone, and the node that has what was counted for each since; None
            where that is forgotten.
        ids: The nodes that there are now.
    """
    known = set(ids)
    edges = _put(now.edges.array, edit.before.edges, edit.after.edges, 2, heirs)
    edges = {key: _sound(values) for key, values in edges.items() if known.issuperset(key)}
    histories = _put(now.histories.array, edit.before.histories, edit.after.histories, -1, heirs)
    rows = []
    for key, (n,) in histories.items():
        length, context, after = key[0], key[1 : 1 + key[0]], key[-1]
        most = edges.get((context[-1], after), [0])[0]
        if known.issuperset((*context, after)) and min(n, most) > 0:
            rows.append((length, *key[1:], min(n, most)))
    return replace(
        now,
        ids=KeptBlocks().table(sorted(known)),
        edges=KeptBlocks().table(_array([(*key, *values) for key, values in edges.items()], 5)),
        histories=KeptBlocks().table(_array(rows, edit.order + 3)),
    )


def _changed(before: IntArray, after: IntArray, n_same: int) -> tuple[IntArray, IntArray]:
    """Return the rows of each table that are not in the other, with their places.

    So are rows that are equal to those in ``n_same`` columns: they stand together.
    """
    old, new = (list(map(tuple, table.tolist())) for table in (before, after))
    keys = {row[:n_same] for row in set(old) ^ set(new)}
    width = 1 + before.shape[1]
    one, other = (
        [(k, *row) for k, row in enumerate(rows) if row[:n_same] in keys] for rows in (old, new)
    )
    return _array(one, width), _array(other, width)


def _put(
    now: IntArray, gone: IntArray, back: IntArray, n_keys: int, heirs: Mapping[int, int | None]
) -> Counts:
    """Take some counts from a table, and add others at their places.

    What is left of ids that are gone goes to their heirs.
    """
    rows: Counts = {tuple(row[:n_keys]): row[n_keys:] for row in now.tolist()}
    less = {tuple(row[:n_keys]): row[n_keys:] for row in (each[1:] for each in gone.tolist())}
    since: Counts = {}
    for key in list(rows):
        named = key[1 : 1 + key[0]] + key[-1:] if n_keys == -1 else key
        touched = not heirs.keys().isdisjoint(named)
        if key in less or touched:
            left = [n - m for n, m in zip(rows.pop(key), less.get(key, [0] * 3), strict=False)]
            if left[0] > 0:
                _add(since, _named(key, n_keys, heirs), left)
    items = list(rows.items())
    for place, *row in back.tolist():
        key = tuple(row[:n_keys])
        if key in rows:
            _add(since, key, row[n_keys:])
        else:
            items.insert(place, (key, row[n_keys:]))
    table = dict(items)
    for key, values in since.items():
        _add(table, key, values)
    return table


def _named(key: Key, n_keys: int, heirs: Mapping[int, int | None]) -> Key:
    """Return a key with heirs in the place of ids that are gone; those without one are -1."""

    def named(id: int) -> int:
        heir = heirs.get(id, id)
        return -1 if heir is None else heir

    if n_keys == 2:
        return named(key[0]), named(key[1])
    length = key[0]
    return (length, *map(named, key[1 : 1 + length]), *key[1 + length : -1], named(key[-1]))


def _add(counts: Counts, key: Key, values: Sequence[int]) -> None:
    known = counts.get(key, [0] * len(values))
    counts[key] = [a + b for a, b in zip(known, values, strict=True)]


def _sound(values: list[int]) -> list[int]:
    """Return count, total and squares [ms] such as can be, where part of them was taken away."""
    count, total, squares = values
    total = max(total, 0)
    return [count, total, max(squares, -(-(total**2) // count))]


def _array(rows: Sequence[tuple[int, ...]], width: int) -> IntArray:
    return np.array(rows, dtype=np.int64).reshape(len(rows), width)

"""The table of observed edges: a row of whole numbers each, so that sums do not depend on order."""

from __future__ import annotations

import numpy as np

from ..errors import InvalidValueError
from ..recording import BoolArray, FloatArray, IntArray
from ..state import IntTable, KeptBlocks

_SOURCE, _TARGET, _COUNT, _TOTAL_MS, _SQUARES_MS2 = range(5)
_LONGEST_S = 86_400.0


class EdgeTable:
    """Counts and durations of directed edges between ids.

    Rows are ``[source, target, count, sum of durations [ms], sum of their squares [ms^2]]``. Whole
    milliseconds make addition exact: two tables added in either order are the same bit for bit.
    """

    def __init__(self) -> None:
        self._rows = np.zeros((16, 5), dtype=np.int64)
        self._row_of: dict[tuple[int, int], int] = {}
        self._into: dict[int, int] = {}  # counts by target
        self._from: dict[int, tuple[int, int]] = {}  # counts, and targets, by source
        self._n_taken = 0
        self._blocks = KeptBlocks()

    def __len__(self) -> int:
        """Number of edges."""
        return len(self._row_of)

    def __contains__(self, edge: tuple[int, int]) -> bool:
        """Whether the edge has been observed."""
        return edge in self._row_of

    @property
    def rows(self) -> IntArray:
        """A copy of the rows, shape (E, 5), in the order in which the edges were first seen."""
        return self._rows[: len(self)].copy()

    def table(self) -> IntTable:
        """Return the rows in blocks, those of before as long as nothing in them changes."""
        return self._blocks.table(self._rows[: len(self)])

    @property
    def sources(self) -> IntArray:
        """Where each edge starts, shape (E,)."""
        return self._rows[: len(self), _SOURCE]

    @property
    def targets(self) -> IntArray:
        """Where each edge ends, shape (E,)."""
        return self._rows[: len(self), _TARGET]

    @property
    def counts(self) -> IntArray:
        """How often each edge was taken, shape (E,)."""
        return self._rows[: len(self), _COUNT]

    @property
    def mean_s(self) -> FloatArray:
        """Mean duration of each edge, shape (E,) [s]."""
        return self._rows[: len(self), _TOTAL_MS] / self.counts / 1e3

    @property
    def std_s(self) -> FloatArray:
        """Standard deviation of each edge's duration, shape (E,) [s]."""
        squares = self._rows[: len(self), _SQUARES_MS2] / self.counts / 1e6
        return np.sqrt(np.maximum(squares - self.mean_s**2, 0.0))

    def count(self, source: int, target: int) -> int:
        """How often an edge was taken; 0 where never."""
        row = self._row_of.get((source, target))
        return 0 if row is None else int(self._rows[row, _COUNT])

    def tally(self, context: tuple[int, ...], target: int) -> tuple[int, int, int]:
        """How often a target, any target, and how many of them followed a source, or whatever.

        Args:
            context: The source; empty for all sources together.
            target: Where the edge ends.
        """
        if not context:
            return self._into.get(target, 0), self._n_taken, len(self._into)
        (source,) = context
        return self.count(source, target), *self._from.get(source, (0, 0))

    def time_s(self, source: int, target: int | None = None) -> tuple[float, float]:
        """Mean and standard deviation of an edge's duration [s]; NaN where it was never taken.

        Args:
            source: Where the edge starts.
            target: Where it ends; None for all edges from ``source`` together.
        """
        if target is None:
            rows = np.flatnonzero(self.sources == source)
        else:
            row = self._row_of.get((source, target))
            rows = np.array([] if row is None else [row], dtype=np.int64)
        count, total_ms, squares = self._rows[rows, _COUNT:].sum(axis=0).tolist()
        if count == 0:
            return float("nan"), float("nan")
        mean_s = total_ms / count / 1e3
        return mean_s, max(squares / count / 1e6 - mean_s**2, 0.0) ** 0.5

    def observe(self, source: int, target: int, duration_s: float) -> None:
        """Count an edge once.

        Raises:
            InvalidValueError: The duration is not in [0, 86400] s.
        """
        if not 0.0 <= duration_s <= _LONGEST_S:  # NaN fails too
            raise InvalidValueError(
                f"a transition's duration_s must lie in [0, {_LONGEST_S:g}], not {duration_s}"
            )
        milliseconds = round(duration_s * 1e3)
        self._add((source, target), np.array([1, milliseconds, milliseconds**2]))

    def add(self, rows: IntArray) -> None:
        """Add rows, shape (E, 5), as `rows` returns them."""
        for row in rows:
            self._add((int(row[_SOURCE]), int(row[_TARGET])), row[_COUNT:])

    def copy(self) -> EdgeTable:
        """Return an independent copy."""
        twin = EdgeTable()
        twin._rows, twin._row_of = self._rows.copy(), dict(self._row_of)
        twin._into, twin._from = dict(self._into), dict(self._from)
        twin._n_taken = self._n_taken
        twin._blocks = self._blocks.copy()
        return twin

    def without(self, gone: BoolArray) -> EdgeTable:
        """Return the table less the edges marked in ``gone``, shape (E,)."""
        rest = EdgeTable()
        rest.add(self.rows[~gone])
        return rest

    def renamed(self, new_id: dict[int, int]) -> EdgeTable:
        """Return the table with ids replaced as ``new_id`` says; rows that meet are added."""
        rows = self.rows
        for column in (_SOURCE, _TARGET):
            rows[:, column] = [new_id.get(int(old), int(old)) for old in rows[:, column]]
        table = EdgeTable()
        table.add(rows)
        return table

    def _add(self, edge: tuple[int, int], amounts: IntArray) -> None:
        row, n = self._row_of.get(edge), int(amounts[0])
        n_taken, n_targets = self._from.get(edge[0], (0, 0))
        self._from[edge[0]] = n_taken + n, n_targets + (row is None)
        self._into[edge[1]] = self._into.get(edge[1], 0) + n
        self._n_taken += n
        if row is None:
            row = len(self._row_of)
            if row == len(self._rows):
                self._rows = np.concatenate([self._rows, np.zeros_like(self._rows)])
            self._rows[row, : _TARGET + 1] = edge
            self._row_of[edge] = row
        self._rows[row, _COUNT:] += amounts
        self._blocks.touch(row)

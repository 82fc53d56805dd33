"""What followed longer histories than one primitive: a bounded table of counts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

import numpy as np

from ..recording import IntArray
from ..state import ROWS, Blob, IntTable

_Context: TypeAlias = tuple[int, ...]


class HistoryTable:
    """Counts of what followed each context of 2 to ``order`` primitives.

    Attributes:
        order: Length of the longest context kept.
        capacity: Largest number of (context, next) entries. When it is exceeded the rarest quarter
            is forgotten, among equals those seen longest ago, so that memory is bounded for ever.
    """

    def __init__(self, order: int, capacity: int) -> None:
        self.order = order
        self.capacity = capacity
        self._followers: dict[_Context, dict[int, int]] = {}
        self._own: set[_Context] = set()  # whose followers no copy of this table has
        self._size = 0
        self._block_of: dict[_Context, int] = {}
        self._blocks: dict[int, dict[_Context, None]] = {0: {}}  # as they were seen last
        self._tables: dict[int, Blob] = {}  # of the blocks in which nothing has changed since
        self._n_put = 0  # contexts that were put into the last block

    def __len__(self) -> int:
        """Number of (context, next) entries."""
        return self._size

    def followers(self, context: tuple[int, ...]) -> dict[int, int]:
        """Return what followed a context, and how often; empty where it was never seen."""
        return self._followers.get(context, {})

    def tally(self, context: tuple[int, ...], next_id: int) -> tuple[int, int, int]:
        """How often a primitive, any primitive, and how many of them followed a context."""
        followers = self.followers(context)
        return followers.get(next_id, 0), sum(followers.values()), len(followers)

    def observe(self, history: Sequence[int], next_id: int) -> None:
        """Count ``next_id`` after every context that ``history`` (oldest first) ends with."""
        for length in range(2, min(self.order, len(history)) + 1):
            self._add(tuple(history[-length:]), next_id, 1)
        if self._size > self.capacity:
            self._forget()

    def entries(self) -> Iterator[tuple[tuple[int, ...], int, int]]:
        """Yield (context, next id, count), those seen longest ago first."""
        for context, followers in self._followers.items():
            for next_id, count in followers.items():
                yield context, next_id, count

    def add(self, other: HistoryTable) -> None:
        """Add the counts of another table."""
        for context, next_id, count in other.entries():
            if len(context) <= self.order:
                self._add(context, next_id, count)
        if self._size > self.capacity:
            self._forget()

    def copy(self) -> HistoryTable:
        """Return an independent copy."""
        twin = HistoryTable(self.order, self.capacity)
        twin._followers, twin._size = dict(self._followers), self._size
        self._own = set()
        twin._block_of, twin._n_put = dict(self._block_of), self._n_put
        twin._blocks = {at: dict(contexts) for at, contexts in self._blocks.items()}
        twin._tables = dict(self._tables)
        return twin

    def without(self, gone: int) -> HistoryTable:
        """Return the table less every entry that names ``gone``."""
        rest = HistoryTable(self.order, self.capacity)
        for context, next_id, count in self.entries():
            if gone != next_id and gone not in context:
                rest._add(context, next_id, count)
        return rest

    def renamed(self, new_id: dict[int, int]) -> HistoryTable:
        """Return the table with ids replaced as ``new_id`` says; equal entries are added."""
        table = HistoryTable(self.order, self.capacity)
        for context, next_id, count in self.entries():
            renamed = tuple(new_id.get(i, i) for i in context)
            table._add(renamed, new_id.get(next_id, next_id), count)
        return table

    def table(self) -> IntTable:
        """Return the entries, shape (E, order + 3): length, context padded with 0, next, count.

        They are in blocks, those of before as long as nothing in them changes.
        """
        if len(self._blocks) > 8 + 4 * len(self._followers) // ROWS:  # most of them hold little
            self._put_together()
        for at, contexts in self._blocks.items():
            if at not in self._tables:
                self._tables[at] = Blob(self._rows(contexts))
        return IntTable(self._tables[at] for at in self._blocks)

    @classmethod
    def from_table(cls, order: int, capacity: int, table: IntTable) -> HistoryTable:
        """Build the table that `table` described."""
        made = cls(order, capacity)
        for at, block in enumerate(table.blocks):
            if at:
                made._begin_block()
            for length, *context, next_id, count in block.array.tolist():
                made._add(tuple(context[:length]), next_id, count)
        return made

    def _rows(self, contexts: Iterable[_Context]) -> IntArray:
        """Return the entries of some contexts, see `table`."""
        padding = [(0,) * (self.order - length) for length in range(self.order + 1)]
        rows = [
            (len(context), *context, *padding[len(context)], next_id, count)
            for context in contexts
            for next_id, count in self._followers[context].items()
        ]
        return np.array(rows, np.int64).reshape(len(rows), self.order + 3)

    def _add(self, context: _Context, next_id: int, count: int) -> None:
        followers = self._followers.pop(context, {})  # the latest seen stands last
        if context not in self._own:
            followers = dict(followers)
            self._own.add(context)
        self._size += next_id not in followers
        followers[next_id] = followers.get(next_id, 0) + count
        self._followers[context] = followers
        self._put_last(context)

    def _put_last(self, context: _Context) -> None:
        """Move a context to the end of the last block."""
        last, before = next(reversed(self._blocks)), self._block_of.get(context)
        if before is not None:
            del self._blocks[before][context]
            self._tables.pop(before, None)
            if not self._blocks[before] and before != last:
                del self._blocks[before]
        if before != last:
            if self._n_put >= ROWS:
                last = self._begin_block()
            self._n_put += 1
        self._blocks[last][context] = None
        self._block_of[context] = last
        self._tables.pop(last, None)

    def _begin_block(self) -> int:
        """Let what comes be in a new block; return its number."""
        last = next(reversed(self._blocks)) + 1
        self._blocks[last], self._n_put = {}, 0
        return last

    def _put_together(self) -> None:
        """Fill all blocks but the last."""
        self._block_of, self._blocks, self._tables, self._n_put = {}, {0: {}}, {}, 0
        for context in self._followers:
            self._put_last(context)

    def _forget(self) -> None:
        entries = list(self.entries())
        rarest_first = np.argsort([count for _, _, count in entries], kind="stable")
        kept = np.sort(rarest_first[len(entries) - 3 * self.capacity // 4 :])
        rest = HistoryTable(self.order, self.capacity)
        for i in kept:
            rest._add(*entries[i])
        self.__dict__.update(rest.__dict__)

"""What followed longer histories than one primitive: a bounded table of counts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np

from ..recording import IntArray


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
        self._followers: dict[tuple[int, ...], dict[int, int]] = {}
        self._size = 0

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
        twin._followers = dict(self._followers)  # what followed one is never changed in place
        twin._size = self._size
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

    def to_array(self) -> IntArray:
        """Return the entries, shape (E, order + 3): length, context padded with 0, next, count."""
        padding = [(0,) * (self.order - length) for length in range(self.order + 1)]
        rows = [
            (len(context), *context, *padding[len(context)], next_id, count)
            for context, followers in self._followers.items()
            for next_id, count in followers.items()
        ]
        width = self.order + 3
        flat = np.fromiter(chain.from_iterable(rows), np.int64, len(rows) * width)
        return flat.reshape(len(rows), width)

    @classmethod
    def from_array(cls, order: int, capacity: int, rows: IntArray) -> HistoryTable:
        """Build the table that `to_array` described."""
        table = cls(order, capacity)
        for length, *context, next_id, count in rows.tolist():
            table._add(tuple(context[:length]), next_id, count)
        return table

    def _add(self, context: tuple[int, ...], next_id: int, count: int) -> None:
        followers = self._followers.pop(context, {})
        self._size += next_id not in followers
        count += followers.get(next_id, 0)
        self._followers[context] = {**followers, next_id: count}  # the latest seen stands last

    def _forget(self) -> None:
        entries = list(self.entries())
        rarest_first = np.argsort([count for _, _, count in entries], kind="stable")
        kept = np.sort(rarest_first[len(entries) - 3 * self.capacity // 4 :])
        self._followers, self._size = {}, 0
        for i in kept:
            self._add(*entries[i])

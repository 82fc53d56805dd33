"""Which action stands for which primitive: a primitive keeps its slot as long as it lives."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mplearn.errors import InvalidValueError, LibraryError

SMALLEST_CAPACITY = 32


class Slots:
    """Slots 1 to capacity - 1, each of one primitive or free; slot 0 is hold.

    New primitives take slots that were never used, the lowest first, in the order of their ids;
    only when there are none left, those of primitives that are gone, the longest free first.

    Args:
        capacity: Number of slots, hold included; None is the next power of two that leaves room
            for ``expected`` primitives, at least 32.
        expected: Number of primitives to make room for.

    Attributes:
        of: Slot of each primitive.

    Raises:
        InvalidValueError: The capacity is not an integer above 1.
    """

    def __init__(self, capacity: int | None, expected: int) -> None:
        if capacity is None:
            capacity = max(SMALLEST_CAPACITY, 1 << expected.bit_length())
        if isinstance(capacity, bool) or not isinstance(capacity, (int, np.integer)):
            raise InvalidValueError(f"capacity must be an integer, not {capacity!r}")
        if capacity < 2:
            raise InvalidValueError(f"capacity must be at least 2, not {capacity}")
        self.capacity = int(capacity)
        self.clear()

    def clear(self) -> None:
        """Forget who was where."""
        self.of: dict[int, int] = {}
        self._primitives: list[int | None] = [None] * self.capacity
        self._free = list(range(1, self.capacity))  # never used ones first

    def primitive(self, slot: int) -> int | None:
        """Return the id of the primitive in a slot; None for hold and for free slots."""
        return self._primitives[slot]

    def update(self, ids: Iterable[int]) -> tuple[int, ...]:
        """Let these primitives have slots and no others.

        Returns:
            Ids for which there was no slot.
        """
        wanted = sorted(ids)
        for id in sorted(set(self.of) - set(wanted)):
            slot = self.of.pop(id)
            self._primitives[slot] = None
            self._free.append(slot)
        left_out = []
        for id in wanted:
            if id in self.of:
                continue
            if not self._free:
                left_out.append(id)
                continue
            slot = self._free.pop(0)
            self.of[id] = slot
            self._primitives[slot] = id
        return tuple(left_out)

    def require_room(self, n_primitives: int) -> None:
        """Check that so many primitives fit.

        Raises:
            LibraryError: They do not.
        """
        if n_primitives + 1 > self.capacity:
            raise LibraryError(
                f"the library holds {n_primitives} primitives and needs a capacity of at least "
                f"{n_primitives + 1}, one slot more for hold; capacity is {self.capacity}"
            )

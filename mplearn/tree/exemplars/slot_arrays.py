"""Arrays of which there is one a slot, in blocks that never move."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np

from ...recording import FloatArray, IntArray

BLOCK = 512  # rows; the system gives their memory when they are first written


class SlotArrays:
    """Arrays of fixed shapes by slot: one more costs the same, however many there are.

    Args:
        shapes: Shape of each array of a slot.
        short: Which of them are of single precision.

    Attributes:
        blocks: The arrays of `BLOCK` slots each, stacked.
        n_slots: Slots that were ever taken.
    """

    def __init__(self, *shapes: tuple[int, ...], short: Collection[int] = ()) -> None:
        self.shapes = shapes
        self.short = frozenset(short)
        self.blocks: list[tuple[FloatArray, ...]] = []
        self.n_slots = 0
        self._free: list[int] = []
        self._lent: set[int] = set()  # blocks that a fork shows as well: copied before a write
        self._ready = -1  # slot that there is memory for

    def fork(self) -> SlotArrays:
        """Return slots that hold the same, and go on apart; blocks are copied when one changes."""
        twin = SlotArrays(*self.shapes, short=self.short)
        twin.blocks, twin.n_slots, twin._free = list(self.blocks), self.n_slots, list(self._free)
        twin._lent, self._lent = set(range(len(self.blocks))), set(range(len(self.blocks)))
        return twin

    def prepare(self) -> None:
        """Have memory for the slot that is taken next, which the system takes its time to give."""
        slot = self._free[-1] if self._free else self.n_slots
        if slot != self._ready:
            self._make_room()
            for stacked in self._own(slot // BLOCK):
                if slot == self.n_slots:
                    stacked[slot % BLOCK] = 0.0
            self._ready = slot

    def take(self) -> int:
        """Return a slot that is free."""
        if self._free:
            return self._free.pop()
        self._make_room()
        self.n_slots += 1
        return self.n_slots - 1

    def _make_room(self) -> None:
        if not self._free and self.n_slots == BLOCK * len(self.blocks):
            kinds = (np.float32 if k in self.short else np.float64 for k in range(len(self.shapes)))
            self.blocks.append(
                tuple(
                    np.zeros((BLOCK, *s), kind) for s, kind in zip(self.shapes, kinds, strict=True)
                )
            )

    def release(self, slot: int) -> None:
        """Make a slot free."""
        self._free.append(slot)

    def write(self, slot: int, values: Sequence[Any]) -> None:
        """Write the arrays of a slot."""
        block, row = divmod(slot, BLOCK)
        for stacked, value in zip(self._own(block), values, strict=True):
            stacked[row] = value

    def write_all(self, slots: IntArray, values: Sequence[FloatArray]) -> None:
        """Write the arrays of many slots, stacked."""
        block, row = np.divmod(slots, BLOCK)
        for number in np.unique(block).tolist():
            here = np.flatnonzero(block == number)
            for stacked, value in zip(self._own(number), values, strict=True):
                stacked[row[here]] = value[here]

    def write_some(self, slots: IntArray, which: int, values: FloatArray) -> None:
        """Write the first m values of one array, of one axis, of some slots, shape (k, m)."""
        block, row = np.divmod(slots, BLOCK)
        for number in np.unique(block).tolist():
            here = np.flatnonzero(block == number)
            self._own(number)[which][row[here], : values.shape[1]] = values[here]

    def _own(self, block: int) -> tuple[FloatArray, ...]:
        """Return the arrays of a block, which no fork shows from now on."""
        if block in self._lent:
            self.blocks[block] = tuple(stacked.copy() for stacked in self.blocks[block])
            self._lent.remove(block)
        return self.blocks[block]

    def read(self, slot: int) -> tuple[FloatArray, ...]:
        """Return the arrays of a slot, which show what is written there later."""
        block, row = divmod(slot, BLOCK)
        return tuple(stacked[row] for stacked in self.blocks[block])

    def used(self) -> Iterator[tuple[FloatArray, ...]]:
        """Yield the arrays of all slots that were ever taken, block after block, stacked."""
        for number, block in enumerate(self.blocks):
            yield tuple(stacked[: self.n_slots - number * BLOCK] for stacked in block)

    def gather(self, slots: IntArray, which: int) -> FloatArray:
        """Return one array of some slots, copied, shape (k, ...)."""
        out = np.empty((len(slots), *self.shapes[which]))
        for arrays, rows, here in self.parted(slots):
            out[here] = arrays[which][rows]
        return out

    def parted(
        self, slots: IntArray
    ) -> Iterator[tuple[tuple[FloatArray, ...], IntArray, IntArray]]:
        """Yield the blocks that hold some slots: arrays, rows there, positions among the slots.

        Rows lie side by side, however many blocks there are, for compiled loops are compiled once
        more for rows that do not.
        """
        if len(self.blocks) == 1:
            yield self.blocks[0], np.ascontiguousarray(slots), np.arange(len(slots))
            return
        block, row = np.divmod(slots, BLOCK)
        order = np.argsort(block, kind="stable")
        sizes = np.bincount(block, minlength=1)
        end = 0
        for number in np.flatnonzero(sizes).tolist():
            here = order[end : end + sizes[number]]
            end += sizes[number]
            yield self.blocks[number], row[here], here

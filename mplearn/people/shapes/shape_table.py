"""Shapes by slot, and how far apart their movements are: rows change, the rest is kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...maths.compiling import njit
from ...maths.sums import LANES, pair_squares, row_squares
from ...recording import FloatArray, IntArray
from ...tree import MirrorMap
from .shape import Shape, ShapeState, mirrored


class ShapeTable:
    """Holds shapes, and the squared distances of each movement to every other.

    Those are sums in a fixed order, so that they do not depend on when which shape came.

    Args:
        mirror: Which channel is the mirror image of which; None where none is.
    """

    def __init__(self, mirror: MirrorMap | None = None) -> None:
        self.mirror = mirror
        self._free: list[int] = []
        self._used = 0  # slots from here on were never used
        self._states: dict[int, ShapeState] = {}  # as long as a shape does not change
        self._postures = self._movements = self._images = np.zeros((0, 0))
        self._direct = self._mirrored = np.zeros((0, 0))

    def add(self, shape: Shape) -> int:
        """Take a shape; return its slot."""
        if not self._free:
            self._grow(shape)
        slot = self._free.pop()
        self.put(slot, shape)
        return slot

    def add_all(self, shapes: Sequence[Shape]) -> list[int]:
        """Take many shapes at once, which is quicker; return their slots."""
        if not shapes:
            return []
        if len(self._free) < len(shapes):
            self._grow(shapes[0], len(shapes) - len(self._free))
        slots = [self._free.pop() for _ in shapes]
        for slot, shape in zip(slots, shapes, strict=True):
            self._note(slot, shape)
        new = np.array(slots, np.int64)
        others = np.setdiff1d(np.arange(self._used), new)
        mine, theirs = self._movements[new], self._movements[others]
        _put_among(mine, new, self._direct)
        _put_both_ways(_across(mine, theirs), new, others, self._direct)
        if self.mirror is not None:
            images = self._images[new]
            _put_mean(_across(mine, images), new, self._mirrored)
            across = 0.5 * (_across(images, theirs) + _across(mine, self._images[others]))
            _put_both_ways(across, new, others, self._mirrored)
        return slots

    def put(self, slot: int, shape: Shape) -> None:
        """Replace a shape."""
        image = self._note(slot, shape)
        n = self._used
        movements, images = self._movements[:n], self._images[:n]
        self._direct[slot, :n] = self._direct[:n, slot] = _row(movements, shape.movement)
        if self.mirror is not None:
            row = 0.5 * (_row(movements, image.movement) + _row(images, shape.movement))
            self._mirrored[slot, :n] = self._mirrored[:n, slot] = row

    def _note(self, slot: int, shape: Shape) -> Shape:
        """Put a shape and its mirror image into their rows; return that."""
        self._used = max(self._used, slot + 1)
        self._states.pop(slot, None)
        self._postures[slot], self._movements[slot] = shape
        image = shape if self.mirror is None else mirrored(shape, self.mirror)
        self._images[slot] = image.movement
        return image

    def drop(self, slot: int) -> None:
        """Forget a shape."""
        self._free.append(slot)

    def __getitem__(self, slot: int) -> Shape:
        """Return a shape."""
        return Shape(self._postures[slot], self._movements[slot])

    def state(self, slot: int) -> ShapeState:
        """Return a shape as a part that is kept once, by its content."""
        if slot not in self._states:
            self._states[slot] = ShapeState(*(part.copy() for part in self[slot]))
        return self._states[slot]

    def postures(self, slots: IntArray) -> FloatArray:
        """Return the postures of some, shape (n, D)."""
        return self._postures[slots]

    def distances(
        self, levels: FloatArray, slots: IntArray, posture: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return the distances among shapes, and those from their mirror images, (n, n) each.

        Args:
            levels: Their postures, corrected, shape (n, D).
            slots: Where they are, shape (n,).
            posture: Weight of the postures.
        """
        direct = _rooted(levels, levels, self._direct, slots, posture)
        if self.mirror is None:
            return direct, np.full_like(direct, np.inf)
        images = self.mirror.apply(levels)
        return direct, _rooted(images, levels, self._mirrored, slots, posture)

    def distances_to(
        self, shape: Shape, levels: FloatArray, slots: IntArray, posture: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return the distances from one shape, and from its mirror image, shape (n,) each."""

        def row(one: Shape) -> FloatArray:
            across = ((levels - one.posture) ** 2).sum(axis=1)
            return np.asarray(
                np.sqrt(posture * across + _row(self._movements[: self._used], one.movement)[slots])
            )

        direct = row(shape)
        if self.mirror is None:
            return direct, np.full_like(direct, np.inf)
        return direct, row(mirrored(shape, self.mirror))

    def _grow(self, shape: Shape, least: int = 1) -> None:
        held = len(self._postures)
        n = max(16, 2 * held, held + least)
        for name, width in (
            ("_postures", len(shape.posture)),
            ("_movements", len(shape.movement)),
            ("_images", len(shape.movement)),
            ("_direct", n),
            ("_mirrored", n),
        ):
            old, new = getattr(self, name), np.zeros((n, width))
            new[:held, : old.shape[1]] = old
            setattr(self, name, new)
        self._free = [*range(n - 1, held - 1, -1), *self._free]


def stacked(shapes: Sequence[Shape]) -> ShapeTable:
    """Return a table of shapes, whose slots are their places."""
    table = ShapeTable()
    for shape in shapes:
        table.add(shape)
    return table


def _rooted(
    postures: FloatArray, others: FloatArray, movements: FloatArray, slots: IntArray, weight: float
) -> FloatArray:
    """Return the distances of shapes from others in the same slots, (n, n).

    Args:
        postures: Those of the ones, shape (n, D).
        others: Those of the others, shape (n, D).
        movements: Squared distances of movements, of all slots.
        slots: Which, shape (n,).
        weight: Of postures.
    """
    lengths, theirs = (np.einsum("nd,nd->n", each, each) for each in (postures, others))
    return _root_of(2 * postures @ others.T, lengths, theirs, movements, slots, weight)


@njit(cache=True)
def _root_of(
    products: FloatArray,
    lengths: FloatArray,
    theirs: FloatArray,
    movements: FloatArray,
    slots: IntArray,
    weight: float,
) -> FloatArray:
    """Write distances into twice the products of postures, given their squared lengths."""
    for i, one in enumerate(slots):
        for j, other in enumerate(slots):
            square = max(lengths[i] + theirs[j] - products[i, j], 0.0)
            products[i, j] = np.sqrt(weight * square + movements[one, other])
    return products


_BLOCK = 64  # rows that the cache of a core holds


@njit(cache=True)
def _put_among(rows: FloatArray, slots: IntArray, out: FloatArray) -> None:
    """Put the squared distances of all rows from each other, as `_row` has them, at their slots."""
    n = len(rows)
    for start in range(0, n, _BLOCK):
        end = min(start + _BLOCK, n)
        found = np.empty((end - start, end))
        _put_across(rows[start:end], rows[:end], found)
        for j in range(end):
            for i in range(max(start, j + 1), end):
                out[slots[i], slots[j]] = out[slots[j], slots[i]] = found[i - start, j]
    for slot in slots:
        out[slot, slot] = 0.0


@njit(cache=True)
def _put_mean(across: FloatArray, slots: IntArray, out: FloatArray) -> None:
    """Put the mean of each distance and the one back at the slots of both, block by block."""
    n = len(slots)
    for start in range(0, n, _BLOCK):
        for first in range(0, start + 1, _BLOCK):
            for i in range(start, min(start + _BLOCK, n)):
                for j in range(first, min(first + _BLOCK, i + 1)):
                    mean = 0.5 * (across[i, j] + across[j, i])
                    out[slots[i], slots[j]] = out[slots[j], slots[i]] = mean


@njit(cache=True)
def _put_both_ways(across: FloatArray, slots: IntArray, others: IntArray, out: FloatArray) -> None:
    """Put distances between some slots and others, shape (n, m), and back."""
    for i, one in enumerate(slots):
        for j, other in enumerate(others):
            out[one, other] = out[other, one] = across[i, j]


def _across(rows: FloatArray, others: FloatArray) -> FloatArray:
    """Return the squared distance of each row from each of others as `_row` does, (n, m)."""
    out = np.empty((len(rows), len(others)))  # in large pages, which numba's own are not
    _put_across(rows, others, out)
    return out


@njit(cache=True)
def _put_across(rows: FloatArray, others: FloatArray, out: FloatArray) -> None:
    """Put the squared distance of each row from each of others into an array, (n, m)."""
    n, m = len(rows), len(others)
    if n < LANES or m < 2:
        for j in range(m):
            out[:, j] = _row(rows, others[j])
        return
    sums = np.empty((LANES, 2, LANES))
    whole = rows.shape[1] - rows.shape[1] % LANES
    for start in range(0, n, _BLOCK):
        for at in range(0, m, 2):
            at = min(at, m - 2)
            for first in range(start, min(start + _BLOCK, n), LANES):
                first = min(first, n - LANES)
                pair_squares(rows, first, others, at, sums)
                for i in range(LANES):
                    for j in range(2):
                        total = sums[i, j]
                        for k in range(whole, rows.shape[1]):
                            total[0] += (rows[first + i, k] - others[at + j, k]) ** 2
                        found = (total[0] + total[1]) + (total[2] + total[3])
                        out[first + i, at + j] = found


@njit(cache=True)
def _row(rows: FloatArray, one: FloatArray) -> FloatArray:
    """Return the squared distances from one to each row, shape (n, K) and (K,) to (n,)."""
    n = len(rows)
    out, sums = np.empty(n), np.zeros((LANES, LANES))
    whole = len(one) - len(one) % LANES
    for start in range(0, n, LANES):
        first = max(min(start, n - LANES), 0)
        if n < LANES:
            sums[:] = 0.0
            for i in range(n):
                for k in range(whole):
                    sums[i, k % LANES] += (rows[i, k] - one[k]) ** 2
        else:
            row_squares(rows, first, one, sums)
        for i in range(min(LANES, n)):
            for k in range(whole, len(one)):
                sums[i, 0] += (rows[first + i, k] - one[k]) ** 2
            out[first + i] = (sums[i, 0] + sums[i, 1]) + (sums[i, 2] + sums[i, 3])
    return out

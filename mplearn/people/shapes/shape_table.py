"""Shapes by slot, and how far apart their movements are: rows change, the rest is kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...maths.compiling import njit
from ...recording import FloatArray, IntArray
from ...tree import MirrorMap
from .shape import Shape, ShapeState, mirrored, squares


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
        """Take many shapes; return their slots. Where there were none before, that is quicker."""
        if self._used or not shapes:
            return [self.add(shape) for shape in shapes]
        while len(self._free) < len(shapes):
            self._grow(shapes[0])
        slots = [self._free.pop() for _ in shapes]
        for slot, shape in zip(slots, shapes, strict=True):
            self._note(slot, shape)
        n = self._used
        movements, images = self._movements[:n], self._images[:n]
        self._direct[:n, :n] = _among(movements)
        if self.mirror is not None:
            across = _across(movements, images)
            self._mirrored[:n, :n] = 0.5 * (across + across.T)
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
        at = np.ix_(slots, slots)
        direct = np.sqrt(posture * squares(levels, levels) + self._direct[at])
        if self.mirror is None:
            return direct, np.full_like(direct, np.inf)
        images = self.mirror.apply(levels)
        return direct, np.sqrt(posture * squares(images, levels) + self._mirrored[at])

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

    def _grow(self, shape: Shape) -> None:
        held = len(self._postures)
        n = max(16, 2 * held)
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


@njit(cache=True)
def _among(rows: FloatArray) -> FloatArray:
    """Return the squared distances of all rows from each other as `_row` does, shape (n, n)."""
    out = np.zeros((len(rows), len(rows)))
    for i in range(1, len(rows)):
        out[i, :i] = out[:i, i] = _row(rows[:i], rows[i])
    return out


@njit(cache=True)
def _across(rows: FloatArray, others: FloatArray) -> FloatArray:
    """Return the squared distance of each row from each of others as `_row` does, (n, n)."""
    out = np.empty((len(rows), len(others)))
    for j in range(len(others)):
        out[:, j] = _row(rows, others[j])
    return out


@njit(cache=True)
def _row(rows: FloatArray, one: FloatArray) -> FloatArray:
    """Return the squared distances from one to each row, shape (n, K) and (K,) to (n,)."""
    out = np.empty(len(rows))
    whole = len(one) - len(one) % 4
    for i in range(len(rows)):
        a = b = c = d = 0.0  # four sums: the processor adds them at once
        for k in range(0, whole, 4):
            a += (rows[i, k] - one[k]) ** 2
            b += (rows[i, k + 1] - one[k + 1]) ** 2
            c += (rows[i, k + 2] - one[k + 2]) ** 2
            d += (rows[i, k + 3] - one[k + 3]) ** 2
        for k in range(whole, len(one)):
            a += (rows[i, k] - one[k]) ** 2
        out[i] = (a + b) + (c + d)
    return out

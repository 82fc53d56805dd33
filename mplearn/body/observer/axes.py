"""A stream's own origin, axes and unit, and what to do when they change in the middle of it.

A motion capture system that is calibrated anew, a source that changes its unit, an origin that is
reset: from one frame to the next all markers are elsewhere, and yet nobody has moved. The markers
then are, but for a turn, a shift and a size, where they were. That is found, and undone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from mplearn.maths.rigid_fit import fit_similarity
from mplearn.recording import FloatArray
from mplearn.state import Array, Range, complete

NEAR_M = 0.015  # median distance of markers from where they were, at which nobody has moved
SMALLEST, LARGEST = 1e-4, 1e4  # ratio of units
LIKE_PEOPLE = 0.4  # ratio of sizes from which on it cannot be another person
SAME = 0.01  # by how much, as a share, a size may differ from a power of ten to be one


@complete
@dataclass(frozen=True, eq=False)
class Axes:
    """Where a stream's markers are in the axes in which the stream began.

    Attributes:
        size: Ratio of the units.
        turn: A rotation, shape (3, 3).
        shift: Of the origin, shape (3,) [m].
    """

    size: Annotated[float, Range(1e-9, 1e9)] = 1.0
    turn: Annotated[FloatArray, Array(3, 3, low=-1.001, high=1.001)] = field(
        default_factory=lambda: np.eye(3)
    )
    shift: Annotated[FloatArray, Array(3)] = field(default_factory=lambda: np.zeros(3))

    def undo(self, frames: FloatArray) -> FloatArray:
        """Return markers, shape (..., 3), in the axes in which the stream began."""
        return np.asarray(self.size * (frames @ self.turn.T) + self.shift)

    def then(self, other: Axes) -> Axes:
        """Return both changes, this one first."""
        return Axes(
            self.size * other.size,
            other.turn @ self.turn,
            other.size * other.turn @ self.shift + other.shift,
        )


def axes_changed(now: FloatArray, before: FloatArray) -> Axes | None:
    """Return how a frame of markers lies where the one before did, if it does but for its axes.

    A similarity [Umeyama1991], fitted again without the markers that are farthest off.

    Args:
        now: Shape (M, 3), in any unit; NaN where unseen.
        before: Shape (M, 3) [m].

    Returns:
        None where the markers have moved among themselves, where too few are seen, or where the
        size differs as that of another person in the same posture may.
    """
    seen = np.flatnonzero(np.isfinite(now).all(axis=1) & np.isfinite(before).all(axis=1))
    enough = max(5, 0.6 * len(seen))
    for _ in range(4):
        if len(seen) < enough:
            return None
        if np.ptp(now[seen], axis=0).max() == 0.0:
            return None
        fit = fit_similarity(now[seen], before[seen])
        if not SMALLEST < fit.size < LARGEST:
            return None
        size, round_size = fit.size, 10.0 ** round(math.log10(fit.size))
        if abs(size / round_size - 1.0) < SAME:
            size = round_size
        elif LIKE_PEOPLE < size < 1.0 / LIKE_PEOPLE:
            return None
        shift = before[seen].mean(axis=0) - size * fit.rotation @ now[seen].mean(axis=0)
        found = Axes(size, fit.rotation, shift)
        off = np.linalg.norm(found.undo(now[seen]) - before[seen], axis=1)
        near = off <= max(2.5 * float(np.median(off)), NEAR_M)
        if near.all():
            return found if float(np.median(off)) < NEAR_M else None
        seen = seen[near]
    return None

"""One execution of a primitive: a minimum-jerk step in every channel that it moves.

The step 10 s^3 - 15 s^4 + 6 s^5 is the trajectory of least jerk between two rests [Flash1985]; its
velocity is bell-shaped. Movements that overlap in time add up, as people's do [Flash1991].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..recording import FloatArray, IntArray
from .channels import LEVERS

VISIBLE = 0.05
"""Share of its peak speed below which a movement is no longer seen to move."""

_GRID = 201


@dataclass(frozen=True, eq=False)
class Movement:
    """A primitive as it is executed once.

    Attributes:
        name: Name of the primitive.
        start_s: When it starts [s].
        end_s: When it ends [s].
        channels: Indices of the K channels that it moves, shape (K,).
        begin_s: When each of them starts, shape (K,) [s].
        duration_s: How long each of them takes, shape (K,) [s].
        step: By how much each of them changes, shape (K,).
        bump: Height of each one's passing deflection, shape (K,).
    """

    name: str
    start_s: float
    end_s: float
    channels: IntArray
    begin_s: FloatArray
    duration_s: FloatArray
    step: FloatArray
    bump: FloatArray

    def displacement(self, times_s: FloatArray) -> FloatArray:
        """Return how far the channels have moved at the given times (T,), shape (T, K)."""
        s = self._phase(times_s)
        rise = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        pulse = 64.0 * (s * (1.0 - s)) ** 3
        return np.asarray(self.step * rise + self.bump * pulse)

    def velocity(self, times_s: FloatArray) -> FloatArray:
        """Return the channels' rates at the given times (T,), shape (T, K) [1/s]."""
        s = self._phase(times_s)
        flank = (s * (1.0 - s)) ** 2
        rate = self.step * 30.0 * flank + self.bump * 192.0 * flank * (1.0 - 2.0 * s)
        return np.asarray(rate / self.duration_s)

    def _phase(self, times_s: FloatArray) -> FloatArray:
        return np.clip((times_s[:, None] - self.begin_s) / self.duration_s, 0.0, 1.0)

    def visible_s(self) -> tuple[float, float]:
        """Return when the movement is first and last seen: its speed exceeds `VISIBLE` of its peak."""
        times = np.linspace(self.start_s, self.end_s, _GRID)
        speed = np.linalg.norm(self.velocity(times) * LEVERS[self.channels], axis=1)
        seen = np.flatnonzero(speed > VISIBLE * speed.max())
        return float(times[seen[0]]), float(times[seen[-1]])


def turning_point_s(first: Movement, second: Movement) -> float:
    """Return when one movement gives way to the next [s]: the middle of a stop, or the slowest moment.

    Where the second starts after the first has ended it is the middle between them; where they overlap
    it is the moment of least speed of their sum within the overlap.
    """
    if second.start_s >= first.end_s:
        return 0.5 * (first.end_s + second.start_s)
    times = np.linspace(second.start_s, first.end_s, _GRID)
    velocity = np.zeros((_GRID, len(LEVERS)))
    velocity[:, first.channels] += first.velocity(times)
    velocity[:, second.channels] += second.velocity(times)
    return float(times[np.argmin(np.linalg.norm(velocity * LEVERS, axis=1))])

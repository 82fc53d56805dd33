"""One execution of a primitive: a minimum-jerk step in every channel that it moves.

The step 10 s^3 - 15 s^4 + 6 s^5 is the trajectory of least jerk between two rests [Flash1985]; its
velocity is bell-shaped. Movements that overlap in time add up, as people's do [Flash1991].
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mplearn.maths.easing import minimum_jerk
from mplearn.recording import FloatArray, IntArray

from .channels import CHANNELS, LEVERS


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
        rise = minimum_jerk(s)
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


def body_velocity(movements: Iterable[Movement], times_s: FloatArray) -> FloatArray:
    """Return the velocity of the movements' sum, each channel in metres of body, (T, C) [m/s]."""
    velocity = np.zeros((len(times_s), len(CHANNELS)))
    for movement in movements:
        velocity[:, movement.channels] += movement.velocity(times_s)
    return velocity * LEVERS

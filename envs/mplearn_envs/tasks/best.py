"""The best and the idle return of an episode: the scale on which every policy can be read.

All that a task pays is known when an episode begins, so the best return can be computed; 0 on the
scale is who holds from the start to the end, 1 the best.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mplearn.recording import FloatArray
from mplearn_envs.skills.repertoire import Repertoire


class Scale(NamedTuple):
    """What an episode's return can be compared with.

    Attributes:
        best: The greatest return that is possible; NaN where it is not known.
        idle: The return of holding from the start to the end.
    """

    best: float
    idle: float

    def report(self) -> dict[str, float]:
        """Return what a task's report says of it."""
        return {"best_return": self.best, "idle_return": self.idle}


UNKNOWN = Scale(math.nan, math.nan)


class Clock(NamedTuple):
    """How time is counted when rewards are summed up.

    Attributes:
        discount: Per second.
        knot_s: Between the moments that are paid for [s].
    """

    discount: float
    knot_s: float

    @classmethod
    def of(cls, repertoire: Repertoire, discount: float) -> Clock:
        """Return the clock of an environment."""
        config = repertoire.skills.planner.config
        return cls(discount, config.period_s * config.knot_steps)

    def worth(self, time_s: float) -> float:
        """Return what 1 after some time is worth now."""
        return float(self.discount**time_s)

    def held(self, time_s: float) -> float:
        """Return what 1 per second for some time is worth now, moments summed up as they are."""
        if self.discount == 1.0:
            return time_s
        step = self.discount**self.knot_s
        return float(self.knot_s * step * (1.0 - self.discount**time_s) / (1.0 - step))


def time_held(deadline_s: float, hold_s: float) -> float:
    """Return how long who only holds is at it when the deadline is over [s]."""
    return math.ceil(deadline_s / hold_s - 1e-9) * hold_s


def weights(time_s: FloatArray, discount: float) -> FloatArray:
    """Return what a reward of 1 per second at each moment adds to the discounted integral, (S,).

    Args:
        time_s: Time of the moments since the start, shape (S,) [s].
        discount: Per second.
    """
    weight = discount**time_s
    weight[1:] *= time_s[1:] - time_s[:-1]
    weight[0] *= time_s[0]
    return weight

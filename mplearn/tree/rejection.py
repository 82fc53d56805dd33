"""How near a motion of an unknown kind comes to what is known: a radius with a stated error rate.

Every known primitive was unknown once. A segment that lies in one leaf is, for all the other
leaves, a motion of an unknown kind: how near it comes to the nearest of those is what a stranger's
distance is like. The rule is that of conformal prediction [Vovk2005]: if strangers come as those
did, a new one falls below the k-th smallest of n such distances with probability k / (n + 1).
"""

from __future__ import annotations

from typing import Any

import numpy as np

REMEMBERED = 512  # strangers
LEAST = 0.1  # smallest share of the radius that rules give that is left


class Strangers:
    """The latest distances of motions to the nearest leaf but their own, in radii."""

    def __init__(self) -> None:
        self._ratios: list[float] = []

    def __len__(self) -> int:
        """Number of distances."""
        return len(self._ratios)

    def add(self, ratio: float) -> None:
        """Take one more."""
        self._ratios.append(float(ratio))
        del self._ratios[:-REMEMBERED]

    def threshold(self, rate: float) -> float:
        """Return the ratio below which a share ``rate`` of strangers falls, at least `LEAST`.

        As long as too few were seen to tell, it is the smallest of theirs, and at most 1.
        """
        k = int(rate * (len(self) + 1))
        if k < 1:
            return min(1.0, *self._ratios) if self._ratios else 1.0
        return max(LEAST, float(np.partition(self._ratios, k - 1)[k - 1]))

    def rate(self, ratio: float) -> float:
        """Return the share of strangers expected at or below a ratio; NaN before any was seen."""
        if not self._ratios:
            return float("nan")
        return (1 + sum(each <= ratio for each in self._ratios)) / (len(self) + 1)

    def state(self) -> dict[str, Any]:
        """Return everything as plain arrays."""
        return {"ratios": np.array(self._ratios)}

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned."""
        self._ratios = [float(ratio) for ratio in state["ratios"]]

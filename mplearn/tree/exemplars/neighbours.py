"""How near new segments come to known ones: where the executions of one motion end.

Round a segment lie the executions of its own motion, and beyond them those of others, whose number
grows with a power of the distance [Levina2004]. Between the two it hardly grows: there is a valley,
wide where motions are few, narrow where they are many.
"""

from __future__ import annotations

import numpy as np

from ...recording import FloatArray

N_STEPS = 20
_NEAREST, _STEP = 0.06, 1.12  # over the mean distance; each step by this factor
_EDGES = _NEAREST * _STEP ** np.arange(N_STEPS + 1)
_COPY = 0.05  # who comes nearer plays back, and says nothing of how much executions vary
_KEPT = 1 - 1 / 256  # of what is known, with each segment
_LEAST = 20.0  # neighbours that make a growth known
_ACROSS = 2  # steps over which it is taken
_HARDLY = 1.0  # growth, as a power of the distance, that says that there are no others


class Neighbours:
    """How many known segments lie within each distance of a new one; it forgets slowly.

    Attributes:
        counts: Sums over segments, by distance, shape (`N_STEPS` + 1,).

    Example:
        >>> import numpy as np
        >>> near = Neighbours()
        >>> for _ in range(20):  # executions up to 0.2, other motions from 0.4 on
        ...     near.update(np.concatenate([np.linspace(0.1, 0.2, 9), np.linspace(0.4, 2, 60)]))
        >>> 0.2 < near.valley(1.05) < 0.42
        True
    """

    def __init__(self) -> None:
        self.counts = np.zeros(N_STEPS + 1)
        self._found: tuple[FloatArray, float, float] | None = None  # of these counts and this rise

    def update(self, distances: FloatArray) -> None:
        """Take the distances of a new segment to known ones, over the mean of all, shape (k,)."""
        within = np.searchsorted(np.sort(distances[distances > _COPY]), _EDGES)
        self.counts = _KEPT * self.counts + within

    def valley(self, rise: float) -> float:
        """Return the distance up to which motions are the same, over the mean of all.

        Args:
            rise: Growth over the smallest growth from which on others are near.

        Returns:
            The farthest that was looked at while too little is known.
        """
        found = self._found
        if found is None or found[0] is not self.counts or found[1] != rise:
            found = self._found = self.counts, rise, self._valley(rise)
        return found[2]

    def _valley(self, rise: float) -> float:
        inner, outer = self.counts[:-_ACROSS], self.counts[_ACROSS:]
        known = inner >= _LEAST
        if not known.any():
            return float(_EDGES[-1])
        growth = np.full(len(inner), np.inf)
        growth[known] = np.log(outer[known] / inner[known]) / (_ACROSS * np.log(_STEP))
        low = np.flatnonzero(growth <= max(_HARDLY, rise * growth.min()))
        return float(_EDGES[low[-1] + _ACROSS])

"""How near a motion of an unknown kind comes to what is known: a radius with a stated error rate.

Every known primitive was unknown once. For the exemplars of a leaf the other leaves are what is
known: how near they come to the nearest of those, in units of how far that leaf's own exemplars lie
apart, is what an impostor's distance is like. The rule is that of conformal prediction [Vovk2005],
over leaves and not over exemplars, for executions of one motion come equally near [Dunn2023]: where
a share s_k of the exemplars of leaf k comes nearer than t, an impostor does with a probability of
(1 + sum of s_k) / (K + 1) at most. It is 2 / (K + 1) at the nearest that was seen, for who comes
nearer than anyone makes an impostor of a leaf as well. A smaller rate lies beyond that; down there
the probability falls with the third power of t, as it does where motions fill three dimensions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..recording import FloatArray
from .exemplars.bank import ExemplarBank
from .nodes.search import NodeIndex, mean_nearest

DIMENSIONS = 3.0  # nearest neighbours among people's motions tell of 2.3 to 5.5
_PAIR = 2.0
_SHARED = 6.0  # exemplars that the spread all leaves share counts for beside a leaf's own


class Impostors:
    """How near motions come to primitives that are not theirs.

    Args:
        distances: Of each primitive, how near its exemplars come to another, shape (k,) each.
    """

    def __init__(self, distances: Sequence[FloatArray]) -> None:
        seen = [each for each in distances if len(each)]
        order = np.argsort(np.concatenate([np.zeros(0), *seen]), kind="stable")
        shares = [np.full(len(each), 1 / len(each)) for each in seen]
        self._n_leaves = len(seen)
        self._distances = np.concatenate([np.zeros(0), *seen])[order]
        sums = 1 + np.cumsum(np.concatenate([np.zeros(0), *shares])[order])
        self._expected = np.maximum(_PAIR, sums)

    @classmethod
    def of(cls, index: NodeIndex, bank: ExemplarBank, units: FloatArray) -> Impostors:
        """Return those of all leaves of an index, in a unit of each node, shape (n,)."""
        unit = dict(zip(index.ids.tolist(), units.tolist(), strict=True))
        found = []
        for id, is_leaf, members in zip(index.ids, index.leaves, index.members, strict=True):
            near = [index.others(bank[n], bank, int(id)) for n in members] if is_leaf else []
            found.append(
                [
                    min(float(bank.distance.length(m.distance)) / unit[m.node] for m in each)
                    for each in near
                    if each
                ]
            )
        return cls([np.array(each) for each in found])

    def threshold(self, rate: float) -> float:
        """Return the distance within which a share ``rate`` of impostors comes at most.

        It is inf where there was none.
        """
        if not self._n_leaves:
            return float("inf")
        allowed = rate * (self._n_leaves + 1)
        if allowed < _PAIR:
            return float(self._distances[0] * (allowed / _PAIR) ** (1 / DIMENSIONS))
        within = int(np.searchsorted(self._expected, allowed, side="right"))
        return float(self._distances[min(within, len(self._distances) - 1)])

    def rate(self, distance: float) -> float:
        """Return the largest share of impostors expected nearer than that; NaN if none was seen."""
        if not self._n_leaves:
            return float("nan")
        below = int(np.searchsorted(self._distances, distance, side="left"))
        if below:
            return min(1.0, float(self._expected[below - 1] / (self._n_leaves + 1)))
        beyond = (distance / self._distances[0]) ** DIMENSIONS if distance > 0 else 0.0
        return min(1.0, float(_PAIR * beyond / (self._n_leaves + 1)))


def spreads(index: NodeIndex, bank: ExemplarBank) -> FloatArray:
    """Return how far the exemplars of each node lie apart, shape (n,).

    It is the mean distance of an exemplar to the others, as that of a segment to a node is taken,
    drawn towards that of all nodes where there are few.
    """
    inside = []
    for members in index.members:
        apart = bank.matrix(members) + np.diag(np.full(len(members), np.inf))
        n_nearest = min(index.config.n_nearest, len(members) - 1)
        inside.append(mean_nearest(apart, n_nearest) if n_nearest else np.zeros(0))
    shared = float(np.mean([each.mean() for each in inside if len(each)] or [0.0]))
    drawn = [(each.sum() + _SHARED * shared) / (len(each) + _SHARED) for each in inside]
    return np.asarray(np.maximum(drawn, 1e-12))

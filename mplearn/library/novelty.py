"""How unlike everything known a motion is, and how often a known motion would be as unlike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..maths.compiling import njit
from ..recording import FloatArray, IntArray
from ..tree.nodes.search import nearest_others

if TYPE_CHECKING:
    from ..tree import Recogniser

_SHARED = 6.0  # exemplars that the scale all primitives share counts for beside a primitive's own


class AnomalyScore(NamedTuple):
    """How far out of the ordinary something is.

    Attributes:
        score: The farther the larger. Of a motion: its distance to the nearest primitive over what
            is usual there. Of a transition: its surprise, -log of its probability [nat].
        p_value: Share of what was learned that is at least as far out, in (0, 1]: alarms at
            ``p_value <= a`` are false at a rate of about a.

    Example:
        >>> usual = AnomalyScore(score=0.9, p_value=0.62)
        >>> usual.p_value <= 0.01  # an alarm that is false once in a hundred motions
        False
    """

    score: float
    p_value: float


class MotionNovelty:
    """Holds distances to primitives against those among a primitive's own exemplars.

    What is usual in a primitive is the mean distance of its exemplars to the nearest others of it,
    drawn towards the mean over all primitives where it has few. The same distances, each over what
    is usual without it, are the ranks that a p-value is read from: conformal [Vovk2005], each
    exemplar left out of what it is held against.

    Args:
        matrices: Distances among the exemplars of each primitive, shape (k, k), on the scale of the
            tree's rules.
        n_nearest: A motion's distance to a primitive is the mean of that to so many exemplars.

    Example:
        >>> import numpy as np
        >>> apart = np.full((20, 20), 0.1)  # distances among 20 executions of primitive 7
        >>> np.fill_diagonal(apart, 0.0)
        >>> novelty = MotionNovelty({7: apart}, n_nearest=2)
        >>> known, other = novelty.score([(7, 0.1)]), novelty.score([(7, 2.0)])
        >>> known.p_value > 0.5, other.score > 10 * known.score, other.p_value < 0.05
        (True, True, True)
    """

    def __init__(self, matrices: Mapping[int, FloatArray], n_nearest: int) -> None:
        several = {id: matrix for id, matrix in matrices.items() if len(matrix) > 1}
        apart = np.full((len(several), max(map(len, several.values()), default=0)), np.nan)
        for row, matrix in zip(apart, several.values(), strict=True):
            row[: len(matrix)] = nearest_others(matrix, n_nearest)
        self._hold(np.array(list(several), np.int64), apart)

    @classmethod
    def of(cls, ids: IntArray, apart: FloatArray) -> MotionNovelty:
        """Return what holds distances against those of exemplars to the nearest others.

        Args:
            ids: Primitives, shape (n,).
            apart: Of each exemplar, the mean distance to the ``n_nearest`` others of its primitive,
                shape (n, K); NaN where there are fewer.
        """
        novelty = cls({}, 1)
        novelty._hold(ids, apart)
        return novelty

    def _hold(self, ids: IntArray, apart: FloatArray) -> None:
        order = np.argsort(ids)
        self._ids, apart = ids[order], apart[order]
        total, n = _sums(apart)
        some = n > 0
        shared = float(np.mean(total[some] / n[some])) if some.any() else 0.0
        self._shared = max(shared, 1e-12)
        self._usual = (total + _SHARED * self._shared) / (n + _SHARED)
        self._ranks = _ranks(apart, total, n, self._shared)

    def score(self, distances: Iterable[tuple[int, float]]) -> AnomalyScore:
        """Score a motion.

        Args:
            distances: Primitives and the distances to them, on the scale of the tree's rules.

        Returns:
            Its score is infinite where there is nothing to compare with.
        """
        score = min((d / self._usual_of(id) for id, d in distances), default=np.inf)
        as_large = np.count_nonzero(self._ranks >= score)
        return AnomalyScore(float(score), float((1 + as_large) / (1 + len(self._ranks))))

    def _usual_of(self, id: int) -> float:
        k = int(np.searchsorted(self._ids, id))
        return float(self._usual[k]) if id in self._ids[k : k + 1] else self._shared


@njit(cache=True)
def _sums(apart: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the sum of each row (n, K) but for NaN, and of how many, shape (n,) each."""
    total, n = np.zeros(len(apart)), np.zeros(len(apart), np.int64)
    for i, row in enumerate(apart):
        for value in row:
            if not np.isnan(value):
                total[i] += value
                n[i] += 1
    return total, n


@njit(cache=True)
def _ranks(apart: FloatArray, total: FloatArray, n: IntArray, shared: float) -> FloatArray:
    """Return each distance that is no NaN over what is usual without it, row after row."""
    ranks, k = np.empty(n.sum()), 0
    for i, row in enumerate(apart):
        for value in row:
            if not np.isnan(value):
                usual = (total[i] - value + _SHARED * shared) / (n[i] - 1 + _SHARED)
                ranks[k] = value / usual
                k += 1
    return ranks


def novelty_of(recogniser: Recogniser) -> MotionNovelty:
    """Return what the motions that a recogniser knows are held against."""
    return MotionNovelty(recogniser.matrices(), recogniser.config.n_nearest)

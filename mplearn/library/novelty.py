"""How unlike everything known a motion is, and how often a known motion would be as unlike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..recording import FloatArray

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
    """

    def __init__(self, matrices: Mapping[int, FloatArray], n_nearest: int) -> None:
        inside = {id: _left_out(matrix, n_nearest) for id, matrix in matrices.items()}
        inside = {id: distances for id, distances in inside.items() if len(distances)}
        shared = float(np.mean([d.mean() for d in inside.values()])) if inside else 0.0
        self._shared = max(shared, 1e-12)
        self._usual = {id: self._scale(d.sum(), len(d)) for id, d in inside.items()}
        scores = [d / self._scale(d.sum() - d, len(d) - 1) for d in inside.values()]
        self._ranks = np.sort(np.concatenate(scores)) if scores else np.zeros(0)

    def score(self, distances: Iterable[tuple[int, float]]) -> AnomalyScore:
        """Score a motion.

        Args:
            distances: Primitives and the distances to them, on the scale of the tree's rules.

        Returns:
            Its score is infinite where there is nothing to compare with.
        """
        score = min((d / self._usual.get(id, self._shared) for id, d in distances), default=np.inf)
        as_large = len(self._ranks) - np.searchsorted(self._ranks, score, side="left")
        return AnomalyScore(float(score), float((1 + as_large) / (1 + len(self._ranks))))

    def _scale(self, total: FloatArray | float, n: int) -> FloatArray:
        return np.asarray((total + _SHARED * self._shared) / (n + _SHARED))


def novelty_of(recogniser: Recogniser) -> MotionNovelty:
    """Return what the motions that a recogniser knows are held against."""
    return MotionNovelty(recogniser.matrices(), recogniser.config.n_nearest)


def _left_out(matrix: FloatArray, n_nearest: int) -> FloatArray:
    """Return the distance of each exemplar to the nearest others, shape (k,); empty for one."""
    if len(matrix) < 2:
        return np.zeros(0)
    apart = np.array(matrix, dtype=np.float64)
    np.fill_diagonal(apart, np.inf)
    nearest = np.sort(apart, axis=1)[:, : min(n_nearest, len(apart) - 1)]
    return np.asarray(nearest.mean(axis=1))

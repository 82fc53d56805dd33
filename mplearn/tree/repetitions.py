"""What comes nearest to a primitive among the segments that wait: why there is none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..recording import FloatArray
from .nodes.clustering import clusters_below

_ALIKE = 1.5  # times the scale up to which segments may be meant as one motion


class Repetition(NamedTuple):
    """The motion that came most often among those that are no primitive.

    Attributes:
        n_unplaced: Segments that wait to become part of a primitive; no fragments of known ones.
        times: How often it came; 1 where no two are alike.
        apart: Largest distance between its executions, or to the nearest other motion where it came
            once, over what a primitive may have; inf where nothing else was seen.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> placed = tree.insert(np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5]))
        >>> found = tree.most_repeated()
        >>> found.n_unplaced, found.times
        (1, 1)
    """

    n_unplaced: int
    times: int
    apart: float


def most_repeated(matrix: FloatArray, scale: float) -> Repetition:
    """Find it.

    Args:
        matrix: Distances among the segments that wait, shape (n, n).
        scale: Largest distance within a cluster that becomes a primitive.
    """
    n = len(matrix)
    groups = clusters_below(matrix, _ALIKE * scale, 2)
    if groups:
        largest = max(groups, key=len)
        return Repetition(n, len(largest), _over(matrix[np.ix_(largest, largest)].max(), scale))
    apart = matrix + np.diag(np.full(n, np.inf))
    return Repetition(n, min(n, 1), _over(apart.min(initial=np.inf), scale))


def _over(distance: float, scale: float) -> float:
    return float(distance) / scale if scale > 0 else float("inf")

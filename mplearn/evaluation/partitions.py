"""How well two partitions of a stream into activities agree, frame by frame.

Adjusted Rand index and normalised mutual information do not care for names; covering is that of
[Arbelaez2011], change points are matched one to one within a share of the stream's length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidValueError
from ..recording import FloatArray
from .boundaries import Boundary, match_boundaries

Labels = NDArray[Any]


@dataclass(frozen=True)
class Agreement:
    """Agreement of a found partition with the true one.

    Attributes:
        ari: Adjusted Rand index; 1 for equal partitions, 0 expected by chance.
        nmi: Mutual information over the mean of the entropies, in [0, 1].
        covering: Mean over frames of the best IoU of its true stretch with a found one, in [0, 1].
        change_f1: F1 of the change points.
        n_true: Classes of the truth.
        n_found: Classes found.
    """

    ari: float
    nmi: float
    covering: float
    change_f1: float
    n_true: int
    n_found: int


def agreement(truth: Labels, found: Labels, tolerance: float = 0.01) -> Agreement:
    """Compare two partitions.

    Args:
        truth: Class of each frame, shape (T,).
        found: The same, of any names, shape (T,).
        tolerance: Largest distance of matching change points, as a share of T.

    Raises:
        InvalidValueError: They have different lengths, or none.
    """
    if len(truth) != len(found) or not len(truth):
        raise InvalidValueError(
            f"partitions must have equal lengths, not {len(truth)} and {len(found)}"
        )
    table = _contingency(truth, found)
    changes = [np.flatnonzero(each[1:] != each[:-1]) + 1 for each in (truth, found)]
    true, other = ([Boundary(int(at), int(at)) for at in each] for each in changes)
    pairs = match_boundaries(true, other, round(tolerance * len(truth)))
    total = len(changes[0]) + len(changes[1])
    return Agreement(
        _adjusted_rand(table),
        _mutual_information(table),
        _covering(changes[0], changes[1], len(truth)),
        2 * len(pairs) / total if total else 1.0,
        *table.shape,
    )


def adjusted_rand(one: Labels, other: Labels) -> float:
    """Return the adjusted Rand index of two partitions of the same things, shape (n,) each."""
    return _adjusted_rand(_contingency(one, other))


def _contingency(truth: Labels, found: Labels) -> FloatArray:
    rows, columns = (np.unique(each, return_inverse=True)[1] for each in (truth, found))
    table = np.zeros((rows.max() + 1, columns.max() + 1))
    np.add.at(table, (rows, columns), 1.0)
    return table


def _adjusted_rand(table: FloatArray) -> float:
    def two(counts: FloatArray) -> float:
        return float((counts * (counts - 1) / 2).sum())

    both, rows, columns = two(table), two(table.sum(axis=1)), two(table.sum(axis=0))
    expected = rows * columns / max(two(table.sum()[None]), 1.0)
    best = (rows + columns) / 2
    return 1.0 if best == expected else (both - expected) / (best - expected)


def _mutual_information(table: FloatArray) -> float:
    def entropy(counts: FloatArray) -> float:
        share = counts[counts > 0] / counts.sum()
        return float(-(share * np.log(share)).sum())

    rows, columns = entropy(table.sum(axis=1)), entropy(table.sum(axis=0))
    mutual = rows + columns - entropy(table.ravel())
    return 1.0 if rows + columns == 0 else max(0.0, 2 * mutual / (rows + columns))


def _covering(truth: NDArray[np.int64], found: NDArray[np.int64], n: int) -> float:
    stretches = [np.stack([[0, *each], [*each, n]], axis=1) for each in (truth, found)]
    total = 0.0
    for start, end in stretches[0]:
        common = np.minimum(end, stretches[1][:, 1]) - np.maximum(start, stretches[1][:, 0])
        union = np.maximum(end, stretches[1][:, 1]) - np.minimum(start, stretches[1][:, 0])
        total += (end - start) * float((np.maximum(common, 0) / union).max())
    return float(total / n)

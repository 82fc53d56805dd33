"""Where one activity ends and another begins: stretches of time that keep their links.

A posture is linked to its nearest ones a little earlier and later. While an activity goes on, its
postures come back, so links stay inside; few cross from one activity to the next [Gharghabi2017].
The stretches are those that hold most links over what they would by chance: the modularity of
consecutive stretches, with links spread evenly over the reach as the null model. So neither the
period of a motion nor the length of the recording matters, and the number of stretches need not be
given; the best ones are found exactly, by dynamic programming.
"""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray
from .distances import rounding, squared_distances

_ROWS = 128


def band_of_links(
    points: FloatArray, apart: int, reach: int, count: int, recurrence: float
) -> FloatArray:
    """Return how much more than by chance points are linked to earlier ones.

    Args:
        points: Shape (n, D).
        apart: Points at most so far apart are not linked.
        reach: Points further apart are not linked either.
        count: Number of the nearest points that each is linked to; all its links sum up to 1.
        recurrence: Weight of the null model.

    Returns:
        Shape (n, reach + 1): entry (v, d) is that of the points v and v - d, both ways.
    """
    n, unit = len(points), rounding(points)
    band = np.zeros((n, reach + 1))
    for first in range(0, n, _ROWS):
        rows = np.arange(first, min(n, first + _ROWS))
        columns = np.arange(max(0, first - reach), min(n, rows[-1] + reach + 1))
        gap = np.abs(rows[:, None] - columns)
        allowed = (gap > apart) & (gap <= reach)
        distances = np.where(
            allowed, squared_distances(points[rows], points[columns], unit), np.inf
        )
        kth = min(count, len(columns)) - 1
        near = allowed & (distances <= np.partition(distances, kth, axis=1)[:, kth : kth + 1])
        links = near / np.maximum(near.sum(axis=1, keepdims=True), 1)  # ties share
        links -= recurrence / np.maximum(allowed.sum(axis=1, keepdims=True), 1)
        i, j = np.nonzero(allowed)
        np.add.at(band, (np.maximum(rows[i], columns[j]), gap[i, j]), links[i, j])
    return band


def best_stretches(band: FloatArray, least: int) -> list[int]:
    """Return the starts of the stretches whose links sum up to most, 0 first.

    Args:
        band: As from `band_of_links`, shape (n, reach + 1).
        least: Length of the shortest stretch.
    """
    n, width = band.shape
    inside = np.zeros(n + 1)  # links inside [i, v), for all i
    best = np.full(n + 1, -np.inf)
    best[0] = 0.0
    since = np.zeros(n + 1, dtype=np.int64)
    for v in range(n):
        to_earlier = band[v].cumsum()
        near = max(0, v - width + 1)
        inside[near : v + 1] += to_earlier[v - near :: -1]
        inside[:near] += to_earlier[-1]
        if v + 1 >= least:
            total = best[: v + 2 - least] + inside[: v + 2 - least]
            since[v + 1] = total.argmax()
            best[v + 1] = total[since[v + 1]]
    starts = [int(since[n])]
    while starts[-1] > 0:
        starts.append(int(since[starts[-1]]))
    return starts[::-1]

"""Which stretches are one activity: those whose postures mix.

Two stretches are put together and the nearest neighbours of each posture are looked for. If both
are the same activity, they lie in either stretch as often as its length says; if not, each stays
among its own. This is a two-sample test by nearest neighbours [Schilling1986].
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..recording import BoolArray, FloatArray, IntArray
from .distances import rounding, squared_distances

_ROWS = 256


def group(
    points: FloatArray, starts: Sequence[int], apart: int, count: int, mixing: float
) -> IntArray:
    """Return which activity each stretch belongs to, numbered by first appearance.

    The two that mix best are joined, again and again, while they mix enough.

    Args:
        points: Shape (n, D).
        starts: Start of each of the m stretches, 0 first.
        apart: Points at most so far apart in time are no neighbours.
        count: Number of neighbours.
        mixing: Share of even mixing at which two stretches are one activity.

    Returns:
        Shape (m,).
    """
    m, n = len(starts), len(points)
    near = nearest_in_each(points, starts, apart, count)
    of_point = np.repeat(np.arange(m), np.diff([*starts, n]))
    of_stretch = np.arange(m)
    mixed = np.full((m, m), -np.inf)
    for a in range(m):
        for b in range(a):
            mixed[a, b] = mixed[b, a] = _mixed(near, of_point, apart, a, b)
    while m > 1 and mixed.max() >= mixing:
        b, a = sorted(int(i) for i in np.unravel_index(mixed.argmax(), mixed.shape))
        both = np.concatenate((near[:, a], near[:, b]), axis=1)
        near[:, b] = np.sort(both, axis=1)[:, :count]
        of_point[of_point == a] = b
        of_stretch[of_stretch == a] = b
        mixed[a] = mixed[:, a] = -np.inf
        for other in np.unique(of_stretch):
            if other != b:
                mixed[other, b] = mixed[b, other] = _mixed(near, of_point, apart, int(other), b)
    return np.unique(of_stretch, return_inverse=True)[1]


def nearest_in_each(
    points: FloatArray, starts: Sequence[int], apart: int, count: int
) -> NDArray[np.float32]:
    """Return the distances of each point to its nearest ones in each stretch, squared.

    Returns:
        Shape (n, m, count), increasing; inf where a stretch has fewer points.
    """
    n, ends, unit = len(points), [*starts[1:], len(points)], rounding(points)
    near = np.full((n, len(starts), count), np.inf, dtype=np.float32)
    for first in range(0, n, _ROWS):
        rows = np.arange(first, min(n, first + _ROWS))
        distances = squared_distances(points[rows], points, unit)
        distances[np.abs(rows[:, None] - np.arange(n)) <= apart] = np.inf
        for k, (start, end) in enumerate(zip(starts, ends, strict=True)):
            ordered = np.sort(distances[:, start:end], axis=1)[:, :count]
            near[rows, k, : ordered.shape[1]] = ordered
    return near


def _mixed(near: NDArray[np.float32], of_point: IntArray, apart: int, a: int, b: int) -> float:
    """Return how far the points of a and b are mixed: 0 not at all, 1 evenly; the lesser side."""
    return min(_strayed(near, of_point, apart, a, b), _strayed(near, of_point, apart, b, a))


def _strayed(
    near: NDArray[np.float32], of_point: IntArray, apart: int, own: int, other: int
) -> float:
    """Return the share of the neighbours of a stretch that lie in another, over the even one."""
    rows = np.flatnonzero(of_point == own)
    n_own, n_other = (_eligible(of_point == each, rows, apart) for each in (own, other))
    count = max(1, min(near.shape[2], int((n_own + n_other).min())))
    mine, theirs = near[rows, own], near[rows, other]
    kth = np.sort(np.concatenate((mine, theirs), axis=1), axis=1)[:, count - 1 : count]
    nearer, tied = (theirs < kth).sum(axis=1), (theirs == kth).sum(axis=1)
    left = count - nearer - (mine < kth).sum(axis=1)
    found = (nearer + left * tied / (tied + (mine == kth).sum(axis=1))).sum() / count
    return float(found / (n_other / np.maximum(n_own + n_other, 1)).sum())


def _eligible(members: BoolArray, rows: IntArray, apart: int) -> IntArray:
    """Return how many members are far enough in time from each of the rows."""
    before = np.concatenate(([0], members.cumsum()))
    near = before[np.minimum(rows + apart + 1, len(members))] - before[np.maximum(rows - apart, 0)]
    return np.asarray(before[-1] - near)

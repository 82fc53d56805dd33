"""Distances between sliding windows of data, each seen as a Parzen density, kept up to date.

The integrated square error between two densities of Gaussian kernels, eq. 1-2 of [Kulic2012], has
a closed form. With k(x, y) = exp(-|x - y|^2 / 4 sigma^2) and G(s, t) the sum of k over all pairs of
points of the windows that end at s and t,

    d(s, t) = [G(s, s) - 2 G(s, t) + G(t, t)] / W^2

up to the factor (4 pi sigma^2)^(-n/2), which is left out: it is the same for all windows, and for
any realistic n it over- or underflows. What remains lies in [0, 2].

A new point costs one kernel evaluation for each point kept, since the row sums
R_i(t) = sum_v k(i, t - v) follow from R_i(t - 1), and G(s, t) is a sliding sum of them over s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..maths.compiling import njit
from ..recording import FloatArray


class Windows(NamedTuple):
    """Sliding windows of W points, in a ring of P: time t lies at slot ``t % P``.

    Attributes:
        points: The latest points, shape (n, P).
        kernel_rows: k(i, u) for the last W times u, shape (W, P).
        row_sums: R_i, shape (P,).
        self_sums: G(s, s), shape (P,).
        squared: |x_i - x_t|^2, shape (P,).
        distances: d(s, t), valid for the windows in the ring, shape (P,).
    """

    points: FloatArray
    kernel_rows: FloatArray
    row_sums: FloatArray
    self_sums: FloatArray
    squared: FloatArray
    distances: FloatArray


def new_windows(n_dims: int, length: int, count: int) -> Windows:
    """Allocate what `push_point` works on, for `count` windows of `length` points."""
    size = count + length
    rows = np.zeros((length, size))
    return Windows(np.zeros((n_dims, size)), rows, *(np.zeros(size) for _ in range(4)))


@njit(cache=True)
def squared_distances(
    x: FloatArray, weights: FloatArray, points: FloatArray, squared: FloatArray
) -> None:
    """Write the weighted |x_i - x|^2 for every point of the ring into `squared`.

    The weights of the D channels hold for each frame that makes up a point of n = m D values.
    """
    squared[:] = 0.0
    for k in range(points.shape[0]):
        value = x[k]
        weight = weights[k % weights.shape[0]]
        row = points[k]
        for i in range(row.shape[0]):  # over points: this vectorises without reordering any sum
            difference = row[i] - value
            squared[i] += weight * difference * difference


@njit(cache=True)
def push_point(x: FloatArray, weights: FloatArray, t: int, sigma: float, windows: Windows) -> None:
    """Add the point of time t, shape (n,), and write d(s, t) for all windows s into `distances`.

    Where the weights of the channels change, kernels keep those of their newer point.
    The windows are complete from t = W - 1 on; `distances` holds those that end in
    [max(W - 1, t - P + W), t], each at slot ``s % P``.
    """
    points, kernel_rows, row_sums, self_sums, squared, distances = windows
    size = points.shape[1]
    length = kernel_rows.shape[0]
    slot = t % size
    for k in range(points.shape[0]):
        points[k, slot] = x[k]
    squared_distances(x, weights, points, squared)
    scale = -0.25 / (sigma * sigma)
    row = kernel_rows[t % length]
    for i in range(size):
        value = math.exp(scale * squared[i])
        row_sums[i] += value - row[i]
        row[i] = value
    total = 0.0
    for v in range(min(length, t + 1)):
        value = row[(t - v) % size]
        total += value
        kernel_rows[(t - v) % length, slot] = value
    row_sums[slot] = total
    if t < length - 1:
        return
    newest = 0.0
    for v in range(length):
        newest += row_sums[(t - v) % size]
    self_sums[slot] = newest
    first = max(length - 1, t - size + length)
    between = 0.0
    for i in range(first - length + 1, first + 1):
        between += row_sums[i % size]
    head, tail = first % size, (first - length + 1) % size
    norm = 1.0 / (length * length)
    for _ in range(t - first + 1):
        distances[head] = max(0.0, (self_sums[head] - 2.0 * between + newest) * norm)
        between -= row_sums[tail]
        head = head + 1 if head + 1 < size else 0
        tail = tail + 1 if tail + 1 < size else 0
        between += row_sums[head]
    distances[slot] = 0.0

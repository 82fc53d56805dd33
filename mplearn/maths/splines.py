"""Cubic splines through equidistant knots."""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray
from .compiling import njit


def interpolate(knots: FloatArray, places: FloatArray) -> FloatArray:
    """Return a cubic spline through knots at 0, 1, ..., K - 1, at any places between.

    The third derivative is continuous at the second knot and at the last but one ("not a knot").
    Through three knots passes a parabola, through two a line.

    Args:
        knots: Shape (K, D), K >= 1.
        places: Where the spline is wanted, shape (T,), in [0, K - 1].

    Returns:
        Values, shape (T, D).

    Example:
        >>> squares = np.arange(6.0)[:, None] ** 2
        >>> interpolate(squares, np.array([2.5, 3.5])).round(9)
        array([[ 6.25],
               [12.25]])
    """
    own = np.array(knots, dtype=np.float64)  # writable: one form to be compiled for
    return np.asarray(spline_values(own, curvatures(own), places))


@njit(cache=True)
def curvatures(knots: FloatArray) -> FloatArray:
    """Return the second derivative of the spline at each knot, shape (K, D)."""
    n, n_channels = knots.shape
    bends = np.zeros((n, n_channels))
    if n < 3:
        return bends
    for k in range(1, n - 1):
        for d in range(n_channels):
            bends[k, d] = knots[k - 1, d] - 2.0 * knots[k, d] + knots[k + 1, d]
    # the second and the last but one are their second differences, as their neighbours lie on a
    # line; between them m[k-1] + 4 m[k] + m[k+1] = 6 (second difference), by elimination
    share = np.zeros(n)
    for k in range(2, n - 2):
        share[k] = 1.0 / (4.0 - share[k - 1])
        for d in range(n_channels):
            bends[k, d] = share[k] * (6.0 * bends[k, d] - bends[k - 1, d])
    for k in range(n - 3, 1, -1):
        for d in range(n_channels):
            bends[k, d] -= share[k] * bends[k + 1, d]
    if n == 3:
        bends[0], bends[2] = bends[1], bends[1]
    else:
        bends[0] = 2.0 * bends[1] - bends[2]
        bends[n - 1] = 2.0 * bends[n - 2] - bends[n - 3]
    return bends


@njit(cache=True)
def spline_values(knots: FloatArray, bends: FloatArray, places: FloatArray) -> FloatArray:
    """Return the spline of knots and their `curvatures` at places, shape (T, D)."""
    values = np.empty((places.shape[0], knots.shape[1]))
    for t in range(places.shape[0]):
        fill_in(knots, bends, places[t], values[t])
    return values


@njit(cache=True)
def fill_in(knots: FloatArray, bends: FloatArray, place: float, value: FloatArray) -> None:
    """Fill in the value, shape (D,), of the spline of knots and their `curvatures` at a place."""
    k = min(int(place), max(knots.shape[0] - 2, 0))
    after = min(k + 1, knots.shape[0] - 1)
    b = place - k
    a = 1.0 - b
    c, e = (a * a * a - a) / 6.0, (b * b * b - b) / 6.0
    left, right, at_left, at_right = knots[k], knots[after], bends[k], bends[after]
    for d in range(knots.shape[1]):
        value[d] = a * left[d] + b * right[d] + c * at_left[d] + e * at_right[d]

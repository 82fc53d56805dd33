"""Smooth joins and smooth paths between knots."""

from __future__ import annotations

import numpy as np

from mplearn.recording import FloatArray


def fading(time: FloatArray, over_s: float, gap: FloatArray, rate: FloatArray) -> FloatArray:
    """Return the quintic that starts at ``gap`` with velocity ``rate`` and ends at rest in zero."""
    x = np.minimum(time / over_s, 1.0)[:, None]
    left = 1.0 - x
    return np.asarray(left**3 * (gap * (1 + 3 * x + 6 * x**2) + rate * over_s * x * (1 + 3 * x)))


def refine(knots: FloatArray, knot_s: float, n_steps: int) -> tuple[FloatArray, FloatArray]:
    """Interpolate by cubic Hermite splines with the knots' central differences.

    Args:
        knots: Positions at the knots, shape (K + 1, n), K >= 2.
        knot_s: Time between knots [s].
        n_steps: Steps from knot to knot.

    Returns:
        Positions and velocities at the steps after the first knot, each of shape (K n_steps, n).
    """
    slope = np.gradient(knots, axis=0, edge_order=2)
    x = np.arange(1, n_steps + 1)[:, None] / n_steps
    basis = np.hstack(
        (2 * x**3 - 3 * x**2 + 1, x**3 - 2 * x**2 + x, 3 * x**2 - 2 * x**3, x**3 - x**2)
    )
    change = np.hstack((6 * x**2 - 6 * x, 3 * x**2 - 4 * x + 1, 6 * x - 6 * x**2, 3 * x**2 - 2 * x))
    corners = np.stack((knots[:-1], slope[:-1], knots[1:], slope[1:]), axis=1)  # (K, 4, n)
    shape = (-1, knots.shape[1])
    return (basis @ corners).reshape(shape), (change @ corners).reshape(shape) / knot_s

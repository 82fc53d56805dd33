"""The COG's path for a wanted zero-moment point: a linear inverted pendulum, planned whole.

Least squares on the zero-moment point's error and the jerk (as preview control [Kajita2014], with
the whole future known and both ends given): normal equations with seven bands, linear in time.
"""

from __future__ import annotations

import numpy as np

from mplearn.maths.compiling import inlined, njit
from mplearn.recording import FloatArray

from .support import GRAVITY

JERK_WEIGHT = 1e-6  # [s^6]: a jerk of 1 m/s^3 is as bad as a zero-moment point 1 mm off


@njit(cache=True)
def plan_cog(
    zmp: FloatArray, start: FloatArray, end: FloatArray, settled: bool, height: float, dt: float
) -> FloatArray:
    """Return the COG's path that fits a wanted zero-moment point best, at rest at both ends.

    Args:
        zmp: Wanted points, shape (K + 1, 2), K >= 4 [m].
        start: Where the COG rests at first, shape (2,) [m].
        end: Where it shall rest at last, shape (2,) [m].
        settled: Whether it must rest just there; otherwise it rests where the fit is best.
        height: Height of the COG over the ground [m].
        dt: Time between the points [s].

    Returns:
        The path, shape (K + 1, 2) [m].
    """
    n = zmp.shape[0] - 1  # unknown are places 1 .. n - 1, and n where the end is free
    size = n - 1 if settled else n
    bands, right = np.zeros((4, size)), np.zeros((size, 2))
    lean = height / GRAVITY / (dt * dt)
    jerk = np.sqrt(JERK_WEIGHT) / (dt * dt * dt)
    fit = (-lean, 1.0 + 2.0 * lean, -lean, 0.0)
    rough = (-jerk, 3.0 * jerk, -3.0 * jerk, jerk)
    known, row = np.zeros(2), np.zeros(4)
    for k in range(-1, n + 2):
        for which in range(2):
            if which == 0 and (k < 1 or k > n):
                continue
            for axis in range(2):
                known[axis] = zmp[k, axis] if which == 0 else 0.0
            row[:] = 0.0
            first = min(max(k - 1, 1), size) - 1  # unknown that row[0] belongs to
            for i in range(4):
                weight = fit[i] if which == 0 else rough[i]
                place = k - 1 + i
                if place <= 0:
                    known -= weight * start
                elif settled and place >= n:
                    known -= weight * end
                else:
                    row[min(place, n) - 1 - first] += weight
            for i in range(4):
                if row[i] == 0.0:
                    continue
                right[first + i] += row[i] * known
                for j in range(i + 1):
                    bands[i - j, first + j] += row[i] * row[j]
    _solve_banded(bands, right)
    out = np.empty((n + 1, 2))
    out[0], out[n] = start, end
    out[1 : size + 1] = right
    return out


@inlined
def _solve_banded(bands: FloatArray, right: FloatArray) -> None:
    """Solve a symmetric system in place; ``bands[d, i]`` is its element (i + d, i). Cholesky."""
    n = bands.shape[1]
    for i in range(n):
        for d in range(min(3, i), -1, -1):  # element (i, i - d)
            j = i - d
            total = bands[d, j]
            for k in range(max(0, i - 3), j):
                total -= bands[i - k, k] * bands[j - k, k]
            bands[d, j] = np.sqrt(total) if d == 0 else total / bands[0, j]
        for k in range(max(0, i - 3), i):
            right[i] -= bands[i - k, k] * right[k]
        right[i] /= bands[0, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, min(i + 4, n)):
            right[i] -= bands[k - i, i] * right[k]
        right[i] /= bands[0, i]


def zmp_along(cog: FloatArray, height: float, dt: float) -> FloatArray:
    """Return a pendulum's zero-moment points on a path at rest at both ends, (K + 1, 2) [m].

    Args:
        cog: The path, shape (K + 1, 2) [m].
        height: Height of the COG over the ground [m].
        dt: Time between its points [s].
    """
    longer = np.vstack((cog[:1], cog, cog[-1:]))
    return np.asarray(cog - height / GRAVITY * np.diff(longer, n=2, axis=0) / dt**2)


def pendulum_rate(height: float) -> float:
    """Return the rate at which a pendulum of that height [m] diverges [1/s]."""
    return float(np.sqrt(GRAVITY / height))

"""The trajectory-HMM: the one smooth motion that a sequence of states makes most likely.

With W stacking the identity, first and second differences, and (mu, U) the Gaussians of position,
velocity and acceleration along the state sequence, the motion c solves
``(W^T U^-1 W) c = W^T U^-1 mu`` [Tokuda2000], a banded system of one row a frame and channel.
"""

from __future__ import annotations

import numpy as np

from ..maths.banded import factorise, solve
from ..recording import FloatArray, IntArray

_PINNED = 1e8  # weight of a given start, relative to what else is known of that frame


def most_likely_trajectory(
    means: FloatArray,
    variances: FloatArray,
    states: IntArray,
    rate_hz: float,
    start: FloatArray | None = None,
) -> FloatArray:
    """Solve for the most likely motion, shape (T, D).

    Args:
        means: Position, velocity [1/s] and acceleration [1/s^2] in each state, shape (3, S, D).
        variances: Their variances, shape (3, S, D), positive.
        states: State of each frame, shape (T,).
        rate_hz: Frames per second [1/s].
        start: Posture to start from, at rest, shape (D,).
    """
    columns, motion = normal_equations(means, variances, states, rate_hz)
    if start is not None:
        weight = _PINNED * columns[0, 0]
        columns[0, 0] += weight
        motion[0] += weight * start
        if len(motion) > 1:  # at rest: the second frame equals the first
            weight = _PINNED * columns[1, 0]
            columns[0, 0] += weight
            columns[1, 0] += weight
            columns[0, 1] -= weight
    factorise(columns)
    solve(columns, motion)
    return motion


def normal_equations(
    means: FloatArray, variances: FloatArray, states: IntArray, rate_hz: float
) -> tuple[FloatArray, FloatArray]:
    """Return W^T U^-1 W by columns, see `banded`, shape (T, 3, D), and W^T U^-1 mu, shape (T, D).

    Velocity is ``(c[t+1] - c[t-1]) rate / 2``, acceleration ``(c[t+1] - 2 c[t] + c[t-1]) rate^2``;
    the first and the last frame have neither.
    """
    scale = np.array([1.0, rate_hz / 2, rate_hz**2])[:, None, None]
    weight, v, a = (scale**2 / variances)[:, states]  # (T, D) each
    pull, pull_v, pull_a = (scale * means / variances)[:, states]
    columns = np.zeros((len(states), 3, means.shape[2]))
    diagonal, first, second = columns[:, 0], columns[:, 1], columns[:, 2]
    diagonal += weight
    if len(states) > 2:
        v, a, pull_v, pull_a = v[1:-1], a[1:-1], pull_v[1:-1], pull_a[1:-1]
        diagonal[:-2] += v + a
        diagonal[1:-1] += 4 * a
        diagonal[2:] += v + a
        first[:-2] -= 2 * a
        first[1:-1] -= 2 * a
        second[:-2] += a - v
        pull[:-2] += pull_a - pull_v
        pull[1:-1] -= 2 * pull_a
        pull[2:] += pull_a + pull_v
    return columns, pull

"""The trajectory-HMM: the one smooth motion that a sequence of states makes most likely.

With W stacking the identity, first and second differences, and (mu, U) the Gaussians of position,
velocity and acceleration along the state sequence, the motion c solves
``(W^T U^-1 W) c = W^T U^-1 mu`` [Tokuda2000], a banded system of one row a frame and channel.
"""

from __future__ import annotations

import numpy as np

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
    bands, rhs = normal_equations(means, variances, states, rate_hz)
    if start is not None:
        weight = _PINNED * bands[2, :, 0]
        bands[2, :, 0] += weight
        rhs[:, 0] += weight * start
        if rhs.shape[1] > 1:  # at rest: the second frame equals the first
            weight = _PINNED * bands[2, :, 1]
            bands[2, :, 0] += weight
            bands[2, :, 1] += weight
            bands[1, :, 1] -= weight
    from scipy.linalg import solveh_banded

    # the channels one after another are one long banded system
    one = np.moveaxis(bands, 0, -1).reshape(-1, 3).T
    flat = solveh_banded(one, rhs.ravel(), overwrite_ab=True, overwrite_b=True, check_finite=False)
    return np.ascontiguousarray(flat.reshape(rhs.shape).T)


def normal_equations(
    means: FloatArray, variances: FloatArray, states: IntArray, rate_hz: float
) -> tuple[FloatArray, FloatArray]:
    """Return W^T U^-1 W in upper banded form, shape (3, D, T), and W^T U^-1 mu, shape (D, T).

    Velocity is ``(c[t+1] - c[t-1]) rate / 2``, acceleration ``(c[t+1] - 2 c[t] + c[t-1]) rate^2``;
    the first and the last frame have neither.
    """
    scale = np.array([1.0, rate_hz / 2, rate_hz**2])[:, None, None]
    tables = np.stack([scale**2 / variances, scale * means / variances])
    tables = np.ascontiguousarray(np.swapaxes(tables, -1, -2))
    weights, pulls = np.take(tables, states, axis=-1)  # (3, D, T) each
    v, a = weights[1, :, 1:-1], weights[2, :, 1:-1]
    pull_v, pull_a = pulls[1, :, 1:-1], pulls[2, :, 1:-1]
    bands = np.moveaxis(np.zeros((*weights.shape[1:], 3)), -1, 0)  # in memory as LAPACK has it
    rhs = pulls[0]
    second, first, diagonal = bands
    diagonal += weights[0]
    if rhs.shape[1] > 2:
        outer = v + a
        diagonal[:, :-2] += outer
        diagonal[:, 1:-1] += 4 * a
        diagonal[:, 2:] += outer
        first[:, 1:-1] -= 2 * a
        first[:, 2:] -= 2 * a
        second[:, 2:] += a - v
        rhs[:, :-2] += pull_a - pull_v
        rhs[:, 1:-1] -= 2 * pull_a
        rhs[:, 2:] += pull_a + pull_v
    return bands, rhs

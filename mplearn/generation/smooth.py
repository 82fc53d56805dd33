"""The trajectory-HMM: the one smooth motion that a sequence of states makes most likely.

With W stacking the identity, first and second differences, and (mu, U) the Gaussians of position,
velocity and acceleration along the state sequence, the motion c solves
``(W^T U^-1 W) c = W^T U^-1 mu`` [Tokuda2000], a banded system of one row a frame and channel.
"""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray

_PINNED = 1e8  # weight of a given start, relative to what else is known of that frame


def most_likely_trajectory(
    means: FloatArray, variances: FloatArray, rate_hz: float, start: FloatArray | None = None
) -> FloatArray:
    """Solve for the most likely motion, shape (T, D).

    Args:
        means: Position, velocity [1/s] and acceleration [1/s^2] of each frame, shape (3, T, D).
        variances: Their variances, shape (3, T, D), positive.
        rate_hz: Frames per second [1/s].
        start: Posture to start from, at rest, shape (D,).
    """
    bands, rhs = normal_equations(means, variances, rate_hz)
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
    flat = solveh_banded(bands.reshape(3, -1), rhs.ravel(), check_finite=False)
    return np.ascontiguousarray(flat.reshape(rhs.shape).T)


def normal_equations(
    means: FloatArray, variances: FloatArray, rate_hz: float
) -> tuple[FloatArray, FloatArray]:
    """Return W^T U^-1 W in upper banded form, shape (3, D, T), and W^T U^-1 mu, shape (D, T).

    Velocity is ``(c[t+1] - c[t-1]) rate / 2``, acceleration ``(c[t+1] - 2 c[t] + c[t-1]) rate^2``;
    the first and the last frame have neither.
    """
    weights = np.ascontiguousarray(np.swapaxes(1.0 / variances, 1, 2))  # (3, D, T)
    pull = weights * np.swapaxes(means, 1, 2)
    h, g = rate_hz / 2, rate_hz**2
    v, a = h**2 * weights[1, :, 1:-1], g**2 * weights[2, :, 1:-1]
    mv, ma = h * pull[1, :, 1:-1], g * pull[2, :, 1:-1]
    bands, rhs = np.zeros_like(weights), pull[0]
    second, first, diagonal = bands
    diagonal += weights[0]
    if rhs.shape[1] > 2:
        diagonal[:, :-2] += v + a
        diagonal[:, 1:-1] += 4 * a
        diagonal[:, 2:] += v + a
        first[:, 1:-1] -= 2 * a
        first[:, 2:] -= 2 * a
        second[:, 2:] += a - v
        rhs[:, :-2] += ma - mv
        rhs[:, 1:-1] -= 2 * ma
        rhs[:, 2:] += ma + mv
    return bands, rhs

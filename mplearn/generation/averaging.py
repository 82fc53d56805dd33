"""The average of many motions drawn from a model, drawn in one go.

Given how long each motion stays in each state, its frames are independent Gaussians. Stretched
linearly to a common length and averaged, they are Gaussian again, with a mean and a covariance
between nearby frames that are known; so a single draw per frame does for any number of motions.
"""

from __future__ import annotations

import numpy as np

from ..maths.banded import factorise, multiply
from ..maths.compiling import njit
from ..recording import FloatArray, IntArray

_WHITE = 1e-10  # of the variance, added to it: frames may otherwise determine one another


def average_of_motions(
    means: FloatArray,
    variances: FloatArray,
    stays: IntArray,
    n_frames: int,
    rng: np.random.Generator,
) -> FloatArray:
    """Draw the average of motions, each stretched to ``n_frames``, shape (n_frames, D).

    Args:
        means: Mean of each state, shape (N, D).
        variances: Variance of each state, shape (N, D).
        stays: Frames in each state of each motion, at least 1, shape (S, N).
        n_frames: Length of the average.
        rng: Source of randomness.
    """
    shares, products = stretched(stays, n_frames)
    covariances = products @ variances
    covariances[:, 0] += _WHITE * covariances[:, 0].max(axis=0)
    factorise(covariances)
    noise = rng.standard_normal((n_frames, means.shape[1]))
    return np.asarray(shares @ means + multiply(covariances, noise))


@njit(cache=True)
def stretched(stays: IntArray, n_frames: int) -> tuple[FloatArray, FloatArray]:
    """Return what each state adds to the average's mean and covariance.

    Returns:
        The weight of each state's mean in each frame, shape (n_frames, N), and that of its variance
        in the covariance of each frame with itself and the following ones, (n_frames, B, N).
    """
    n_motions, n_states = stays.shape
    shortest = stays[0].sum()
    for s in range(n_motions):
        shortest = min(shortest, stays[s].sum())
    # two frames of the average have a drawn one in common if they are less than 2 of those apart
    n_band = n_frames
    if shortest > 1:
        n_band = min(n_frames, int(np.ceil(2.0 * (n_frames - 1) / (shortest - 1))) + 1)
    shares, products = np.zeros((n_frames, n_states)), np.zeros((n_frames, n_band, n_states))
    before, after = np.empty(n_frames, np.int64), np.empty(n_frames)  # drawn frame, share of next
    for s in range(n_motions):
        states = np.repeat(np.arange(n_states), stays[s])
        last = states.shape[0] - 1
        for k in range(n_frames):
            place = k * last / (n_frames - 1) if n_frames > 1 else 0.0
            before[k] = min(int(place), max(last - 1, 0))
            after[k] = place - before[k]
        for k in range(n_frames):
            j, a = before[k], after[k]
            here, following = states[j], states[min(j + 1, last)]
            shares[k, here] += (1.0 - a) / n_motions
            shares[k, following] += a / n_motions
            for i in range(min(n_band, n_frames - k)):
                b = after[k + i]
                if before[k + i] == j:
                    products[k, i, here] += (1.0 - a) * (1.0 - b) / n_motions**2
                    products[k, i, following] += a * b / n_motions**2
                elif before[k + i] == j + 1:
                    products[k, i, following] += a * (1.0 - b) / n_motions**2
                else:
                    break
    return shares, products

"""The distance of two windows, written out."""

import numpy as np


def density_distance(a, b, sigma):
    """Integrated square error between the Parzen densities of two windows, by the closed form.

    Args:
        a: Points of one window, shape (W, n).
        b: Points of the other, shape (W, n).
        sigma: Width of the kernels, in the points' unit.

    Returns:
        The distance over (4 pi sigma^2)^(-n/2), in [0, 2].

    Source: [Kulic2012] eq. 1-2.
    """

    def mean_kernel(x, y):
        squared = ((x[:, None, :] - y[None, :, :]) ** 2).sum(axis=2)
        return float(np.exp(-squared / (4.0 * sigma * sigma)).mean())

    return max(0.0, mean_kernel(a, a) - 2.0 * mean_kernel(a, b) + mean_kernel(b, b))

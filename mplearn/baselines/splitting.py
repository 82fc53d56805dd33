"""Where to cut a set of points in two: along its longest direction, where the error is least."""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray

_SMALLEST_SHARE = 1e-6  # of the variance of all values: below it, a part has no spread


def principal_projection(points: FloatArray) -> FloatArray:
    """Return the points' coordinates along their first principal component, (n, D) to (n,).

    The component's sign is that of its largest entry, so that the answer is unique.
    """
    centred = points - points.mean(axis=0)
    if len(points) > points.shape[1]:
        component = np.linalg.eigh(centred.T @ centred)[1][:, -1]
    else:
        component = centred.T @ np.linalg.eigh(centred @ centred.T)[1][:, -1]
    component *= np.sign(component[np.argmax(np.abs(component))]) or 1.0
    return np.asarray(centred @ component)


def minimum_error_split(values: FloatArray, smallest: int) -> float | None:
    """Return the threshold that separates two normal classes best [Kittler1986].

    It minimises ``J = p1 log(v1) + p2 log(v2) - 2 (p1 log(p1) + p2 log(p2))``, p being the shares
    and v the variances of the values up to the threshold and above it, over all thresholds.

    Args:
        values: Shape (n,), finite.
        smallest: Fewest values on either side.

    Returns:
        Half way between two values; None where no threshold leaves enough on both sides.

    Example:
        >>> import numpy as np
        >>> low = np.arange(40) / 99
        >>> minimum_error_split(np.concatenate((low, 5 + low)), 8)
        2.696969696969697
    """
    n = len(values)
    if smallest < 1 or n < 2 * smallest:
        return None
    ordered = np.sort(values)
    spread = ordered.var()
    if spread <= 0:
        return None
    scaled = (ordered - ordered.mean()) / np.sqrt(spread)
    counts = np.arange(1, n)
    sums, squares = np.cumsum(scaled)[:-1], np.cumsum(scaled**2)[:-1]
    below = squares / counts - (sums / counts) ** 2
    above = (n - squares) / (n - counts) - (sums / (n - counts)) ** 2
    shares = counts / n
    error = np.zeros(n - 1)
    for share, variance in ((shares, below), (1 - shares, above)):
        error += share * np.log(np.maximum(variance, _SMALLEST_SHARE)) - 2 * share * np.log(share)
    allowed = (counts >= smallest) & (n - counts >= smallest) & (np.diff(ordered) > 0)
    if not allowed.any():
        return None
    best = int(np.argmin(np.where(allowed, error, np.inf)))
    return float(0.5 * (ordered[best] + ordered[best + 1]))

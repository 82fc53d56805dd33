"""Sums in compiled loops that are numpy's to the bit, wherever what is decided by them was kept."""

from __future__ import annotations

from ..recording import FloatArray
from .compiling import njit

_AT_ONCE = 8
_PART = 128  # values that are summed in one loop; more are halved


@njit(cache=True)
def pairwise_sum(values: FloatArray) -> float:
    """Return the sum of some values side by side in memory, in the order in which numpy adds them.

    Args:
        values: Shape (n,).

    Example:
        >>> import numpy as np
        >>> values = np.linspace(0.0, 1.0, 1000) ** 3
        >>> bool(pairwise_sum(values) == values.sum())
        True
    """
    n = len(values)
    if n < _AT_ONCE:
        total = 0.0
        for value in values:
            total += value
        return float(total)
    if n > _PART:
        half = n // 2 - n // 2 % _AT_ONCE
        return pairwise_sum(values[:half]) + pairwise_sum(values[half:])
    a, b, c, d = values[0], values[1], values[2], values[3]
    e, f, g, h = values[4], values[5], values[6], values[7]
    whole = n - n % _AT_ONCE
    for i in range(_AT_ONCE, whole, _AT_ONCE):
        a, b, c, d = a + values[i], b + values[i + 1], c + values[i + 2], d + values[i + 3]
        e, f, g, h = e + values[i + 4], f + values[i + 5], g + values[i + 6], h + values[i + 7]
    total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for i in range(whole, n):
        total += values[i]
    return float(total)

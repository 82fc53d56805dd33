"""Smooth passages from 0 to 1 as x goes from 0 to 1."""

from __future__ import annotations

from ..recording import FloatArray


def smooth_step(x: FloatArray) -> FloatArray:
    """Return the cubic that starts and ends at rest, shape as ``x``.

    Example:
        >>> import numpy as np
        >>> smooth_step(np.array([0.0, 0.5, 1.0]))
        array([0. , 0.5, 1. ])
    """
    return x * x * (3.0 - 2.0 * x)


def minimum_jerk(x: FloatArray) -> FloatArray:
    """Return the quintic of least jerk, at rest and unaccelerated at both ends [Flash1985].

    Example:
        >>> import numpy as np
        >>> minimum_jerk(np.array([0.0, 0.5, 1.0]))
        array([0. , 0.5, 1. ])
    """
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))

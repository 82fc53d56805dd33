"""Tracking of the upper body: velocity-limited interpolation of a stream of wanted positions."""

from __future__ import annotations

import numpy as np

from mplearn.errors import FrameError, InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.servos import limit_velocity


class UpperBodyTracker:
    """Tracks a stream of wanted positions of any number of joints, one call a control period.

    Args:
        limits: Smallest and largest position, shape (U, 2).
        velocity: Velocity limits, shape (U,).
        period_s: Control period [s].

    Example:
        >>> import numpy as np
        >>> tracker = UpperBodyTracker(np.array([[-1.0, 1.0]]), np.array([2.0]), period_s=0.01)
        >>> here = np.array([0.0])
        >>> for _ in range(10):
        ...     here = tracker.update(here, np.array([5.0]))  # out of reach, and far
        >>> float(here[0].round(3))  # no faster than 2 rad/s
        0.2
    """

    def __init__(self, limits: FloatArray, velocity: FloatArray, period_s: float) -> None:
        if not period_s > 0:
            raise InvalidValueError(f"the control period must be positive, not {period_s} s")
        self.limits = limits
        self.velocity = velocity
        self.period_s = period_s

    def update(self, here: FloatArray, wanted: FloatArray) -> FloatArray:
        """Return the next commanded position, shape (U,).

        Raises:
            FrameError: The wanted position is not finite or of another width.
        """
        if wanted.shape != here.shape or not np.isfinite(wanted).all():
            raise FrameError(f"wanted positions must be {here.shape[0]} finite values")
        wanted = np.clip(wanted, self.limits[:, 0], self.limits[:, 1])
        path: FloatArray = limit_velocity(wanted[None], here, self.velocity * self.period_s)
        return np.asarray(path[0])

"""The COG's velocity and acceleration from noisy measurements of its position, on-line."""

from __future__ import annotations

from typing import Any

import numpy as np

from mplearn.errors import FrameError, InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.support import pendulum_zmp


class CogFilter:
    """A Kalman filter of the COG's motion under random jerk, one for all three axes (filterpy).

    The axes have the same model and noise, so they share the covariance: the state holds position,
    velocity and acceleration as rows and the axes as columns.

    Args:
        rate_hz: Measurements per second [1/s].
        noise_m: Standard deviation of a measurement [m].
        jerk: Standard deviation of the COG's jerk, as white noise [m/s^3 per sqrt(Hz)].
    """

    def __init__(self, rate_hz: float, noise_m: float = 0.001, jerk: float = 1.0) -> None:
        for name, value in (("rate_hz", rate_hz), ("noise_m", noise_m), ("jerk", jerk)):
            if not (np.isfinite(value) and value > 0):
                raise InvalidValueError(f"{name} must be positive and finite, not {value}")
        self.rate_hz = rate_hz
        self.noise_m = noise_m
        self.jerk = jerk
        self._filter: Any = None

    def _start(self, measured: FloatArray) -> Any:
        from filterpy.common import Q_continuous_white_noise
        from filterpy.kalman import KalmanFilter

        dt = 1.0 / self.rate_hz
        kalman = KalmanFilter(dim_x=3, dim_z=1)
        kalman.x = np.zeros((3, 3))
        kalman.x[0] = measured
        kalman.F = np.array([[1.0, dt, 0.5 * dt * dt], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
        kalman.H = np.array([[1.0, 0.0, 0.0]])
        kalman.P = np.diag([self.noise_m**2, 0.1**2, 1.0])
        kalman.R = np.array([[self.noise_m**2]])
        kalman.Q = Q_continuous_white_noise(dim=3, dt=dt, spectral_density=self.jerk**2)
        return kalman

    def update(self, measured: FloatArray | None) -> FloatArray:
        """Take one measurement and return position, velocity and acceleration, shape (3, 3).

        Args:
            measured: COG, shape (3,) [m]; None where the measurement is missing.

        Raises:
            FrameError: The measurement is not three finite numbers, or the first one is missing.
        """
        if measured is not None:
            measured = np.asarray(measured, dtype=np.float64)
            if measured.shape != (3,) or not np.isfinite(measured).all():
                raise FrameError(f"a COG is three finite numbers [m], not {measured}")
        if self._filter is None:
            if measured is None:
                raise FrameError("the first COG measurement must not be missing")
            self._filter = self._start(measured)
            return np.array(self._filter.x)
        kalman = self._filter
        kalman.predict()
        if measured is not None:
            kalman.update(measured[None], H=kalman.H)  # with H given, all three columns pass
        return np.array(kalman.x)

    def zmp(self) -> FloatArray:
        """Return the inverted pendulum's zero-moment point, shape (2,) [m]."""
        if self._filter is None:
            raise FrameError("the COG filter has not been given a measurement yet")
        return pendulum_zmp(self._filter.x[0], self._filter.x[2])

"""Slowing a trajectory down, no more than the limits of its joints demand."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray, IntArray
from .trajectory import Trajectory

_BLEND_S = 0.1  # half the time over which one primitive's slow-down passes into the next one's
_MARGIN = 1.002  # overshoots what is still too fast a little, so that few rounds suffice
_PRECISION = 1.01  # of a slow-down
_MAX_ROUNDS = 100
_MAX_FRAMES = 5_000_000


def retime(
    trajectory: Trajectory,
    velocity_limits: FloatArray | None = None,
    acceleration_limits: FloatArray | None = None,
    speed: float = 1.0,
) -> Trajectory:
    """Return the trajectory at a speed, with each primitive slowed down as far as limits demand.

    The postures passed through stay the same; only when they are passed changes. Each primitive
    has one slow-down, and none of them could be smaller (by more than about 1 %) while the others
    stay; around a join it changes gradually. Limits hold for `Trajectory.velocities` and
    `Trajectory.accelerations` of what is returned.

    Args:
        trajectory: The motion.
        velocity_limits: Largest speed of each channel, shape (D,) [1/s]; infinity is none.
        acceleration_limits: Largest acceleration, shape (D,) [1/s^2]; infinity is none.
        speed: Speed relative to the trajectory's own; 0.5 is the paper's half speed.

    Raises:
        InvalidValueError: A limit or the speed is not positive, or limits have the wrong shape.
    """
    if not (math.isfinite(speed) and speed > 0):
        raise InvalidValueError(f"speed must be positive and finite, not {speed}")
    n_channels = trajectory.frames.shape[1]
    v_limits = _checked(velocity_limits, n_channels, "velocity_limits")
    a_limits = _checked(acceleration_limits, n_channels, "acceleration_limits")
    if len(trajectory) == 1:
        return trajectory
    slow_down = np.maximum(1.0 / speed, _excess(trajectory, v_limits, a_limits))
    if (slow_down == 1.0).all():
        return trajectory
    warp = _Warp(trajectory)

    def excess_at(factors: FloatArray) -> FloatArray:
        return _excess(warp.at(factors), v_limits, a_limits)

    return warp.at(_smallest(_sufficient(slow_down, excess_at), 1.0 / speed, excess_at))


def _sufficient(slow_down: FloatArray, excess_at: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return slow-downs, shape (P,), at least as large, that keep within the limits."""
    for _ in range(_MAX_ROUNDS):
        excess = excess_at(slow_down)
        if (excess <= 1.0).all():
            return slow_down
        slow_down = np.where(excess > 1.0, slow_down * excess * _MARGIN, slow_down)
    raise InvalidValueError("no slow-down was found that keeps this trajectory within the limits")


def _smallest(
    slow_down: FloatArray, least: float, excess_at: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Take back what neighbours make superfluous: each factor in turn, the largest first.

    A fast frame near a join may be slow enough by its neighbour's factor alone.
    """
    for p in np.argsort(-slow_down, kind="stable"):
        low, high = least, float(slow_down[p])
        tried = high / _PRECISION
        while high > _PRECISION * low:
            trial = slow_down.copy()
            trial[p] = max(tried, low)
            if (excess_at(trial) <= 1.0).all():
                slow_down, high = trial, float(trial[p])
            else:
                low = float(trial[p])
            tried = np.sqrt(low * high)
    return slow_down


class _Warp:
    """A trajectory whose primitives can be slowed down each by a factor of its own."""

    def __init__(self, trajectory: Trajectory) -> None:
        from scipy.interpolate import CubicSpline

        self.trajectory = trajectory
        self._curve = CubicSpline(np.arange(len(trajectory)), trajectory.frames, axis=0)
        lengths = np.diff(np.append(trajectory.starts, len(trajectory)))
        self._position = np.repeat(np.arange(len(lengths)), lengths)  # (T,)

    def at(self, slow_down: FloatArray) -> Trajectory:
        """Return the trajectory slowed down by one factor a primitive, shape (P,)."""
        old = self.trajectory
        half = round(_BLEND_S * old.rate_hz)
        # an interval is as slow as the slowest within reach, and passes gradually between them
        steps = slow_down[self._position[1:]]
        steps = _windowed(np.mean, _windowed(np.max, steps, half), half)
        passed = np.concatenate([[0.0], np.cumsum(steps)])  # when old frames are passed [frames]
        n_frames = math.ceil(passed[-1] - 1e-9) + 1
        if n_frames > _MAX_FRAMES:
            raise InvalidValueError(
                f"the limits would stretch {len(old)} frames to {n_frames}, more than {_MAX_FRAMES}"
            )
        passed *= (n_frames - 1) / passed[-1]
        now = np.interp(np.arange(n_frames), passed, np.arange(len(old)))
        starts = _apart(np.ceil(passed[old.starts] - 1e-9).astype(np.int64), n_frames)
        ids = np.repeat(old.path, np.diff(np.append(starts, n_frames)))
        return Trajectory(self._curve(now), old.rate_hz, old.channels, ids, starts)


def _excess(
    trajectory: Trajectory, velocity_limits: FloatArray, acceleration_limits: FloatArray
) -> FloatArray:
    """Return by what factor each primitive is too fast, shape (P,); at most 1 is within limits."""
    per_frame = np.zeros(len(trajectory))
    per_frame[1:] = (np.abs(trajectory.velocities) / velocity_limits).max(axis=1)
    if len(trajectory) > 2 and np.isfinite(acceleration_limits).any():
        ratios = (np.abs(trajectory.accelerations) / acceleration_limits).max(axis=1)
        per_frame[1:-1] = np.maximum(per_frame[1:-1], np.sqrt(ratios))
    return np.asarray(np.maximum.reduceat(per_frame, trajectory.starts))


def _windowed(function: Callable[..., FloatArray], values: FloatArray, half: int) -> FloatArray:
    """Apply a function to each window of 2 half + 1 values, the ends continued."""
    continued = np.pad(values, half, mode="edge")
    return function(np.lib.stride_tricks.sliding_window_view(continued, 2 * half + 1), axis=1)


def _apart(starts: IntArray, n_frames: int) -> IntArray:
    """Return starts at least one frame apart."""
    place = np.arange(len(starts))
    starts = np.maximum.accumulate(starts - place) + place
    if starts[-1] >= n_frames:
        raise InvalidValueError("at this speed a primitive of the path is left without a frame")
    return starts


def _checked(limits: FloatArray | None, n_channels: int, name: str) -> FloatArray:
    if limits is None:
        return np.full(n_channels, np.inf)
    values = np.asarray(limits, dtype=np.float64)
    if values.shape != (n_channels,) or not (values > 0).all():  # NaN fails too
        raise InvalidValueError(
            f"{name} must be {n_channels} positive numbers (infinity is no limit), not {limits}"
        )
    return values

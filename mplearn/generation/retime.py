"""Slowing a trajectory down, no more than the limits of its joints demand."""

from __future__ import annotations

import math

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray
from .trajectory import Trajectory
from .warp import Timing, Warp

_MARGIN = 1.002  # overshoots what is still too fast, each round more, so that few suffice
_PRECISION = 1.01  # of a slow-down
_TOLERANCE = 1.002  # of an excess, which depends a little on which moments are sampled
_MAX_ROUNDS = 100


def retime(
    trajectory: Trajectory,
    velocity_limits: FloatArray | None = None,
    acceleration_limits: FloatArray | None = None,
    speed: float = 1.0,
) -> Trajectory:
    """Return the trajectory at a speed, with each primitive slowed down as far as limits demand.

    The postures passed through stay the same; only when they are passed changes. Each primitive
    has one slow-down, the smallest that limits allow while the others stay (a smaller one would
    make the motion shorter by about 2 % at most); around a join it changes gradually. Limits hold
    for `Trajectory.velocities` and `Trajectory.accelerations` of what is returned.

    Args:
        trajectory: The motion.
        velocity_limits: Largest speed of each channel, shape (D,) [1/s]; infinity is none.
        acceleration_limits: Largest acceleration, shape (D,) [1/s^2]; infinity is none.
        speed: Speed relative to the trajectory's own; 0.5 is the paper's half speed.

    Raises:
        InvalidValueError: A limit or the speed is not positive, or limits have the wrong shape.

    Example:
        >>> import numpy as np
        >>> from mplearn.generation import generate
        >>> from mplearn.hmm import fit
        >>> from mplearn.library import Primitive
        >>> swing = np.sin(np.linspace(0, np.pi, 50))[:, None]
        >>> model = fit([swing], n_states=6, variance_floor=1e-3)
        >>> primitive = Primitive.from_exemplars(1, model, [swing], 50.0)
        >>> motion = generate([primitive], ("elbow",), 50.0)
        >>> slow = retime(motion, velocity_limits=np.array([1.0]))
        >>> slow.duration_s > motion.duration_s, bool(np.abs(slow.velocities).max() <= 1.0 + 1e-9)
        (True, True)
    """
    if not (math.isfinite(speed) and speed > 0):
        raise InvalidValueError(f"speed must be positive and finite, not {speed}")
    n_channels = trajectory.frames.shape[1]
    v_limits = _checked(velocity_limits, n_channels, "velocity_limits")
    a_limits = _checked(acceleration_limits, n_channels, "acceleration_limits")
    if len(trajectory) == 1:
        return trajectory
    warp = Warp(trajectory, v_limits, a_limits)
    if speed == 1.0 and (warp.excess(warp.unchanged) <= 1.0).all():
        return trajectory
    return warp.at(slowed_down(warp, 1.0 / speed)[1])


def slowed_down(warp: Warp, least: float) -> tuple[FloatArray, Timing]:
    """Return the smallest slow-downs that keep within the limits, shape (P,), and their timing.

    Args:
        warp: The motion.
        least: Every slow-down is at least that.
    """
    slow_down = np.maximum(least, warp.excess(warp.unchanged))
    slow_down, _ = _sufficient(warp, slow_down)
    return _sufficient(warp, _smallest(warp, slow_down, least))


def _sufficient(warp: Warp, slow_down: FloatArray) -> tuple[FloatArray, Timing]:
    """Return slow-downs, shape (P,), at least as large, that keep within the limits."""
    for n in range(1, _MAX_ROUNDS + 1):
        timing = warp.timing(slow_down)
        excess = warp.excess(timing)
        if (excess <= 1.0).all():
            return slow_down, timing
        slow_down = np.where(excess > 1.0, slow_down * excess * _MARGIN**n, slow_down)
    raise InvalidValueError("no slow-down was found that keeps this trajectory within the limits")


def _smallest(warp: Warp, slow_down: FloatArray, least: float) -> FloatArray:
    """Take back what is superfluous: each factor in turn, the largest first, until none is.

    A fast frame near a join may be slow enough by its neighbour's factor alone.
    """
    before = np.full_like(slow_down, np.inf)
    while (slow_down < before).any():
        before = slow_down.copy()
        for p in np.argsort(-slow_down, kind="stable"):
            slow_down[p] = _smallest_of_one(warp, slow_down, int(p), least)
    return slow_down


def _smallest_of_one(warp: Warp, slow_down: FloatArray, position: int, least: float) -> float:
    """Return the smallest factor that suffices for one primitive while the others stay."""
    trial = slow_down.copy()
    low, high = least, float(slow_down[position])
    tried = high / _PRECISION
    while high > _PRECISION * low:
        trial[position] = max(tried, low)
        if warp.excess_around(trial, position) <= _TOLERANCE:
            high = float(trial[position])
        else:
            low = float(trial[position])
        tried = math.sqrt(low * high)
    return high


def _checked(limits: FloatArray | None, n_channels: int, name: str) -> FloatArray:
    if limits is None:
        return np.full(n_channels, np.inf)
    values = np.array(limits, dtype=np.float64)
    if values.shape != (n_channels,) or not (values > 0).all():  # NaN fails too
        raise InvalidValueError(
            f"{name} must be {n_channels} positive numbers (infinity is no limit), not {limits}"
        )
    return values

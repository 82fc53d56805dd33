"""A motion whose primitives pass more slowly, each by a factor of its own."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..errors import InvalidValueError
from ..maths.compiling import njit
from ..maths.splines import curvatures, fill_in, spline_values
from ..recording import FloatArray, IntArray
from .trajectory import MAX_FRAMES, Trajectory

_BLEND_S = 0.1  # half the time over which one primitive's slow-down passes into the next one's


class Timing(NamedTuple):
    """When a motion passes where.

    Attributes:
        places: Place of each new frame, shape (N,) [old frames].
        bounds: First new frame of each primitive, and N, shape (P + 1,).
    """

    places: FloatArray
    bounds: IntArray


class Warp:
    """A trajectory that can be slowed down, and by how much it is too fast then.

    Where it is at a frame, the motion is as slow as the slowest primitive within 0.1 s, averaged
    over 0.1 s to either side, so that the slow-down changes gradually around a join; between frames
    it changes linearly.

    Args:
        trajectory: The motion, of two frames at least.
        velocity_limits: Largest speed of each channel, shape (D,) [1/s].
        acceleration_limits: Largest acceleration, shape (D,) [1/s^2].

    Attributes:
        unchanged: The trajectory's own timing.
    """

    def __init__(
        self, trajectory: Trajectory, velocity_limits: FloatArray, acceleration_limits: FloatArray
    ) -> None:
        self.trajectory = trajectory
        within = 1.0 - 2.0**-52  # a ratio that is rounded to 1 shall not be above a limit
        self._limits = within * velocity_limits, within * acceleration_limits
        self._knots = np.array(trajectory.frames)
        self._bends = curvatures(self._knots)
        self._half = round(_BLEND_S * trajectory.rate_hz)
        n = len(trajectory)
        self.unchanged = Timing(np.arange(float(n)), np.append(trajectory.starts, n))
        lengths = np.diff(self.unchanged.bounds)
        self._position = np.repeat(np.arange(len(lengths)), lengths)  # (T,)

    def timing(self, slow_down: FloatArray) -> Timing:
        """Return the timing with one slow-down a primitive, shape (P,).

        Raises:
            InvalidValueError: It would be too long, or a primitive would have no frame left.
        """
        n_old = len(self.trajectory)
        slowness, passed = self._course(slow_down, 0, n_old)
        n_new = math.ceil(passed[-1] - 1e-9) + 1
        if n_new > MAX_FRAMES:
            raise InvalidValueError(
                f"the limits would stretch {n_old} frames to {n_new}, more than {MAX_FRAMES}"
            )
        fit = (n_new - 1) / passed[-1]
        slowness, passed = fit * slowness, fit * passed
        starts = np.ceil(passed[self.trajectory.starts] - 1e-9).astype(np.int64)
        place = np.arange(len(starts))
        starts = np.maximum.accumulate(starts - place) + place  # at least one frame apart
        if starts[-1] >= n_new:
            raise InvalidValueError("at this speed a primitive of the path is left without a frame")
        return Timing(places_at(slowness, passed, n_new), np.append(starts, n_new))

    def at(self, timing: Timing) -> Trajectory:
        """Return the trajectory with a timing."""
        old, starts = self.trajectory, timing.bounds[:-1]
        frames = spline_values(self._knots, self._bends, timing.places)
        ids = np.repeat(old.path, np.diff(timing.bounds))
        return Trajectory(frames, old.rate_hz, old.channels, ids, starts)

    def excess(self, timing: Timing) -> FloatArray:
        """Return by what factor each primitive is too fast; at most 1 is within limits; (P,)."""
        rate_hz = self.trajectory.rate_hz
        return np.asarray(excess(self._knots, self._bends, *timing, rate_hz, *self._limits))

    def excess_around(self, slow_down: FloatArray, position: int) -> float:
        """Return by what factor it is too fast in one primitive of the path, and around it.

        The moments sampled there may be others than in the whole.
        """
        reach, bounds = 2 * self._half + 2, self.unchanged.bounds
        first = max(bounds[position] - reach, 0)
        end = min(bounds[position + 1] + reach, len(self.trajectory))
        slowness, passed = self._course(slow_down, first, end)
        n_new = int(passed[-1]) + 1
        places = first + places_at(slowness, passed, n_new)
        return float(self.excess(Timing(places, np.array([0, n_new])))[0])

    def _course(self, slow_down: FloatArray, first: int, end: int) -> tuple[FloatArray, FloatArray]:
        """Return how slow it is at old frames, and when it passes them [frames], from 0."""
        slowness = slowness_at(slow_down, self._position, self._half, first, end)
        steps = (slowness[1:] + slowness[:-1]) / 2
        return slowness, np.concatenate([[0.0], np.cumsum(steps)])


@njit(cache=True)
def slowness_at(
    slow_down: FloatArray, position: IntArray, half: int, first: int, end: int
) -> FloatArray:
    """Return how slow a motion is at its frames, see `Warp`, shape (end - first,).

    Args:
        slow_down: Factor of each primitive, shape (P,).
        position: Which primitive each frame is in, shape (T,).
        half: Frames on either side that count, in the maximum and in the mean.
        first: First frame.
        end: End of the frames.
    """
    last = position.shape[0] - 1
    total = np.zeros(end - first + 2 * half + 1)  # of the slowest, from frame first - half on
    for k in range(total.shape[0] - 1):
        middle = min(max(first - half + k, 0), last)
        slowest = 0.0
        for p in range(position[max(middle - half, 0)], position[min(middle + half, last)] + 1):
            slowest = max(slowest, slow_down[p])
        total[k + 1] = total[k] + slowest
    return (total[2 * half + 1 :] - total[: end - first]) / (2 * half + 1)


@njit(cache=True)
def places_at(slowness: FloatArray, passed: FloatArray, n_new: int) -> FloatArray:
    """Return where a motion is at times 0, 1, ..., n_new - 1, shape (n_new,) [old frames].

    Args:
        slowness: New frames per old frame, at each old frame, linear between, shape (T,), T >= 2.
        passed: When each old frame is passed, shape (T,): the integral of that.
        n_new: Number of new frames.
    """
    places = np.empty(n_new)
    k = 0
    for t in range(n_new):
        while k < passed.shape[0] - 2 and passed[k + 1] <= t:
            k += 1
        since, change = t - passed[k], slowness[k + 1] - slowness[k]
        root = np.sqrt(max(slowness[k] ** 2 + 2.0 * change * since, 0.0))
        places[t] = min(k + 2.0 * since / (slowness[k] + root), passed.shape[0] - 1.0)
    return places


@njit(cache=True)
def excess(
    knots: FloatArray,
    bends: FloatArray,
    places: FloatArray,
    bounds: IntArray,
    rate_hz: float,
    velocity_limits: FloatArray,
    acceleration_limits: FloatArray,
) -> FloatArray:
    """Return by what factor a spline with a timing is too fast, shape (P,).

    A velocity counts at the later of its two frames, an acceleration in the middle of its three.

    Args:
        knots: Shape (K, D).
        bends: Their `curvatures`.
        places: See `Timing`.
        bounds: See `Timing`.
        rate_hz: Frames per second [1/s].
        velocity_limits: Shape (D,) [1/s].
        acceleration_limits: Shape (D,) [1/s^2].
    """
    n, n_channels = places.shape[0], knots.shape[1]
    over = np.zeros(bounds.shape[0] - 1)
    step, bend = np.empty(n_channels), np.empty(n_channels)
    before, here, after = np.empty(n_channels), np.empty(n_channels), np.empty(n_channels)
    fill_in(knots, bends, places[0], after)
    here[:] = after
    for p in range(over.shape[0]):
        step[:], bend[:] = 0.0, 0.0
        for t in range(bounds[p], bounds[p + 1]):
            before, here, after = here, after, before
            fill_in(knots, bends, places[min(t + 1, n - 1)], after)
            for d in range(n_channels):
                step[d] = max(step[d], abs(here[d] - before[d]))
            if 0 < t < n - 1:
                for d in range(n_channels):
                    change = (after[d] - here[d]) - (here[d] - before[d])
                    bend[d] = max(bend[d], abs(change))
        over[p] = (step * rate_hz / velocity_limits).max()
        over[p] = max(over[p], np.sqrt((bend * rate_hz**2 / acceleration_limits).max()))
    return over

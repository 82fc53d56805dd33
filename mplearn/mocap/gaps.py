"""Markers that vanish for a moment, followed on-line by a g-h filter [Brookner1998]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import FrameError, InvalidValueError
from ..recording import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class GapConfig:
    """What a marker on a person can do.

    Attributes:
        max_gap_s: A marker unseen for longer is given up, as NaN, until it is seen again [s].
        memory_s: Time over which the filter forgets: a longer one smooths the velocity that it
            continues with, a shorter one follows turns [s].
        coast_s: Time constant with which the predicted velocity fades while a marker is unseen [s].
        max_speed_m_s: No part of a person is faster [m/s]; what seems to be is no measurement.
        noise_m: How far apart two measurements of a resting marker can lie [m].
    """

    max_gap_s: float = 0.3
    memory_s: float = 0.02
    coast_s: float = 0.1
    max_speed_m_s: float = 15.0
    noise_m: float = 0.02

    def __post_init__(self) -> None:
        for name in ("max_gap_s", "memory_s", "coast_s", "max_speed_m_s", "noise_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InvalidValueError(f"{name} must be positive and finite, not {value}")


class GapTracker:
    """Fills the gaps of markers, frame after frame, without looking ahead.

    A seen marker passes through as measured. An unseen one is predicted by a g-h filter (constant
    velocity, critically damped; [Brookner1998]), all markers in one array; its velocity fades. A marker that jumps
    farther than a person moves counts as unseen; where it stays, it is believed once the old track has
    been given up.

    Args:
        n_markers: Number M of markers.
        rate_hz: Frames per second [1/s].
        config: What a marker on a person can do.

    Raises:
        InvalidValueError: A number lies outside its range.
    """

    def __init__(self, n_markers: int, rate_hz: float, config: GapConfig | None = None) -> None:
        from filterpy.gh import GHFilter, critical_damping_parameters

        if n_markers < 1:
            raise InvalidValueError(f"n_markers must be at least 1, not {n_markers}")
        if not (np.isfinite(rate_hz) and rate_hz > 0):
            raise InvalidValueError(f"rate_hz must be positive and finite, not {rate_hz}")
        self.n_markers = n_markers
        self.rate_hz = rate_hz
        self.config = config or GapConfig()
        dt = 1.0 / rate_hz
        self._gains = critical_damping_parameters(float(np.exp(-dt / self.config.memory_s)))
        self._fade = float(np.exp(-dt / self.config.coast_s))
        self._max_gap_frames = max(1, round(self.config.max_gap_s * rate_hz))
        self._filter: Any = GHFilter(
            x=np.full((n_markers, 3), np.nan), dx=np.zeros((n_markers, 3)), dt=dt, g=0.0, h=0.0
        )
        self._last = np.full((n_markers, 3), np.nan)  # the last believed measurement
        self._unseen_frames: IntArray = np.zeros(n_markers, np.int64)
        self._seen_frames: IntArray = np.zeros(n_markers, np.int64)  # since the track began

    def update(self, markers: FloatArray) -> FloatArray:
        """Take one frame and return it with its gaps filled.

        Args:
            markers: Positions, shape (M, 3) [m]; a marker with any NaN is unseen.

        Returns:
            Shape (M, 3) [m]; NaN where a marker has not been seen yet, or not for ``max_gap_s``.

        Raises:
            FrameError: The shape is wrong, or a position is infinite.
        """
        from filterpy.gh import least_squares_parameters

        measured = np.asarray(markers, dtype=np.float64)
        if measured.shape != (self.n_markers, 3):
            raise FrameError(f"markers must have shape ({self.n_markers}, 3), not {measured.shape}")
        if np.isinf(measured).any():
            raise FrameError("a marker's position is infinite; a missing one is NaN")

        tracked = ~np.isnan(self._last[:, 0])
        seen = ~np.isnan(measured).any(axis=1)
        seen &= ~tracked | self._within_reach(measured)
        begun = seen & ~tracked
        held = tracked & ~seen
        self._filter.x[begun] = measured[begun]
        self._filter.dx[begun] = 0.0
        self._filter.dx[held] *= self._fade

        # a young track averages what it has; filterpy counts from 0
        g, h = least_squares_parameters(self._seen_frames[:, None])
        g, h = np.maximum(g, self._gains[0]), np.maximum(h, self._gains[1])
        g, h = np.where(begun[:, None], 1.0, g), np.where(begun[:, None], 0.0, h)
        prediction = self._filter.x + self._filter.dx * self._filter.dt
        self._filter.update(np.where(seen[:, None], measured, prediction), g, h)

        self._seen_frames = np.where(
            seen, np.where(begun, 1, self._seen_frames + 1), self._seen_frames
        )
        self._unseen_frames = np.where(seen, 0, self._unseen_frames + 1)
        self._last = np.where(seen[:, None], measured, self._last)
        self._give_up(held & (self._unseen_frames > self._max_gap_frames))
        return np.where(seen[:, None], measured, self._filter.x)

    def state(self) -> dict[str, Any]:
        """Return the whole state as plain arrays, so that `load_state` resumes bit for bit."""
        return {
            "position": self._filter.x.copy(),
            "velocity": self._filter.dx.copy(),
            "last": self._last.copy(),
            "unseen_frames": self._unseen_frames.copy(),
            "seen_frames": self._seen_frames.copy(),
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned.

        Raises:
            InvalidValueError: The state is that of another number of markers.
        """
        arrays = {name: np.array(state[name]) for name in self.state()}
        for name, own in self.state().items():
            if arrays[name].shape != own.shape:
                raise InvalidValueError(
                    f"{name} of the state has shape {arrays[name].shape}, not {own.shape}"
                )
        self._filter.x, self._filter.dx = arrays["position"], arrays["velocity"]
        self._last = arrays["last"]
        self._unseen_frames, self._seen_frames = arrays["unseen_frames"], arrays["seen_frames"]

    def _within_reach(self, measured: FloatArray) -> BoolArray:
        """Whether a person can have moved each marker here since it was last seen, shape (M,)."""
        elapsed_s = (self._unseen_frames + 1) / self.rate_hz
        reach = self.config.max_speed_m_s * elapsed_s + self.config.noise_m
        near: BoolArray = np.linalg.norm(measured - self._last, axis=1) <= reach
        return near

    def _give_up(self, lost: BoolArray) -> None:
        self._filter.x[lost] = np.nan
        self._filter.dx[lost] = 0.0
        self._last[lost] = np.nan
        self._seen_frames[lost] = 0

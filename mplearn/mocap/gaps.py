"""Markers that vanish for a moment, followed on-line: g-h filter and rigid neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ..errors import FrameError, InvalidValueError
from ..recording import BoolArray, FloatArray, IntArray
from ..state import Array, State, require, validated, within
from .rigidity import RigidityState, RigidNeighbours


@dataclass(frozen=True)
class GapConfig:
    """What a marker on a person can do.

    Attributes:
        max_gap_s: A marker unseen for longer is given up, as NaN, until it is seen again [s].
        memory_s: Time over which the filter forgets: a longer one smooths the velocity that it
            continues with, a shorter one follows turns [s].
        coast_s: Time constant with which a velocity fades while nothing at all is seen [s].
        max_speed_m_s: No part of a person is faster [m/s]; what seems to be is no measurement.
        noise_m: How far apart two measurements of a resting marker can lie [m].
    """

    max_gap_s: float = 0.5
    memory_s: float = 0.02
    coast_s: float = 0.1
    max_speed_m_s: float = 15.0
    noise_m: float = 0.02

    def __post_init__(self) -> None:
        for name in ("max_gap_s", "memory_s", "coast_s", "max_speed_m_s", "noise_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InvalidValueError(f"{name} must be positive and finite, not {value}")


@dataclass(frozen=True, eq=False)
class GapsState(State):
    """Tracks of M markers.

    Attributes:
        position: Of each marker, filtered, shape (M, 3) [m].
        velocity: Shape (M, 3) [m/s].
        last: The last believed measurement, shape (M, 3) [m]; NaN where there is no track.
        unseen_frames: Since when each marker is unseen [frame], shape (M,).
        neighbours: What markers say about each other.
    """

    position: Annotated[FloatArray, Array("m", 3, nan=True)]
    velocity: Annotated[FloatArray, Array("m", 3)]
    last: Annotated[FloatArray, Array("m", 3, nan=True)]
    unseen_frames: Annotated[IntArray, Array("m", low=0)]
    neighbours: RigidityState


class GapTracker:
    """Fills the gaps of markers, frame after frame, without looking ahead.

    A seen marker passes through as measured. An unseen one is where its rigid neighbours say; where
    fewer than three others help, a g-h filter (constant velocity, critically damped, all markers in
    one array; [Brookner1998]) continues it, and its velocity fades. A marker that jumps farther
    than a person moves counts as unseen; where it stays, it is believed once the old track is
    given up.

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
        g, h = critical_damping_parameters(float(np.exp(-dt / self.config.memory_s)))
        self._filter: Any = GHFilter(
            x=np.full((n_markers, 3), np.nan), dx=np.zeros((n_markers, 3)), dt=dt, g=g, h=h
        )
        self._fade = float(np.exp(-dt / self.config.coast_s))
        self._max_gap_frames = max(1, round(self.config.max_gap_s * rate_hz))
        self._neighbours = RigidNeighbours(n_markers, rate_hz)
        self._last = np.full((n_markers, 3), np.nan)  # the last believed measurement; NaN: no track
        self._unseen_frames: IntArray = np.zeros(n_markers, np.int64)

    def update(self, markers: FloatArray) -> FloatArray:
        """Take one frame and return it with its gaps filled.

        Args:
            markers: Positions, shape (M, 3) [m]; a marker with any NaN is unseen.

        Returns:
            Shape (M, 3) [m]; NaN where a marker has not been seen yet, or not for ``max_gap_s``.

        Raises:
            FrameError: The shape is wrong, or a position is infinite.
        """
        measured = np.asarray(markers, dtype=np.float64)
        if measured.shape != (self.n_markers, 3):
            raise FrameError(f"markers must have shape ({self.n_markers}, 3), not {measured.shape}")
        seen = np.isfinite(measured).all(axis=1)
        if not seen.all() and np.isinf(measured).any():
            raise FrameError("a marker's position is infinite; a missing one is NaN")

        tracked = ~np.isnan(self._last[:, 0])
        seen &= ~tracked | self._within_reach(measured)
        begun, held = seen & ~tracked, tracked & ~seen
        filled = np.where(seen[:, None], measured, np.nan)
        guesses = self._neighbours.update(filled, held)
        state = self._filter
        state.x[begun], state.dx[begun] = measured[begun], 0.0
        if held.any():
            filled[held] = guesses
            blind = held & ~(tracked & self._within_reach(filled))
            state.dx[blind] *= self._fade
            filled[blind] = state.x[blind] + state.dx[blind] * state.dt
        state.update(filled)

        self._last[seen] = measured[seen]
        self._unseen_frames = np.where(seen, 0, self._unseen_frames + 1)
        lost = self._unseen_frames > self._max_gap_frames
        if lost.any():
            self._last[lost], filled[lost] = np.nan, np.nan
        return filled

    def state(self) -> GapsState:
        """Return the whole state; `load_state` resumes bit for bit."""
        return GapsState(
            position=self._filter.x.copy(),
            velocity=self._filter.dx.copy(),
            last=self._last.copy(),
            unseen_frames=self._unseen_frames.copy(),
            neighbours=self._neighbours.state(),
        )

    def load_state(self, state: GapsState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: The state is damaged, or that of another number of markers.
        """
        state = validated(state)
        n = len(state.last)
        require(n == self.n_markers, "last", f"is of {n} markers, not of {self.n_markers}")
        with within("neighbours"):
            self._neighbours.load_state(state.neighbours)
        self._filter.x, self._filter.dx = state.position.copy(), state.velocity.copy()
        self._last, self._unseen_frames = state.last.copy(), state.unseen_frames.copy()

    def _within_reach(self, positions: FloatArray) -> BoolArray:
        """Whether a person can have moved each marker here since it was last seen, shape (M,)."""
        reach_m = self.config.max_speed_m_s / self.rate_hz * (self._unseen_frames + 1)
        way = positions - self._last
        near: BoolArray = (way * way).sum(axis=1) <= (reach_m + self.config.noise_m) ** 2
        return near

"""Markers that vanish for a moment, followed on-line: g-h filter and rigid neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from ..errors import FrameError, InvalidValueError
from ..maths.compiling import njit
from ..recording import FloatArray, IntArray
from ..state import Array, State, require, validated, within
from .rigidity import LookRules, Neighbours, RigidityState, predict, see_neighbours


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

    Example:
        >>> GapConfig(max_gap_s=0.2).max_speed_m_s  # gives up sooner
        15.0
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
    velocity: Annotated[FloatArray, Array("m", 3, nan=True)]
    last: Annotated[FloatArray, Array("m", 3, nan=True)]
    unseen_frames: Annotated[IntArray, Array("m", low=0)]
    neighbours: RigidityState

    def check(self) -> None:
        """Check that what is tracked is somewhere, and that nothing is unseen for too long."""
        lost = np.isnan(self.last)
        whole = bool((lost.all(axis=1) == lost.any(axis=1)).all())
        require(whole, "last", "must be finite, or missing, in all of x, y, z")
        for name in ("position", "velocity"):
            known = bool((lost | np.isfinite(getattr(self, name))).all())
            require(known, name, "must be finite where a marker is tracked")
        frames = self.neighbours.frames
        fits = bool((self.unseen_frames <= frames).all())
        require(fits, "unseen_frames", f"must be at most {frames}")


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

    Example:
        >>> tracker = GapTracker(n_markers=1, rate_hz=100.0)
        >>> for k in range(50):
        ...     frame = tracker.update(np.array([[0.01 * k, 0.0, 1.0]]))
        >>> hidden = tracker.update(np.array([[np.nan, np.nan, np.nan]]))
        >>> bool(abs(hidden[0, 0] - 0.5) < 0.01)  # it went on
        True
    """

    def __init__(self, n_markers: int, rate_hz: float, config: GapConfig | None = None) -> None:
        from filterpy.gh import critical_damping_parameters

        if n_markers < 1:
            raise InvalidValueError(f"n_markers must be at least 1, not {n_markers}")
        if not (np.isfinite(rate_hz) and rate_hz > 0):
            raise InvalidValueError(f"rate_hz must be positive and finite, not {rate_hz}")
        self.n_markers = n_markers
        self.rate_hz = rate_hz
        self.config = config or GapConfig()
        dt = 1.0 / rate_hz
        g, h = critical_damping_parameters(float(np.exp(-dt / self.config.memory_s)))
        self._rules = GapRules(
            dt=dt,
            g=float(g),
            h=float(h),
            fade=float(np.exp(-dt / self.config.coast_s)),
            reach_m=self.config.max_speed_m_s * dt,
            noise_m=self.config.noise_m,
            max_gap_frames=max(1, round(self.config.max_gap_s * rate_hz)),
        )
        self._looks = LookRules.at(rate_hz)
        self._tracks = Tracks.empty(n_markers)
        self._neighbours = Neighbours.empty(n_markers)

    def update(self, markers: FloatArray) -> FloatArray:
        """Take one frame and return it with its gaps filled.

        Args:
            markers: Positions, shape (M, 3) [m]; a marker with any NaN is unseen.

        Returns:
            Shape (M, 3) [m]; NaN where a marker has not been seen yet, or not for ``max_gap_s``.

        Raises:
            FrameError: The shape is wrong, or a position is infinite.
        """
        frame = np.asarray(markers, dtype=np.float64)
        if frame.shape != (self.n_markers, 3):
            raise FrameError(f"markers must have shape ({self.n_markers}, 3), not {frame.shape}")
        return np.asarray(self.update_many(frame[None])[0])

    def update_many(self, frames: FloatArray) -> FloatArray:
        """Take many frames, shape (T, M, 3): bit-identical to `update` in a loop.

        Raises:
            FrameError: The shape is wrong, or a position is infinite.
        """
        frames = np.ascontiguousarray(frames, dtype=np.float64)
        if frames.shape[1:] != (self.n_markers, 3):
            raise FrameError(f"frames must have shape (T, {self.n_markers}, 3), not {frames.shape}")
        if np.isinf(frames).any():
            raise FrameError("a marker's position is infinite; a missing one is NaN")
        return np.asarray(
            fill_gaps(frames, self._tracks, self._neighbours, self._rules, self._looks)
        )

    def state(self) -> GapsState:
        """Return the whole state; `load_state` resumes bit for bit."""
        copies = {name: each.copy() for name, each in self._tracks._asdict().items()}
        return GapsState(**copies, neighbours=self._neighbours.state())

    def load_state(self, state: GapsState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: The state is damaged, or that of another number of markers.
        """
        state = validated(state)
        n = len(state.last)
        require(n == self.n_markers, "last", f"is of {n} markers, not of {self.n_markers}")
        lost, longest = np.isnan(state.last[:, 0]), self._rules.max_gap_frames
        never = state.unseen_frames == state.neighbours.frames
        fits = bool((lost == ((state.unseen_frames > longest) | never)).all())
        require(fits, "last", f"must be missing where a marker is unseen for over {longest} frames")
        with within("neighbours"):
            self._neighbours = Neighbours.from_state(state.neighbours, n)
        self._tracks = Tracks(
            state.position.copy(),
            state.velocity.copy(),
            state.last.copy(),
            state.unseen_frames.copy(),
        )


class Tracks(NamedTuple):
    """The markers' tracks, for kernels, which change them in place; see `GapsState`."""

    position: FloatArray
    velocity: FloatArray
    last: FloatArray
    unseen_frames: IntArray

    @classmethod
    def empty(cls, m: int) -> Tracks:
        """Return those of m markers that were never seen."""
        nowhere = np.full((m, 3), np.nan)
        return cls(nowhere, np.zeros((m, 3)), nowhere.copy(), np.zeros(m, dtype=np.int64))


class GapRules(NamedTuple):
    """What a marker can do, for kernels.

    Attributes:
        dt: Time between frames [s].
        g: Share of its error by which the filter corrects a position.
        h: The same of a velocity, over dt.
        fade: What is left of a velocity after a frame in which nothing is seen.
        reach_m: How far a marker comes in a frame at most [m].
        noise_m: How far apart two measurements of a resting marker can lie [m].
        max_gap_frames: Frames after which an unseen marker is given up.
    """

    dt: float
    g: float
    h: float
    fade: float
    reach_m: float
    noise_m: float
    max_gap_frames: int


@njit(cache=True)
def fill_gaps(
    frames: FloatArray, tracks: Tracks, neighbours: Neighbours, rules: GapRules, looks: LookRules
) -> FloatArray:
    """Return frames, shape (T, M, 3), with their gaps filled; see `GapTracker`."""
    out = np.empty_like(frames)
    n_markers = frames.shape[1]
    seen, held = np.empty(n_markers, dtype=np.bool_), np.empty(n_markers, dtype=np.bool_)
    for t in range(len(frames)):
        filled = out[t]
        for m in range(n_markers):
            at = frames[t, m]
            tracked = tracks.last[m, 0] == tracks.last[m, 0]
            seen[m] = at[0] == at[0] and at[1] == at[1] and at[2] == at[2]
            if seen[m] and tracked:
                seen[m] = _within_reach(at, m, tracks, rules)
            held[m] = tracked and not seen[m]
            if not seen[m]:
                filled[m] = np.nan
                continue
            filled[m] = at
            if not tracked:
                tracks.position[m] = at
                tracks.velocity[m] = 0.0
        see_neighbours(filled, held, neighbours, looks)
        for m in range(n_markers):
            if held[m]:  # what is seen of the frame is `before` by now
                filled[m] = predict(m, neighbours.before, neighbours)
                if not _within_reach(filled[m], m, tracks, rules):
                    for i in range(3):
                        tracks.velocity[m, i] *= rules.fade
                        filled[m, i] = tracks.position[m, i] + tracks.velocity[m, i] * rules.dt
            for i in range(3):
                ahead = tracks.position[m, i] + tracks.velocity[m, i] * rules.dt
                error = filled[m, i] - ahead
                tracks.position[m, i] = ahead + rules.g * error
                tracks.velocity[m, i] += rules.h * error / rules.dt
            if seen[m]:
                tracks.last[m] = frames[t, m]
                tracks.unseen_frames[m] = 0
                continue
            tracks.unseen_frames[m] += 1
            if tracks.unseen_frames[m] > rules.max_gap_frames:
                tracks.last[m] = np.nan
                filled[m] = np.nan
    return out


@njit(cache=True)
def _within_reach(at: FloatArray, m: int, tracks: Tracks, rules: GapRules) -> bool:
    """Say whether a person can have moved a marker here since it was last seen."""
    way = 0.0
    for i in range(3):
        way += (at[i] - tracks.last[m, i]) ** 2
    return bool(way <= (rules.reach_m * (tracks.unseen_frames[m] + 1) + rules.noise_m) ** 2)

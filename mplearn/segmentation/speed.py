"""Rests and reversals of a stream, found in its speed as it arrives.

One state machine over the speed of the whole body. While something moves, it looks for a reversal
(a local minimum far below the peaks on both sides) or a pause (a low speed that lasts); while
nothing moves, for the rise that ends the pause. What is low is measured against the running speed
of the moving part, so that the unit of the channels does not matter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from ..errors import InvalidValueError
from ..recording import FloatArray
from .base import frames_of


@dataclass(frozen=True)
class ZeroVelocityConfig:
    """Settings of the watch over the speed; times in seconds, speeds as shares of the own speed.

    Attributes:
        cutoff_hz: Corner of the low-pass filter [1/s].
        hysteresis: A minimum of the speed is a boundary if it lies below this share of both peaks
            around it.
        still_share: Below this share of the running speed the body counts as still.
        still_s: A pause lasts at least this long [s].
        min_length_s: Shortest motion [s].
        max_length_s: An open segment is closed at this length [s].
        memory_s: Time constant of the running speed [s].
    """

    cutoff_hz: float = 6.0
    hysteresis: float = 0.3
    still_share: float = 0.1
    still_s: float = 0.3
    min_length_s: float = 0.3
    max_length_s: float = 10.0
    memory_s: float = 30.0

    def __post_init__(self) -> None:
        for name in ("cutoff_hz", "still_s", "min_length_s", "memory_s"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InvalidValueError(f"{name} must be positive, not {getattr(self, name)}")
        for name in ("hysteresis", "still_share"):
            if not 0 < getattr(self, name) < 1:
                raise InvalidValueError(f"{name} must lie in (0, 1), not {getattr(self, name)}")
        if not self.max_length_s > 2 * max(self.min_length_s, self.still_s):
            raise InvalidValueError(
                f"max_length_s must exceed twice min_length_s and still_s, not {self.max_length_s}"
            )


MOVING, STILL, OPENING = 0, 1, 2

STATE = np.dtype(
    [
        ("frames", "i8"),  # seen so far
        ("start", "i8"),  # of the open segment, in filtered time
        ("mode", "i8"),
        ("peak", "f8"),  # highest speed of the open segment
        ("valley", "f8"),  # lowest speed since that peak
        ("valley_frame", "i8"),
        ("dip_frame", "i8"),  # since when speed is low (moving) or high (still); -1: it is not
        ("mean", "f8"),  # forgetful means of the speed and of its square root
        ("mean_root", "f8"),
        ("rest", "f8"),  # mean speed of the open pause, and over how many frames
        ("rest_frames", "i8"),
    ]
)
SETTINGS = np.dtype(
    [
        ("still_share", "f8"),
        ("still", "i8"),
        ("shortest", "i8"),
        ("longest", "i8"),
        ("forget", "f8"),
        ("lag", "i8"),
    ]
)


def settings_of(config: ZeroVelocityConfig, rate_hz: float, lag_frames: float) -> Any:
    """Convert the settings to frames, shape (1,)."""
    settings = np.zeros(1, dtype=SETTINGS)
    settings["still_share"] = config.still_share
    settings["still"] = frames_of(config.still_s, rate_hz)
    settings["shortest"] = frames_of(config.min_length_s, rate_hz)
    settings["longest"] = frames_of(config.max_length_s, rate_hz)
    settings["forget"] = 1.0 / frames_of(config.memory_s, rate_hz)
    settings["lag"] = round(lag_frames)
    return settings


def initial_state() -> Any:
    """Return the state before the first frame, shape (1,)."""
    state = np.zeros(1, dtype=STATE)
    state["mode"] = OPENING
    state["dip_frame"] = -1
    return state


@njit(cache=True)
def running_speed(m: Any) -> float:
    """Speed of the moving part of the stream, (E[s] / E[sqrt s])^2, which rest hardly lowers."""
    ratio = m.mean / m.mean_root if m.mean_root > 0.0 else 0.0
    return ratio * ratio


@njit(cache=True)
def see_speed(m: Any, p: Any, s: float) -> None:
    """Count the new frame, and take its speed into the running means (hardly, during a pause)."""
    m.frames += 1
    weight = p.forget if m.mode != STILL else 0.05 * p.forget
    weight = max(weight, 1.0 / m.frames)
    m.mean += weight * (s - m.mean)
    m.mean_root += weight * (math.sqrt(s) - m.mean_root)


@njit(cache=True)
def close(m: Any, p: Any, end: int, confidence: float, still: bool, out: FloatArray) -> int:
    """Write the open segment, closed at filtered frame `end`, into `out`; the next starts there."""
    first = max(m.start - p.lag, 0)
    last = max(min(end - p.lag, m.frames), first + 1)
    out[0, 0] = first
    out[0, 1] = last
    out[0, 2] = confidence
    out[0, 3] = m.frames - 1
    out[0, 4] = still
    m.start = last + p.lag
    return 1


@njit(cache=True)
def _watch_motion(m: Any, p: Any, s: float, low: float, hysteresis: float, out: FloatArray) -> int:
    """Look for the reversal or the pause that ends a motion."""
    t = m.frames - 1
    if s > m.peak:
        m.peak = s
        m.valley = s
        m.valley_frame = t
    elif s < m.valley:
        m.valley = s
        m.valley_frame = t
    if s >= 1.5 * low:
        m.dip_frame = -1
    elif s < low and m.dip_frame < 0:
        m.dip_frame = t
    n = 0
    if m.dip_frame >= 0 and t - m.dip_frame >= p.still:
        if m.dip_frame - m.start >= p.shortest:
            n = close(m, p, m.dip_frame, 1.0 - m.valley / low, False, out)
        m.mode = STILL
        m.rest = 0.5 * low
        m.rest_frames = p.still
        m.dip_frame = -1
    elif m.valley < hysteresis * m.peak and s >= max(m.valley / hysteresis, low):
        if m.valley_frame - m.start >= p.shortest:
            sure = 1.0 - m.valley / (hysteresis * m.peak)
            n = close(m, p, m.valley_frame, sure, False, out)
            m.peak = s
            m.mode = MOVING
        m.valley = s
        m.valley_frame = t
    return n


@njit(cache=True)
def _watch_pause(m: Any, p: Any, s: float, low: float, out: FloatArray) -> int:
    """Look for the rise that ends a pause."""
    t = m.frames - 1
    if m.mode == OPENING:  # no motion has been seen yet: the rest itself is the only measure
        low = 2.0 * m.rest
    if s <= low or m.mode == OPENING:
        m.rest_frames += 1
        m.rest += (s - m.rest) / m.rest_frames
    if s <= low:
        m.dip_frame = -1
    elif m.dip_frame < 0:
        m.dip_frame = t
    if s <= max(2.0 * low, 4.0 * m.rest) or m.dip_frame - m.start < p.still:
        return 0
    n = close(m, p, m.dip_frame, 1.0 - low / s, True, out)
    m.mode = MOVING
    m.peak = s
    m.valley = s
    m.valley_frame = t
    m.dip_frame = -1
    return n


@njit(cache=True)
def watch(m: Any, p: Any, s: float, hysteresis: float, out: FloatArray) -> int:
    """Judge speed `s` of the frame that `see_speed` has counted.

    Args:
        m: The state, a record of `STATE`.
        p: The settings, a record of `SETTINGS`.
        s: Speed.
        hysteresis: A minimum is a reversal if it lies below this share of the peaks around it.
        out: Receives ``start, end, confidence, decided_at, still`` of what closes, shape (n, 5).

    Returns:
        How many segments closed, 0 or 1.
    """
    low = p.still_share * running_speed(m)
    n = 0
    if m.mode != MOVING:
        n = _watch_pause(m, p, s, low, out)
    if n == 0 and m.mode != STILL:
        n = _watch_motion(m, p, s, low, hysteresis, out)
    if n == 0 and m.frames - 1 - m.start >= p.longest:
        end = m.frames - 1
        if m.mode != STILL and m.valley_frame - m.start >= p.shortest:
            end = m.valley_frame
        n = close(m, p, end, 0.0, m.mode == STILL or m.peak <= low, out)
        m.dip_frame = -1
        m.peak = s
        m.valley = s
        m.valley_frame = m.frames - 1
    return n

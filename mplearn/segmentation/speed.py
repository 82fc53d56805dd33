"""The speed of the whole body as it arrives: its settings, its running measure, and its segments.

What is low is measured against the running speed of the moving part, so that the unit of the
channels does not matter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from ..errors import InvalidValueError
from ..recording import FloatArray
from .base import check_positive, check_share, frames_of
from .kernels import all_finite, smooth_velocity


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
        trust: How much what is known about the motion's end counts, see `Segmenter.scaffold`:
            hysteresis times this where the end is sure, divided by it where it is sure not to be.
    """

    cutoff_hz: float = 6.0
    hysteresis: float = 0.3
    still_share: float = 0.1
    still_s: float = 0.3
    min_length_s: float = 0.4
    max_length_s: float = 10.0
    memory_s: float = 30.0
    trust: float = 1.3

    def __post_init__(self) -> None:
        check_positive(self, "cutoff_hz", "still_s", "min_length_s", "memory_s", "trust")
        check_share(self, "hysteresis", "still_share")
        if not self.trust >= 1.0:
            raise InvalidValueError(f"trust must be at least 1, not {self.trust}")
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
        ("ending", "f8"),  # how likely the open segment is at its end, as far as others know
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
        ("trust", "f8"),
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
    settings["trust"] = config.trust
    return settings


def initial_state() -> Any:
    """Return the state before the first frame, shape (1,)."""
    state = np.zeros(1, dtype=STATE)
    state["mode"] = OPENING
    state["dip_frame"] = -1
    state["ending"] = 0.5
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
def readiness(m: Any, p: Any) -> float:
    """By how much a boundary is likelier than without knowledge: 1 where nothing is known."""
    return float(p.trust ** (2.0 * m.ending - 1.0))


@njit(cache=True)
def take_speed(
    frame: FloatArray, filter_: FloatArray, memory: FloatArray, m: Any, p: Any, speeds: FloatArray
) -> float:
    """Filter and count a frame, keep its speed in the ring `speeds`; -1 if it is not finite."""
    if not all_finite(frame):
        return -1.0
    s = smooth_velocity(frame, filter_, memory, m.frames == 0)
    see_speed(m, p, s)
    speeds[(m.frames - 1) % speeds.shape[0]] = s
    return float(s)


@njit(cache=True)
def all_low(m: Any, end: int, low: float, speeds: FloatArray) -> bool:
    """Whether no speed of the open segment up to filtered frame `end` exceeds `low`."""
    size = speeds.shape[0]
    for u in range(max(m.start, m.frames - size), end):  # noqa: SIM110 (numba)
        if speeds[u % size] > low:
            return False
    return True


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

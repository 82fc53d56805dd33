"""The speed of the whole body as it arrives: its settings, its running measure, and its segments.

What is low is measured against the running speed of the moving part, so that the unit of the
channels does not matter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidValueError
from ..maths.compiling import njit
from ..recording import CAUSES, FloatArray
from .base import check_positive, check_share, frames_of
from .kernels import Smooth, all_finite, smooth_velocity


@dataclass(frozen=True)
class ZeroVelocityConfig:
    """Settings of the watch over the speed; times in seconds, speeds as shares of the own speed.

    Attributes:
        cutoff_hz: Corner of the low-pass filter [1/s].
        hysteresis: A minimum of the speed is a boundary if it lies below this share of both peaks
            around it.
        still_share: Below this share of the running speed the body counts as still.
        still_s: A pause lasts at least this long [s].
        min_length_s: Shortest motion [s]; of a stream's first half of it, for that may have begun
            before the stream.
        max_length_s: An open segment is closed at this length [s].
        memory_s: Time constant of the running speed [s].
        trust: How much what is known about the motion's end counts, see `Segmenter.scaffold`:
            hysteresis times this where the end is sure, divided by it where it is sure not to be.

    Example:
        >>> import numpy as np
        >>> from mplearn.segmentation import ZeroVelocity
        >>> lifts = np.sin(np.pi * np.arange(400) / 100.0)[:, None]  # turns each second
        >>> patient = ZeroVelocity(1, 100.0, ZeroVelocityConfig(min_length_s=1.5))
        >>> len(ZeroVelocity(1, 100.0).segment(lifts)) > len(patient.segment(lifts))
        True
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
REST, DIP, TURN, RETURN, CHANGE, LENGTH = range(1, 7)  # places in `CAUSES`
KNOWN = CAUSES.index("known")

CUT = np.dtype(
    [
        ("start", "i8"),  # of the segment that closed, in frames of the stream
        ("end", "i8"),
        ("confidence", "f8"),
        ("decided_at", "i8"),
        ("still", "?"),
        ("cause", "i8"),
    ]
)
MOST_CUTS = 2  # segments that one frame can close

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


class Watched(NamedTuple):
    """What all segmenters that watch the speed work on.

    Attributes:
        low_pass: The filter's coefficients, see `smooth_velocity`.
        settings: Shape (1,), of `SETTINGS`.
        smooth: The filter.
        state: Shape (1,), of `STATE`.
        speeds: The latest speeds, a ring.
    """

    low_pass: FloatArray
    settings: Any
    smooth: Smooth
    state: Any
    speeds: FloatArray


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
def take_speed(frame: FloatArray, watched: Watched) -> float:
    """Filter and count a frame, keep its speed in the ring `speeds`; -1 if it is not finite."""
    low_pass, settings, smooth, state, speeds = watched
    m, p = state[0], settings[0]
    if not all_finite(frame):
        return -1.0
    s = smooth_velocity(frame, low_pass, smooth, m.frames == 0)
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
def close(
    m: Any, p: Any, end: int, confidence: float, still: bool, cause: int, out: Any, row: int
) -> int:
    """Close the open segment at filtered frame `end`; the next starts there.

    Filtered time runs `lag` frames behind the stream's.

    Returns:
        How many rows of `out` are written now.
    """
    first = max(m.start - p.lag, 0)
    last = max(min(end - p.lag, m.frames), first + 1)
    cut = out[row]
    cut.start = first
    cut.end = last
    cut.confidence = confidence
    cut.decided_at = m.frames - 1
    cut.still = still
    cut.cause = cause
    m.start = last + p.lag
    return row + 1

"""Zero-velocity segmentation: a boundary where the whole body comes to rest or turns round.

[Fod2002] cuts where joint velocities cross zero. Here one speed is watched, the norm of the
low-pass velocity of all channels, with hysteresis: a boundary lies at the local minimum between two
peaks that both exceed it by far. It is decided as soon as the second rise has shown itself.
Nothing depends on the unit of the channels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from ..errors import InvalidValueError
from ..recording import FloatArray, Segment
from .base import KernelSegmenter, frames_of
from .kernels import design_low_pass, smooth_velocity


@dataclass(frozen=True)
class ZeroVelocityConfig:
    """Settings of `ZeroVelocity`; times in seconds, speeds as shares of the stream's own speed.

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
    still_share: float = 0.06
    still_s: float = 0.3
    min_length_s: float = 0.25
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


_STATE = np.dtype(
    [
        ("frame", "i8"),  # frames seen
        ("start", "i8"),  # of the open segment, in filtered time
        ("mode", "i8"),
        ("peak", "f8"),  # highest speed of the open segment
        ("valley", "f8"),  # lowest speed since that peak
        ("valley_frame", "i8"),
        ("dip_frame", "i8"),  # since when the speed is low (moving) or high (still); -1: it is not
        ("sum", "f8"),  # forgetful sums of speed and squared speed
        ("squares", "f8"),
        ("rest", "f8"),  # sum of the speeds of the open pause
    ]
)
_SETTINGS = np.dtype(
    [
        ("hysteresis", "f8"),
        ("still_share", "f8"),
        ("still", "i8"),
        ("shortest", "i8"),
        ("longest", "i8"),
        ("forget", "f8"),
        ("lag", "f8"),
    ]
)
_MOVING, _STILL, _OPENING = 0, 1, 2


@njit(cache=True)
def _emit(m: Any, lag: float, end: int, confidence: float, still: bool, out: FloatArray) -> int:
    """Write the open segment, closed at filtered frame `end`, into `out`; the next starts there."""
    shift = int(round(lag))
    first = max(m.start - shift, 0)
    last = max(min(end - shift, m.frame), first + 1)
    out[0, 0] = first
    out[0, 1] = last
    out[0, 2] = confidence
    out[0, 3] = m.frame - 1
    out[0, 4] = still
    m.start = last + shift
    return 1


@njit(cache=True)
def _moving(m: Any, p: Any, s: float, low: float, out: FloatArray) -> int:
    """Watch for the reversal or the pause that ends a motion."""
    t = m.frame - 1
    if s > m.peak:
        m.peak = s
        m.valley = s
        m.valley_frame = t
    elif s < m.valley:
        m.valley = s
        m.valley_frame = t
    if s >= low:
        m.dip_frame = -1
    elif m.dip_frame < 0:
        m.dip_frame = t
    if m.dip_frame >= 0 and t - m.dip_frame >= p.still:
        n = 0
        if m.dip_frame - m.start >= p.shortest:
            sure = 1.0 - m.valley / low
            n = _emit(m, p.lag, m.dip_frame, sure, False, out)
        m.mode = _STILL
        m.rest = low * 0.5 * (t + 1 - m.start)
        m.dip_frame = -1
        return n
    if m.valley < p.hysteresis * m.peak and s >= max(m.valley / p.hysteresis, low):
        n = 0
        if m.valley_frame - m.start >= p.shortest:
            sure = 1.0 - m.valley / (p.hysteresis * m.peak)
            n = _emit(m, p.lag, m.valley_frame, sure, False, out)
            m.peak = s
            m.mode = _MOVING
        m.valley = s
        m.valley_frame = t
        return n
    return 0


@njit(cache=True)
def _still(m: Any, p: Any, s: float, low: float, out: FloatArray) -> int:
    """Watch for the rise that ends a pause."""
    t = m.frame - 1
    mean = m.rest / max(t - m.start, 1)
    if m.mode == _OPENING:
        low = 2.0 * mean
    if s < low:
        m.dip_frame = -1
    elif m.dip_frame < 0:
        m.dip_frame = t
    m.rest += s
    if s < max(2.0 * low, 4.0 * mean) or m.dip_frame - m.start < p.still:
        return 0
    n = _emit(m, p.lag, m.dip_frame, 1.0 - low / s, True, out)
    m.mode = _MOVING
    m.peak = s
    m.valley = s
    m.valley_frame = t
    m.dip_frame = -1
    return n


@njit(cache=True)
def _step(
    frame: FloatArray, c: FloatArray, memory: FloatArray, state: Any, settings: Any, out: FloatArray
) -> int:
    """Take one frame; return the number of segments written to `out`, or -1 if it is not finite."""
    m, p = state[0], settings[0]
    for i in range(frame.shape[0]):
        if not math.isfinite(frame[i]):
            return -1
    s = smooth_velocity(frame, c, memory, m.frame == 0)
    m.frame += 1
    weight = p.forget if m.mode != _STILL else 0.05 * p.forget
    m.sum += weight * (s - m.sum)
    m.squares += weight * (s * s - m.squares)
    # the contraharmonic mean: the speed of the moving part, whatever share of time is rest
    low = p.still_share * m.squares / m.sum if m.sum > 0.0 else 0.0
    n = 0
    if m.mode != _MOVING:
        n = _still(m, p, s, low, out)
    if n == 0 and m.mode != _STILL:
        n = _moving(m, p, s, low, out)
    if n == 0 and m.frame - 1 - m.start >= p.longest:
        end = m.frame - 1
        if m.mode != _STILL and m.valley_frame - m.start >= p.shortest:
            end = m.valley_frame
        n = _emit(m, p.lag, end, 0.0, m.mode == _STILL or m.peak <= low, out)
        m.rest = 0.0
        m.dip_frame = -1
        m.peak = s
        m.valley = s
        m.valley_frame = m.frame - 1
    return n


class ZeroVelocity(KernelSegmenter):
    """Cuts where the speed of the whole body has a deep local minimum, or rests.

    Args:
        n_channels: Width D of a frame.
        rate_hz: Frames per second [1/s].
        config: Settings.

    Raises:
        InvalidValueError: An argument is out of range.
    """

    def __init__(
        self, n_channels: int, rate_hz: float, config: ZeroVelocityConfig | None = None
    ) -> None:
        super().__init__(n_channels, rate_hz)
        self.config = config = config or ZeroVelocityConfig()
        low_pass = design_low_pass(config.cutoff_hz, rate_hz)
        self._coefficients = low_pass.coefficients
        self._settings = np.array(
            [
                (
                    config.hysteresis,
                    config.still_share,
                    frames_of(config.still_s, rate_hz),
                    frames_of(config.min_length_s, rate_hz),
                    frames_of(config.max_length_s, rate_hz),
                    1.0 / frames_of(config.memory_s, rate_hz),
                    low_pass.lag_frames,
                )
            ],
            dtype=_SETTINGS,
        )
        self._reset()

    def _reset(self) -> None:
        self._arrays = {
            "memory": np.zeros((4, self.n_channels)),
            "state": np.zeros(1, dtype=_STATE),
        }
        self._arrays["state"]["mode"] = _OPENING
        self._arrays["state"]["dip_frame"] = -1

    def _step(self, frame: FloatArray) -> int:
        return int(
            _step(
                frame,
                self._coefficients,
                self._arrays["memory"],
                self._arrays["state"],
                self._settings,
                self._out,
            )
        )

    def _open(self) -> Segment | None:
        m = self._arrays["state"][0]
        shift = round(float(self._settings["lag"][0]))
        start, end = max(int(m["start"]) - shift, 0), int(m["frame"])
        if start >= end:
            return None
        low = 0.0
        if m["sum"] > 0:
            low = self.config.still_share * m["squares"] / m["sum"]
        still = bool(m["mode"] == _STILL or m["peak"] <= low)
        return Segment(start, end, confidence=0.0, decided_at=end - 1, still=still)

"""What segmenters that watch the speed share: one compiled step over a set of arrays."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any

import numpy as np

from ..errors import FrameError, InvalidValueError
from ..maths.filters import butterworth
from ..recording import FloatArray, Segment
from .base import Segmenter
from .speed import STILL, ZeroVelocityConfig, all_low, initial_state, running_speed, settings_of


class SpeedSegmenter(Segmenter):
    """A segmenter whose state is a set of arrays, and whose step is one compiled call.

    A subclass advances `_arrays` in `_step`, which returns how many rows ``start, end, confidence,
    decided_at, still`` it wrote to `_out` (-1: the frame is not finite, nothing has changed).

    Args:
        n_channels: Width D of a frame.
        rate_hz: Frames per second [1/s].
        speed: How the speed is watched.

    Raises:
        InvalidValueError: An argument is out of range.
    """

    _arrays: dict[str, Any]

    def __init__(self, n_channels: int, rate_hz: float, speed: ZeroVelocityConfig) -> None:
        if n_channels < 1:
            raise InvalidValueError(f"n_channels must be at least 1, not {n_channels}")
        if not (math.isfinite(rate_hz) and 10.0 <= rate_hz <= 1000.0):
            raise InvalidValueError(f"rate_hz must lie in [10, 1000], not {rate_hz}")
        self.n_channels = n_channels
        self.rate_hz = rate_hz
        gain, a1, a2, delay = butterworth(min(speed.cutoff_hz, 0.4 * rate_hz), rate_hz)
        self._filter = np.array([gain, 2.0 * gain, gain, a1, a2, rate_hz])
        self._settings = settings_of(
            speed, rate_hz, delay + 0.5
        )  # a difference is half a frame late
        self._out = np.zeros((1, 5))

    def _reset(self) -> None:
        """Return to the state before the first frame."""
        self._arrays = self._new_arrays()
        self._bind()

    def _new_arrays(self) -> dict[str, Any]:
        """Allocate the state before the first frame; a subclass adds arrays of its own."""
        arrays = {
            "memory": np.zeros((5, self.n_channels)),
            "state": initial_state(),
            "speeds": np.zeros(int(self._settings["longest"][0]) + 1),
        }
        arrays["memory"][4] = 1.0
        return arrays

    def _bind(self) -> None:
        """Bundle the arrays as the kernels take them; a subclass bundles its own, too."""
        a = self._arrays
        self._watcher = (self._filter, self._settings, a["memory"], a["state"], a["speeds"])

    @abstractmethod
    def _step(self, frame: FloatArray) -> int:
        """Take one frame that has the right shape."""

    def update(self, frame: FloatArray) -> list[Segment]:
        """Take one frame, shape (D,), and return the segments that are closed by now (often none).

        Raises:
            FrameError: The frame has the wrong width, or is not finite; nothing has changed then.
        """
        try:
            frame = np.ascontiguousarray(frame, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise FrameError(f"a frame must be {self.n_channels} numbers: {error}") from None
        if frame.shape != (self.n_channels,):
            raise FrameError(f"a frame must have shape ({self.n_channels},), not {frame.shape}")
        n = self._step(frame)
        if n == 0:
            return []
        if n < 0:
            bad = np.flatnonzero(~np.isfinite(frame))
            raise FrameError(
                f"{len(bad)} of {self.n_channels} channels are not finite (the first is channel "
                f"{bad[0]}: {frame[bad[0]]}); fill gaps before segmenting"
            )
        return [
            Segment(int(row[0]), int(row[1]), float(row[2]), int(row[3]), bool(row[4]))
            for row in self._out[:n]
        ]

    def scaffold(self, weights: FloatArray | None = None, ending: float = 0.5) -> None:
        """Tell the segmenter what is known about the motion now; see `Segmenter.scaffold`."""
        if not 0.0 <= ending <= 1.0:
            raise InvalidValueError(f"ending must lie in [0, 1], not {ending}")
        counts = np.ones(self.n_channels) if weights is None else np.asarray(weights, np.float64)
        if counts.shape != (self.n_channels,):
            raise InvalidValueError(
                f"weights must have shape ({self.n_channels},), not {counts.shape}"
            )
        if not (np.isfinite(counts).all() and (counts >= 0).all() and counts.any()):
            raise InvalidValueError("weights must be finite, at least 0, and not all 0")
        self._arrays["state"]["ending"] = ending
        self._arrays["memory"][4] = counts / counts.mean()

    def flush(self) -> list[Segment]:
        """Close what is open, as at the end of a stream, and start afresh at frame 0."""
        m, p = self._arrays["state"][0], self._settings[0]
        start, end = max(int(m["start"] - p["lag"]), 0), int(m["frames"])
        low = float(p["still_share"] * running_speed(m))
        still = bool(m["mode"] == STILL or all_low(m, end, low, self._arrays["speeds"]))
        self._reset()
        if start >= end:
            return []
        return [Segment(start, end, confidence=0.0, decided_at=end - 1, still=still)]

    def state(self) -> dict[str, Any]:
        """Return the whole state as plain values and arrays; `load_state` resumes bit for bit."""
        arrays = {name: array.copy() for name, array in self._arrays.items()}
        return {"segmenter": type(self).__name__, "rate_hz": self.rate_hz, **arrays}

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned.

        Raises:
            InvalidValueError: The state belongs to another kind, rate or width of segmenter.
        """
        own = {"segmenter": type(self).__name__, "rate_hz": self.rate_hz}
        for key, value in own.items():
            if state.get(key) != value:
                raise InvalidValueError(
                    f"the state's {key} must be {value!r}, not {state.get(key)!r}"
                )
        loaded = {}
        for name, array in self._arrays.items():
            if name not in state:
                raise InvalidValueError(f"the state lacks {name!r}")
            value = np.array(state[name], dtype=array.dtype)
            if value.shape != array.shape:
                raise InvalidValueError(
                    f"the state's {name!r} must have shape {array.shape}, not {value.shape}"
                )
            loaded[name] = value
        self._arrays = loaded
        self._bind()

"""What segmenters that watch the speed share: one compiled step over a set of arrays."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from inspect import signature
from typing import Any, TypeVar

import numpy as np

from ..errors import InvalidValueError
from ..maths.filters import butterworth
from ..recording import CAUSES, FloatArray, Segment
from ..state import require, validated
from .base import Segmenter, SegmenterState, as_frames, check_array, require_finite
from .kernels import Smooth
from .speed import (
    CUT,
    MOST_CUTS,
    STILL,
    Watched,
    ZeroVelocityConfig,
    all_low,
    initial_state,
    running_speed,
    settings_of,
)

Bundle = TypeVar("Bundle")


class SpeedSegmenter(Segmenter):
    """A segmenter whose state is a set of arrays, and whose step is one compiled call.

    A subclass advances `_arrays` in `_steps`, frame by frame, until one ends segments.

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
        late = delay + 0.5  # a difference is half a frame late
        self._settings = settings_of(speed, rate_hz, late)
        self._out = np.zeros(MOST_CUTS, dtype=CUT)

    def _reset(self) -> None:
        """Return to the state before the first frame."""
        self._arrays = self._new_arrays()
        self._bind()

    def _new_arrays(self) -> dict[str, Any]:
        """Allocate the state before the first frame; a subclass adds arrays of its own."""
        smooth = Smooth(*(np.zeros(self.n_channels) for _ in Smooth._fields))
        smooth.weights[:] = 1.0
        speeds = np.zeros(int(self._settings["longest"][0]) + 1)
        return {**smooth._asdict(), "state": initial_state(), "speeds": speeds}

    def _bind(self) -> None:
        """Bundle the arrays as the kernels take them; a subclass bundles its own, too."""
        a = self._arrays
        smooth = self._bound(Smooth)
        self._watched = Watched(self._filter, self._settings, smooth, a["state"], a["speeds"])

    def _bound(self, kind: Callable[..., Bundle]) -> Bundle:
        """Bundle the arrays that carry the names of a tuple's fields."""
        return kind(*(self._arrays[name] for name in signature(kind).parameters))

    @abstractmethod
    def _steps(self, frames: FloatArray) -> tuple[int, int]:
        """Take frames of the right shape, (T, D), until one ends segments.

        Returns:
            How many were taken, and how many rows the last of them wrote to `_out`; -1 where the
            next frame is not finite, which changes nothing.
        """

    def update(self, frame: FloatArray) -> list[Segment]:
        """Take one frame, shape (D,), and return the segments that are closed by now (often none).

        Raises:
            FrameError: The frame has the wrong width, or is not finite; nothing has changed then.
        """
        frame = as_frames(frame, (self.n_channels,))
        return self._advanced(frame[None])[1]

    def advance(self, frames: FloatArray) -> tuple[int, list[Segment]]:
        """Take frames until one closes segments; see `Segmenter.advance`."""
        frames = as_frames(frames, (-1, self.n_channels))
        return self._advanced(frames)

    def _advanced(self, frames: FloatArray) -> tuple[int, list[Segment]]:
        taken, n = self._steps(frames)
        if n == 0:
            return taken, []
        if n < 0 and taken == 0:
            require_finite(frames[0])
        return taken, self._closed(n)

    def _closed(self, n: int) -> list[Segment]:
        """Return the first so many segments of `_out`; none where n is -1."""
        return [
            Segment(
                int(cut["start"]),
                int(cut["end"]),
                float(cut["confidence"]),
                int(cut["decided_at"]),
                bool(cut["still"]),
                CAUSES[cut["cause"]],
            )
            for cut in self._out[: max(n, 0)]
        ]

    def scaffold(self, weights: FloatArray | None = None, ending: float = 0.5) -> None:
        """Tell the segmenter what is known about the motion now; see `Segmenter.scaffold`."""
        if not 0.0 <= ending <= 1.0:
            raise InvalidValueError(f"ending must lie in [0, 1], not {ending}")
        if weights is None:
            self._arrays["state"]["ending"] = ending
            self._arrays["weights"][:] = 1.0
            return
        counts = np.asarray(weights, np.float64)
        if counts.shape != (self.n_channels,):
            raise InvalidValueError(
                f"weights must have shape ({self.n_channels},), not {counts.shape}"
            )
        if not (np.isfinite(counts).all() and (counts >= 0).all() and counts.any()):
            raise InvalidValueError("weights must be finite, at least 0, and not all 0")
        self._arrays["state"]["ending"] = ending
        self._arrays["weights"][:] = counts / counts.mean()

    def flush(self) -> list[Segment]:
        """Close what is open, as at the end of a stream, and start afresh at frame 0."""
        m, p = self._arrays["state"][0], self._settings[0]
        start, end = max(int(m["start"] - p["lag"]), 0), int(m["frames"])
        low = float(p["still_share"] * running_speed(m))
        still = bool(m["mode"] == STILL or all_low(m, end, low, self._arrays["speeds"]))
        self._reset()
        if start >= end:
            return []
        return [Segment(start, end, 0.0, end - 1, still, "end")]

    def state(self) -> SegmenterState:
        """Return the whole state; `load_state` resumes bit for bit."""
        columns = {
            name: column.copy()
            for own, array in self._arrays.items()
            for name, column in _columns(own, array).items()
        }
        n_frames = int(self._arrays["state"]["frames"][0])
        return SegmenterState(type(self).__name__, self.rate_hz, n_frames, columns)

    def load_state(self, state: SegmenterState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: The state is damaged, or belongs to another kind, rate or width of
                segmenter; nothing has changed then.
        """
        state = validated(state)
        kind = type(self).__name__
        require(state.segmenter == kind, "segmenter", f"must be {kind!r}, not {state.segmenter!r}")
        require(
            state.rate_hz == self.rate_hz, "rate_hz", f"must be {self.rate_hz}, not {state.rate_hz}"
        )
        loaded = {name: array.copy() for name, array in self._arrays.items()}
        wanted = {
            name: column
            for own, array in loaded.items()
            for name, column in _columns(own, array).items()
        }
        lacking, strange = wanted.keys() - state.arrays.keys(), state.arrays.keys() - wanted.keys()
        require(not lacking, "arrays", f"lacks {sorted(lacking)}")
        require(not strange, "arrays", f"knows no {sorted(strange)}")
        for name, column in wanted.items():
            check_array(state.arrays[name], column, f"arrays.{name}")
            column[...] = state.arrays[name]
        frames = int(loaded["state"]["frames"][0])
        require(frames == state.n_frames, "n_frames", f"must be {frames}, not {state.n_frames}")
        for name, array in loaded.items():
            fine = array.dtype.kind != "i" or bool((array <= frames).all())
            require(fine, f"arrays.{name}", f"must name frames that were seen, {frames}")
        self._check_loaded(loaded)
        self._arrays = loaded
        self._bind()

    def _check_loaded(self, arrays: dict[str, Any]) -> None:
        """Check what was stored beyond its shapes; a subclass checks arrays of its own, too."""
        state = arrays["state"][0]
        frames = state["frames"]
        check_record(
            "state",
            state,
            {
                "frames": (0, np.inf),
                "mode": (0, 2),
                "start": (0, frames + 1),
                "ending": (0.0, 1.0),
                "valley_frame": (-1, frames),
                "dip_frame": (-1, frames),
                "rest_frames": (0, frames),
                **dict.fromkeys(("peak", "valley", "mean", "mean_root", "rest"), (0.0, np.inf)),
            },
        )


def check_record(name: str, record: Any, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Check that fields of a stored record lie in their ranges."""
    for field, (low, high) in ranges.items():
        require(
            low <= record[field] <= high,
            f"arrays.{name}.{field}",
            f"must lie in [{low:g}, {high:g}], not {record[field]:g}",
        )


def _columns(name: str, array: Any) -> dict[str, Any]:
    """Return the fields of an array of records by name, as views; any other array as it is."""
    if array.dtype.names is None:
        return {name: array}
    return {f"{name}.{each}": array[each] for each in array.dtype.names}

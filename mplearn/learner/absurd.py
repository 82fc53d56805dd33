"""Frames of plain channels that cannot be: they are held at what was seen before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..maths.compiling import njit
from ..recording import BoolArray, FloatArray, IntArray
from ..state import Array, Count, Range, State, require

FACTOR = 1000.0  # times the largest value so far that a value can be, or times one
PATIENCE_S = 0.5  # after so long it is believed


@dataclass(frozen=True, eq=False)
class AbsurdState(State):
    """What frames are held against.

    Attributes:
        last: The last frame that could be, shape (D,); NaN before the first.
        largest: The largest value so far, or one.
        in_a_row: Absurd frames since.
    """

    last: Annotated[FloatArray, Array("d", nan=True)]
    largest: Annotated[float, Range(1.0)]
    in_a_row: Count

    def check(self) -> None:
        """Check that the last frame is there, or is not."""
        missing = np.isnan(self.last)
        require(bool(missing.all() or not missing.any()), "last", "must be finite, or all missing")


class AbsurdFrames:
    """Finds frames that hold a value that is not finite, or far beyond all that was seen.

    Args:
        n_channels: Width of a frame.
        rate_hz: Frames per second [1/s].
    """

    def __init__(self, n_channels: int, rate_hz: float) -> None:
        self._last = np.full(n_channels, np.nan)
        self._largest = np.ones(1)
        self._in_a_row = np.zeros(1, dtype=np.int64)
        self._patience = max(1, round(PATIENCE_S * rate_hz))

    def hold(self, frames: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return frames, shape (T, D), the absurd ones held at the one before; and which they are.

        Before the first frame that can be, they stay what they are.
        """
        held, absurd = frames.copy(), np.zeros(len(frames), dtype=np.bool_)
        _hold(held, absurd, self._last, self._largest, self._in_a_row, self._patience)
        return held, absurd

    def state(self) -> AbsurdState:
        """Return everything."""
        return AbsurdState(self._last.copy(), float(self._largest[0]), int(self._in_a_row[0]))

    def load_state(self, state: AbsurdState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: It is of another number of channels.
        """
        shape = self._last.shape
        require(state.last.shape == shape, "last", f"must have shape {shape}")
        self._last = state.last.copy()
        self._largest[0], self._in_a_row[0] = state.largest, state.in_a_row


@njit(cache=True)
def _hold(
    frames: FloatArray,
    absurd: BoolArray,
    last: FloatArray,
    largest: FloatArray,
    in_a_row: IntArray,
    patience: int,
) -> None:
    for t in range(len(frames)):
        highest, finite = 0.0, True
        for d in range(frames.shape[1]):
            size = abs(frames[t, d])
            finite &= size <= BEYOND  # not for NaN
            highest = max(highest, size)
        far = finite and highest > FACTOR * largest[0] and last[0] == last[0]
        if not finite or (far and in_a_row[0] < patience):
            in_a_row[0] += 1
            absurd[t] = True
            if last[0] == last[0]:
                frames[t] = last
            continue
        in_a_row[0] = 0
        largest[0] = max(largest[0], highest)
        last[:] = frames[t]


BEYOND = 1e100  # squares of larger numbers are not finite

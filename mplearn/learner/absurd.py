"""Frames of plain channels that cannot be: they are held at what was seen before."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from ..maths.compiling import njit
from ..recording import BoolArray, FloatArray, IntArray
from ..state import Array, Count, Range, State, require

FACTOR = 1000.0  # times the largest value so far that a value can be, or times one
PATIENCE_S = 0.5  # after so long it is believed
STEP = 30.0  # times what a channel has passed through so far that it can move from frame to frame
SHARE = 0.05  # of the channel that has passed through most, where one was nearly at rest
BRIEF_S = 0.1  # after so long such a step is believed
FIRST = 100.0  # times the second frame's largest value that the first one's can be, or times one


@dataclass(frozen=True, eq=False)
class AbsurdState(State):
    """What frames are held against.

    Attributes:
        last: The last frame that could be, shape (D,); NaN before the first.
        largest: The largest value so far, or one.
        in_a_row: Absurd frames since.
        lowest: The lowest value of each channel so far, shape (D,); empty in what was kept before
            there was this.
        highest: The highest one.
        n_believed: Frames that could be, so far.
    """

    last: Annotated[FloatArray, Array("d", nan=True)]
    largest: Annotated[float, Range(1.0)]
    in_a_row: Count
    lowest: Annotated[FloatArray, Array("k", nan=True)] = field(default_factory=lambda: np.zeros(0))
    highest: Annotated[FloatArray, Array("k", nan=True)] = field(
        default_factory=lambda: np.zeros(0)
    )
    n_believed: Count = 2

    def check(self) -> None:
        """Check that the last frame is there, or is not, and lies where values lay."""
        missing = np.isnan(self.last)
        require(bool(missing.all() or not missing.any()), "last", "must be finite, or all missing")
        if len(self.lowest):
            require(
                len(self.lowest) == len(self.last), "lowest", f"must be {len(self.last)} values"
            )
            between = (self.lowest <= self.last) & (self.last <= self.highest)
            none = missing & np.isnan(self.lowest) & np.isnan(self.highest)
            require(bool((between | none).all()), "last", "must lie between lowest and highest")


class AbsurdFrames:
    """Finds frames that hold a value that is not finite, or far beyond all that was seen.

    Far beyond what channels have moved through so far is doubted for a moment only: a glitch is
    gone by then, and what stays is motion. The first frame is judged by the second.

    Args:
        n_channels: Width of a frame.
        rate_hz: Frames per second [1/s].
    """

    def __init__(self, n_channels: int, rate_hz: float) -> None:
        self._last, self._lowest, self._highest = np.full((3, n_channels), np.nan)
        self._largest = np.ones(1)
        self._counts = np.zeros(2, dtype=np.int64)  # absurd ones in a row, believed ones
        self._patience = max(1, round(PATIENCE_S * rate_hz))
        self._brief = max(1, round(BRIEF_S * rate_hz))

    def hold(self, frames: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return frames, shape (T, D), the absurd ones held at the one before; and which they are.

        Before the first frame that can be, they stay what they are.
        """
        held, absurd = frames.copy(), np.zeros(len(frames), dtype=np.bool_)
        passed = (self._last, self._lowest, self._highest)
        _hold(held, absurd, *passed, self._largest, self._counts, self._patience, self._brief)
        return held, absurd

    def through_first(self, frames: FloatArray) -> int:
        """Return how many frames there are up to the first that can be; none where it has come."""
        if self._counts[1]:
            return 0
        can_be = (np.abs(frames) <= BEYOND).all(axis=1)
        return int(can_be.argmax()) + 1 if can_be.any() else len(frames)

    def is_first_absurd(self, frames: FloatArray) -> bool:
        """Return whether the first frame was, as the one that comes now shows; it is forgotten."""
        if not (self._counts[1] == 1 and len(frames)):
            return False
        first, second = np.abs(self._last).max(), np.abs(frames[0]).max()
        if not first > FIRST * max(1.0, second):  # nor is NaN
            return False
        self._last[:] = self._lowest[:] = self._highest[:] = np.nan
        self._largest[:], self._counts[:] = 1.0, 0
        return True

    def state(self) -> AbsurdState:
        """Return everything."""
        in_a_row, n_believed = self._counts.tolist()
        passed = self._lowest.copy(), self._highest.copy()
        return AbsurdState(
            self._last.copy(), float(self._largest[0]), in_a_row, *passed, n_believed
        )

    def load_state(self, state: AbsurdState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: It is of another number of channels.
        """
        shape = self._last.shape
        require(state.last.shape == shape, "last", f"must have shape {shape}")
        self._last = state.last.copy()
        known = len(state.lowest) > 0
        self._lowest = (state.lowest if known else state.last).copy()
        self._highest = (state.highest if known else state.last).copy()
        n_believed = 0 if np.isnan(state.last).any() else max(state.n_believed, 1)
        self._largest[0], self._counts[:] = state.largest, (state.in_a_row, n_believed)


@njit(cache=True)
def _hold(
    frames: FloatArray,
    absurd: BoolArray,
    last: FloatArray,
    lowest: FloatArray,
    highest: FloatArray,
    largest: FloatArray,
    counts: IntArray,
    patience: int,
    brief: int,
) -> None:
    for t in range(len(frames)):
        size, finite = 0.0, True
        for d in range(frames.shape[1]):
            finite &= abs(frames[t, d]) <= BEYOND  # not for NaN
            size = max(size, abs(frames[t, d]))
        room = 0
        if counts[1] and size > FACTOR * largest[0]:
            room = patience
        elif counts[1] > 2 and _steps_far(frames[t], last, lowest, highest):
            room = brief
        if not finite or counts[0] < room:
            counts[0] += 1
            absurd[t] = True
            if counts[1]:
                frames[t] = last
            continue
        counts[0] = 0
        if not counts[1]:
            lowest[:] = highest[:] = frames[t]
        counts[1] += 1
        largest[0] = max(largest[0], size)
        last[:] = frames[t]
        lowest[:] = np.minimum(lowest, last)
        highest[:] = np.maximum(highest, last)


@njit(cache=True)
def _steps_far(
    frame: FloatArray, last: FloatArray, lowest: FloatArray, highest: FloatArray
) -> bool:
    """Return whether a channel steps many times as far as it has moved so far; of rests nothing."""
    most = (highest - lowest).max()
    for d in range(len(frame)):
        if abs(frame[d] - last[d]) > STEP * max(highest[d] - lowest[d], SHARE * most) > 0.0:
            return True
    return False


BEYOND = 1e100  # squares of larger numbers are not finite

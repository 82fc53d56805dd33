"""A window on the newest frames of a stream, in memory that does not grow with the stream."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray
from ..state import Array, Count, State, require


@dataclass(frozen=True, eq=False)
class BufferState(State):
    """The newest frames, shape (n, D), from frame ``first`` on."""

    first: Count
    frames: Annotated[FloatArray, Array(None, None)]


class FrameBuffer:
    """Holds the frames from ``first`` on; older ones are dropped on request.

    Args:
        n_channels: Width of a frame.

    Example:
        >>> held = FrameBuffer(2)
        >>> held.append(np.array([0.0, 0.0]))
        >>> held.extend(np.array([[k, 10.0 * k] for k in range(1, 5)]))
        >>> held.drop_before(3)
        >>> held.take(3, 5).tolist()
        [[3.0, 30.0], [4.0, 40.0]]
    """

    def __init__(self, n_channels: int) -> None:
        self.n_channels = n_channels
        self.first = 0
        self._frames = np.empty((256, n_channels))
        self._offset = 0
        self._count = 0

    def __len__(self) -> int:
        """Number of frames held."""
        return self._count

    @property
    def end(self) -> int:
        """Index of the frame that comes next."""
        return self.first + self._count

    def append(self, frame: FloatArray) -> None:
        """Add one frame, shape (D,)."""
        self.extend(frame[None])

    def extend(self, frames: FloatArray) -> None:
        """Add frames, shape (n, D)."""
        while len(frames):
            end = self._offset + self._count
            if end == len(self._frames):
                self._make_room()
                continue
            fit = frames[: len(self._frames) - end]
            self._frames[end : end + len(fit)] = fit
            self._count += len(fit)
            frames = frames[len(fit) :]

    @property
    def held(self) -> FloatArray:
        """All frames that are held, shape (n, D), until the next one comes; not to be written."""
        return self._frames[self._offset : self._offset + self._count]

    def take(self, start: int, end: int) -> FloatArray:
        """Return a copy of the frames [start, end), shape (end - start, D)."""
        if not self.first <= start < end <= self.end:
            raise InvalidValueError(
                f"[{start}, {end}) is not inside the buffer's [{self.first}, {self.end})"
            )
        at = self._offset + start - self.first
        return self._frames[at : at + end - start].copy()

    def drop_before(self, frame: int) -> None:
        """Forget the frames before ``frame``."""
        dropped = min(max(frame - self.first, 0), self._count)
        self.first += dropped
        self._offset += dropped
        self._count -= dropped

    def state(self) -> BufferState:
        """Return what the buffer holds."""
        return BufferState(self.first, self.held.copy())

    def load_state(self, state: BufferState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: The frames have another width.
        """
        width = state.frames.shape[1]
        require(width == self.n_channels, "frames", f"must be {self.n_channels} wide, not {width}")
        self.first, self._offset, self._count = state.first, 0, 0
        self.extend(state.frames)

    def _make_room(self) -> None:
        """Move the frames to the front, into a larger array only where they fill half of this."""
        room = len(self._frames) * (2 if self._count > len(self._frames) // 2 else 1)
        frames = np.empty((room, self.n_channels))
        frames[: self._count] = self.held
        self._frames, self._offset = frames, 0

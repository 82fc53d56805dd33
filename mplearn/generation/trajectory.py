"""A generated motion: what a robot is asked to do, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray, IntArray

MAX_FRAMES = 5_000_000


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion through one or more primitives.

    Attributes:
        frames: Values of the channels, shape (T, D) [rad, m, as the channels].
        rate_hz: Frames per second [1/s].
        channels: Name of each column, length D.
        primitive_ids: The primitive that each frame belongs to, shape (T,).
        starts: First frame of each primitive of the path, shape (P,); by default where
            ``primitive_ids`` changes. (A primitive that follows itself starts anew.)

    Raises:
        InvalidValueError: Shapes disagree, a value is not finite, or ``starts`` does not fit.

    Example:
        >>> motion = Trajectory(np.zeros((4, 1)), 50.0, ("knee_r",), np.array([7, 7, 9, 9]))
        >>> motion.starts.tolist()
        [0, 2]
    """

    frames: FloatArray
    rate_hz: float
    channels: tuple[str, ...]
    primitive_ids: IntArray
    starts: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        frames = np.array(self.frames, dtype=np.float64)
        ids = np.array(self.primitive_ids, dtype=np.int64)
        starts = np.array(self.starts, dtype=np.int64)
        if frames.ndim != 2 or len(frames) < 1 or frames.shape[1] != len(self.channels):
            raise InvalidValueError(
                f"frames must have shape (T, {len(self.channels)}), T >= 1, not {frames.shape}"
            )
        if not np.isfinite(frames).all():
            raise InvalidValueError("a trajectory's frames must be finite")
        if ids.shape != (len(frames),):
            raise InvalidValueError(f"primitive_ids must be ({len(frames)},), not {ids.shape}")
        if not (np.isfinite(self.rate_hz) and self.rate_hz > 0):
            raise InvalidValueError(f"rate_hz must be positive and finite, not {self.rate_hz}")
        changes = np.flatnonzero(np.diff(ids, prepend=ids[0] - 1))
        if not len(starts):
            starts = changes
        inside = starts[0] == 0 and (np.diff(starts) > 0).all() and starts[-1] < len(frames)
        if not (inside and np.isin(changes, starts).all()):
            raise InvalidValueError(
                f"starts must rise from 0 and name each change of primitive, not {starts}"
            )
        for array in (frames, ids, starts):
            array.flags.writeable = False
        object.__setattr__(self, "frames", frames)
        object.__setattr__(self, "primitive_ids", ids)
        object.__setattr__(self, "starts", starts)
        object.__setattr__(self, "channels", tuple(self.channels))

    def __repr__(self) -> str:
        """Return its path and how many frames of how many channels there are."""
        what = f"{len(self)} frames of {len(self.channels)} channels at {self.rate_hz:g} Hz"
        return f"Trajectory(path={self.path}, {what})"

    def __len__(self) -> int:
        """Number of frames T."""
        return len(self.frames)

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return len(self) / self.rate_hz

    @property
    def path(self) -> tuple[int, ...]:
        """The primitives, in the order of their performance, length P."""
        return tuple(self.primitive_ids[self.starts].tolist())

    @property
    def velocities(self) -> FloatArray:
        """Change per second from each frame to the next, shape (T - 1, D) [1/s]."""
        return np.diff(self.frames, axis=0) * self.rate_hz

    @property
    def accelerations(self) -> FloatArray:
        """Second differences, shape (T - 2, D) [1/s^2]."""
        return np.diff(self.frames, n=2, axis=0) * self.rate_hz**2

    def piece(self, position: int) -> Trajectory:
        """Return the part of the trajectory that performs ``path[position]``."""
        bounds = np.append(self.starts, len(self))
        if not 0 <= position < len(self.starts):
            raise InvalidValueError(
                f"the path has positions 0 to {len(self.starts) - 1}, not {position}"
            )
        part = slice(bounds[position], bounds[position + 1])
        return Trajectory(self.frames[part], self.rate_hz, self.channels, self.primitive_ids[part])

"""A performance as it runs: movements in, blocks of frames out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mplearn.recording import FloatArray, LabelledSegment

from .cameras import Cameras
from .idling import Idling
from .movement import Movement
from .stance import Stance


@dataclass(frozen=True, eq=False)
class Block:
    """A piece of a performance, from the start of one motion to the start of the next.

    Attributes:
        markers: Markers, shape (T, M, 3) [m]; NaN where hidden.
        postures: Postures, shape (T, 47): base position [m] and quaternion, joint angles [rad].
        truth: The segments that are known to have ended by now, in frames of the whole performance.

    Example:
        >>> from mplearn.demonstrator import Demonstrator
        >>> block = next(Demonstrator(seed=1).blocks(["BAR", "BAL"]))
        >>> len(block.markers) == len(block.postures), block.markers.shape[1:]
        (True, (34, 3))
    """

    markers: FloatArray
    postures: FloatArray
    truth: tuple[LabelledSegment, ...]


class Performance:
    """Turns movements into frames; it keeps only the movements that have not ended yet.

    Args:
        start: Where the channels are at first, shape (C,).
        idling: What the body does besides.
        stance: Solves postures.
        cameras: Measure them.
        rate_hz: Frames per second.
    """

    def __init__(
        self, start: FloatArray, idling: Idling, stance: Stance, cameras: Cameras, rate_hz: float
    ) -> None:
        self._settled = start.copy()
        self._idling, self._stance, self._cameras = idling, stance, cameras
        self._rate_hz = rate_hz
        self._active: list[Movement] = []
        self._n_frames = 0

    def add(self, movement: Movement) -> None:
        """Take a movement that starts at or after the last frame."""
        self._active.append(movement)

    def until(self, time_s: float, truth: tuple[LabelledSegment, ...]) -> Block:
        """Return the frames before that time [s] that were not returned yet."""
        end = max(int(np.ceil(time_s * self._rate_hz)), self._n_frames)
        times_s = np.arange(self._n_frames, end) / self._rate_hz
        plan = self._settled + self._idling(times_s)
        for movement in self._active:
            plan[:, movement.channels] += movement.displacement(times_s)
        for movement in [m for m in self._active if m.end_s * self._rate_hz <= end]:
            self._settled[movement.channels] += movement.step
            self._active.remove(movement)
        self._n_frames = end
        postures = self._stance.solve(plan)
        return Block(self._cameras.measure(postures), postures, truth)

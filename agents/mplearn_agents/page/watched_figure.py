"""The person who moves, as the page shows her: a figure of 40 degrees of freedom.

As in the paper's experiment, an animation character performs the demonstrator's motions beside
what is learned [Kulic2012, 4.1]. Learning sees the robot's joints; the figure has a human's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mplearn.body import MotionObserver, human_body
from mplearn.errors import MPLearnError
from mplearn.recording import FloatArray, are_markers

from .figures import has_figure, human_poses, poses_of
from .messages import Poses

SHOWN_HZ = 50.0


class WatchedFigure:
    """Follows a stream, and says how the person stands.

    Args:
        channels: Names of the stream's columns.
        rate_hz: Frames per second [1/s].

    Attributes:
        stride: Every so manieth frame is shown.
        channels: Names of the channels of `rows`.
        pose: The latest pose of the figure, shape (B, 7); B = 0 where there is none.
    """

    def __init__(self, channels: Sequence[str], rate_hz: float) -> None:
        self.stride = max(1, round(rate_hz / SHOWN_HZ))
        self._phase = 0
        self._given = tuple(channels)
        self._observer: MotionObserver | None = None
        self.channels = self._given
        self.pose: Poses = np.empty((0, 7), np.float32)
        if are_markers(self._given):
            names = [name[:-2] for name in self._given[::3]]
            try:
                self._observer = MotionObserver(names, rate_hz / self.stride, body=human_body())
                self.channels = self._observer.channels
            except MPLearnError:  # markers of nobody: the channels alone are shown
                self._observer = None
        self._is_robot = has_figure(self._given)

    def take(self, frames: FloatArray) -> FloatArray:
        """Take the next frames of the stream, shape (T, D), and return the rows to be shown."""
        shown = frames[self._phase :: self.stride]
        self._phase = (self._phase - len(frames)) % self.stride
        if self._observer is None:
            if self._is_robot and len(shown) and np.isfinite(shown[-1]).all():
                self.pose = human_poses(shown[-1:], self._given)[0]
            return shown
        rows = [np.empty((0, len(self.channels)))]
        while len(shown):
            watched = self._observer.watch(shown)
            shown = shown[watched.taken :]
            rows += [np.full((watched.dropped, len(self.channels)), np.nan), watched.features]
            if len(watched.features):
                posture = self._observer.ik.q[None]
                self.pose = poses_of(self._observer.body.tree, posture)[0]
        return np.concatenate(rows)

    def end_stream(self) -> None:
        """Begin another stream: whoever comes is measured again."""
        if self._observer is not None:
            self._observer.restart()

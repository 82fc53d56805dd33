"""Demonstrators who move on while the robot acts: a synthetic person, or a recording."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Literal, TypeAlias

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray, Recording


class LiveDemonstrator(ABC):
    """A demonstrator; derive your own, and give an object of it to the environment.

    It must survive copying and pickling in the middle of a performance.

    Attributes:
        channels: Names of a frame's columns, as `LearnerConfig` takes them.
        rate_hz: Frames per second [1/s].
    """

    channels: tuple[str, ...]
    rate_hz: float

    @abstractmethod
    def restart(self, rng: np.random.Generator) -> None:
        """Begin a performance; all that is random comes from ``rng``."""

    @abstractmethod
    def take(self, n_frames: int) -> tuple[FloatArray, bool]:
        """Return at most ``n_frames`` frames, (n, D), and whether the performance ends there.

        After its end it begins anew: fewer frames may be returned at an end only.
        """


class SyntheticDemonstrator(LiveDemonstrator):
    """A synthetic person before the cameras, who goes on for ever.

    Args:
        rate_hz: Frames per second [1/s].
    """

    _ahead: FloatArray  # frames that are performed and not taken yet

    def __init__(self, rate_hz: float = 100.0) -> None:
        from mplearn.demonstrator import Demonstrator

        self.rate_hz = float(rate_hz)
        self.channels = Demonstrator(rate_hz=rate_hz).channels
        self._begin(0, 0)

    def restart(self, rng: np.random.Generator) -> None:
        """Begin a performance of another seed."""
        self._begin(int(rng.integers(2**31)), 0)

    def take(self, n_frames: int) -> tuple[FloatArray, bool]:
        """Return the next frames of markers, shape (n_frames, 3 M) [m]; it never ends."""
        while len(self._ahead) < n_frames:
            block = next(self._blocks).markers
            self._ahead = np.concatenate((self._ahead, block.reshape(len(block), -1)))
        taken, self._ahead = self._ahead[:n_frames], self._ahead[n_frames:]
        self._n_taken += n_frames
        return taken, False

    def _begin(self, seed: int, n_frames: int) -> None:
        """Perform a seed, from some frame on."""
        from mplearn.demonstrator import Demonstrator

        self._seed, self._n_taken = seed, 0
        self._blocks = Demonstrator(seed=seed, rate_hz=self.rate_hz).blocks()
        self._ahead = np.zeros((0, len(self.channels)))
        self.take(n_frames)

    def __getstate__(self) -> dict[str, Any]:
        """A performance that runs cannot be copied; it can be repeated."""
        return {"rate_hz": self.rate_hz, "at": (self._seed, self._n_taken)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        SyntheticDemonstrator.__init__(self, state["rate_hz"])
        self._begin(*state["at"])


class RecordingDemonstrator(LiveDemonstrator):
    """A recording that is shown again and again.

    Args:
        recording: Markers, or the robot's channels.
    """

    def __init__(self, recording: Recording) -> None:
        if not len(recording):
            raise InvalidValueError("the demonstrator's recording is empty")
        self.recording = recording
        self.channels = recording.channels
        self.rate_hz = recording.rate_hz
        self._next = 0

    def restart(self, rng: np.random.Generator) -> None:
        """Begin at the first frame."""
        self._next = 0

    def take(self, n_frames: int) -> tuple[FloatArray, bool]:
        """Return the next frames, and whether the last of them is among these."""
        taken = self.recording.frames[self._next : self._next + n_frames]
        self._next += len(taken)
        ended = self._next == len(self.recording)
        if ended:
            self._next = 0
        return taken, ended


DemonstratorLike: TypeAlias = Literal["synthetic"] | Recording | LiveDemonstrator


def open_demonstrator(demonstrator: DemonstratorLike) -> LiveDemonstrator:
    """Return a demonstrator as an object.

    Raises:
        InvalidValueError: This is none.
    """
    if isinstance(demonstrator, LiveDemonstrator):
        return demonstrator
    if isinstance(demonstrator, Recording):
        return RecordingDemonstrator(demonstrator)
    if demonstrator == "synthetic":
        return SyntheticDemonstrator()
    raise InvalidValueError(
        "demonstrator must be 'synthetic', a Recording or a LiveDemonstrator, "
        f"not {demonstrator!r:.80}"
    )

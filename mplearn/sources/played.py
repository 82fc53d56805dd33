"""Sources that are played here: a recording, or the demonstrator, at their own pace."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..arguments import require_number
from ..demonstrator import Demonstrator
from ..errors import InvalidValueError
from ..mocap import open_recording
from ..recording import FloatArray
from .registry import Wanted
from .source import Block, Change, Source, Stream, Tally

AT_ONCE = 50  # frames in a block, at most
BEHIND_S, CAUGHT_UP_S = 1.0, 0.2  # when it is said that frames wait, and that they no longer do


def play_recording(
    address: str, wanted: Wanted, *, speed: float = 1.0, take: str | None = None
) -> Source:
    """A recording at its own pace: ``recording:FILE``.

    Args:
        address: The file, or a folder with a take.
        wanted: What is to be seen in it.
        speed: Times as fast as it was recorded; ``inf`` for as fast as it is read.
        take: Which take of a folder.

    Raises:
        RecordingError: The file cannot be read.
        InvalidValueError: The speed is not positive.
    """
    if not address:
        raise InvalidValueError("recording: needs a file, as in recording:walk.bvh")
    recording = open_recording(
        address,
        take=take,
        positions=wanted.observe != "channels",
        hints=replace(wanted.hints, joint_axes=wanted.observe == "robot"),
    )
    stream = Stream(
        recording.channels,
        recording.rate_hz,
        recording.skeleton,
        unit_m=1.0,
        up="z",
        subject=recording.person,
        recording=recording,
    )
    return PlayedSource(stream, [recording.frames], speed, f"recording:{address}")


def play_demonstrator(
    address: str, wanted: Wanted, *, speed: float = 1.0, rate_hz: float = 100.0
) -> Source:
    """The synthetic teacher, who goes on for ever: ``demonstrator`` or ``demonstrator:SEED``.

    Args:
        address: Seed of everything random, 0 where empty.
        wanted: What is to be seen.
        speed: Times as fast as a person moves.
        rate_hz: Frames per second of the person's time [1/s].

    Raises:
        InvalidValueError: Seed, speed or rate are not allowed.
    """
    if address and not address.isdecimal():
        raise InvalidValueError(f"demonstrator: takes a seed, an integer >= 0, not {address!r}")
    demonstrator = Demonstrator(seed=int(address or 0), rate_hz=rate_hz)
    stream = Stream(demonstrator.channels, rate_hz, unit_m=1.0, up="z")
    blocks = (b.markers.reshape(len(b.markers), -1) for b in demonstrator.blocks())
    return PlayedSource(stream, blocks, speed, f"demonstrator:{demonstrator.seed}")


class PlayedSource(Source):
    """Frames handed out when they are due; none is ever dropped.

    Args:
        stream: What they are.
        pieces: The frames, in pieces of shape (T, D); taken when they are needed.
        speed: Times as fast as the stream's rate; ``inf`` for as fast as they are read.
        name: What it was opened by.

    Raises:
        InvalidValueError: The speed is not positive.
    """

    def __init__(
        self,
        stream: Stream,
        pieces: Iterable[FloatArray],
        speed: float = 1.0,
        name: str = "played:",
    ) -> None:
        require_number("speed", speed)
        if not speed > 0:
            raise InvalidValueError(f"speed must be positive, not {speed}")
        self.name, self.tally = name, Tally()
        self._stream = stream
        self._pieces = iter(pieces)
        self._left = np.empty((0, len(stream.channels)))
        self._step_s = 1.0 / (stream.rate_hz * speed)  # between frames, as they are played
        self._began_s: float | None = None
        self._late = self._over = False
        self._closed = threading.Event()

    @property
    def ended(self) -> bool:
        """Whether all was handed out, or it was closed."""
        return self._over or self._closed.is_set()

    def close(self) -> None:
        """End it."""
        self._closed.set()

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        """Return the frames that are due; see `Source.read`."""
        if not self._fill():
            return []
        if self._began_s is None:
            self._began_s = time.monotonic()
        due_s = self._began_s + self.tally.frames * self._step_s
        wait_s = due_s - time.monotonic()
        if wait_s > 0:
            limit_s = wait_s if timeout_s is None else min(wait_s, timeout_s)
            if self._closed.wait(limit_s) or limit_s < wait_s:
                return []
        now_s = time.monotonic()
        n = AT_ONCE
        if self._step_s > 0:
            n = min(n, 1 + int((now_s - due_s) / self._step_s))
        n = min(n, len(self._left))
        number = self.tally.frames + np.arange(n, dtype=np.float64)
        block = Block(
            self._stream,
            self._left[:n],
            number / self._stream.rate_hz,
            self._began_s + number * self._step_s if self._step_s > 0 else np.full(n, now_s),
            joins=self.tally.frames > 0,
        )
        self._left = self._left[n:]
        self.tally.frames += n
        self._over = not self._fill()
        return [*self._behind(now_s - due_s, float(block.times_s[0])), block]

    def _fill(self) -> bool:
        """Take the next piece if the last one is used up; say whether there are frames."""
        while not len(self._left) and not self.ended:
            piece = next(self._pieces, None)
            if piece is None:
                self._over = True
                break
            self._left = piece
        return len(self._left) > 0 and not self._closed.is_set()

    def _behind(self, lag_s: float, time_s: float) -> list[Change]:
        """Say that whoever reads is slower than the frames come, or no longer."""
        if self._step_s > 0 and not self._late and lag_s > BEHIND_S:
            self._late = True
            return [Change("behind", f"frames are read {lag_s:.1f} s after they came", time_s)]
        if self._late and lag_s < CAUGHT_UP_S:
            self._late = False
            return [Change("behind", "frames are read as they come again", time_s)]
        return []

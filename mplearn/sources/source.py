"""What every live source is: frames of motion as they come, and what happened to the stream."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from ..arguments import names_of, require_number
from ..closing import Closing
from ..errors import InvalidValueError
from ..recording import BoolArray, FloatArray, Recording, Skeleton, are_markers

ChangeKind: TypeAlias = Literal[
    "connected",
    "disconnected",
    "names",
    "subject",
    "clock",
    "gap",
    "damaged",
    "behind",
    "overrun",
    "body",
]
RATES_HZ = 1.0, 100_000.0  # of a stream of motion, at least and at most
WAIT_S = 0.2  # a read without a limit wakes up so often, so that it can be interrupted


def known_rate(said_hz: float) -> float:
    """Return the rate that a sender says, if it is one of motion; 0 otherwise [1/s].

    >>> known_rate(120.0), known_rate(1e-300), known_rate(float("nan"))
    (120.0, 0.0, 0.0)
    """
    return said_hz if RATES_HZ[0] <= said_hz <= RATES_HZ[1] else 0.0


@dataclass(frozen=True, eq=False)
class Stream:
    """What a stream says of itself; another object where that changes.

    Attributes:
        channels: Name of each column, length D; markers and joints as ``"LSHO.x", "LSHO.y",
            "LSHO.z", ...``.
        rate_hz: Frames per second, 1 to 100,000; 0 where it does not say [1/s].
        skeleton: The joints whose positions it holds; None for markers and plain channels.
        unit_m: Length of the stream's unit [m]; None where it does not say.
        up: The stream's axis that points up, as ``"y"``; empty where it does not say.
        subject: Who moves; empty where it does not say.
        recording: All of it, where that is known before (a file): metres, z up.

    Raises:
        InvalidValueError: Two channels have one name, or the rate is none of motion; or they are
            no names, and no number.

    Example:
        >>> stream = Stream(("LSHO.x", "LSHO.y", "LSHO.z"), rate_hz=100.0)
        >>> len(stream.channels), stream.skeleton is None
        (3, True)
    """

    channels: tuple[str, ...]
    rate_hz: float
    skeleton: Skeleton | None = None
    unit_m: float | None = None
    up: str = ""
    subject: str = ""
    recording: Recording | None = None

    def __post_init__(self) -> None:
        """Check the names and the rate."""
        object.__setattr__(self, "channels", names_of("channels", self.channels))
        require_number("rate_hz", self.rate_hz)
        seen: set[str] = set()
        for name in self.channels:
            if name in seen:
                raise InvalidValueError(f"channels must differ, not two be {name!r:.60}")
            seen.add(name)
        least, most = RATES_HZ
        if self.rate_hz != 0 and not least <= self.rate_hz <= most:
            raise InvalidValueError(
                f"rate_hz must lie in [{least:g}, {most:g}], or be 0 where it is not known, "
                f"not {self.rate_hz:g}"
            )

    @property
    def is_markers(self) -> bool:
        """Whether the columns are markers or joints, three each."""
        return are_markers(self.channels)

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the markers or joints, length M; empty for plain channels."""
        return tuple(name[:-2] for name in self.channels[::3]) if self.is_markers else ()


@dataclass(frozen=True, eq=False)
class Block:
    """Frames that came in, at an even rate: where one was lost stands a row of NaN.

    Attributes:
        stream: What the stream says of itself.
        frames: Shape (n, D), n > 0; NaN where a measurement is missing.
        times_s: Time of each frame since the source's first [s], shape (n,): even, and without
            the jumps of the sender's clock.
        arrived_s: When each frame came in, on the clock of `time.monotonic` [s], shape (n,); NaN
            for a frame that never came.
        joins: Whether the first frame is the next one after those before; otherwise another
            stretch begins, which a learner should not take as going on (`end_stream`).
        lost: Frames that never came, among these.
        doubled: Frames that came twice since the last block; the first one counts.
        late: Frames that came when their place was already given up, since the last block.

    Example:
        >>> import numpy as np
        >>> stream = Stream(("hip", "knee"), rate_hz=100.0)
        >>> frames = np.array([[0.1, 0.2], [np.nan, np.nan], [0.1, 0.3]])  # one never came
        >>> arrived_s = np.array([50.0, np.nan, 50.02])
        >>> block = Block(stream, frames, np.array([0.0, 0.01, 0.02]), arrived_s, lost=1)
        >>> block.gaps.tolist(), block.channels
        ([False, True, False], ('hip', 'knee'))
    """

    stream: Stream
    frames: FloatArray
    times_s: FloatArray
    arrived_s: FloatArray
    joins: bool = True
    lost: int = 0
    doubled: int = 0
    late: int = 0

    @property
    def channels(self) -> tuple[str, ...]:
        """Name of each column, length D."""
        return self.stream.channels

    @property
    def rate_hz(self) -> float:
        """Frames per second [1/s]."""
        return self.stream.rate_hz

    @property
    def gaps(self) -> BoolArray:
        """Which frames never came, shape (n,)."""
        return np.isnan(self.arrived_s)

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.frames)


@dataclass(frozen=True)
class Change:
    """Something happened to the stream.

    Attributes:
        kind: ``"connected"`` and ``"disconnected"``; ``"names"``: of markers or channels changed;
            ``"subject"``: somebody else appeared, or is followed now; ``"clock"``: the sender's
            clock jumped, or started again; ``"gap"``: more was lost than is filled with NaN;
            ``"damaged"``: packets could not be read; ``"behind"``: frames wait for whoever reads
            them, or no longer; ``"overrun"``: they waited for too long, and some were dropped;
            ``"body"``: what was recognised in the stream, or why nothing.
        text: What exactly, a sentence.
        time_s: When, as `Block.times_s` [s].
        count: Of what is counted: frames lost, packets damaged; 0 where nothing is.

    Example:
        >>> change = Change("gap", "120 frames were lost", time_s=61.2, count=120)
        >>> f"{change.time_s:.0f} s: {change.text}"
        '61 s: 120 frames were lost'
    """

    kind: ChangeKind
    text: str
    time_s: float = 0.0
    count: int = 0


@dataclass
class Tally:
    """What became of all that came: every packet and every frame is counted in one place.

    Attributes:
        frames: Frames handed out that had come.
        lost: Frames handed out as NaN, or left out of a gap, because they never came.
        doubled: Frames that came more than once: each time after the first.
        late: Frames that came when their place was already given up.
        damaged: Packets that could not be read.
        overrun: Frames dropped because nobody took them in time.
        foreign: Frames of somebody else than who is followed.
        unnamed: Frames that came before it was said what they hold.
        unrecognised: Frames in which nobody was recognised, before anybody was.
        unread: Frames that had come and were not read yet when the source was closed.
        reconnected: How often a connection was made again.

    Example:
        >>> tally = Tally(frames=100, lost=2)
        >>> f"{tally.lost / tally.frames:.0%} lost"
        '2% lost'
    """

    frames: int = 0
    lost: int = 0
    doubled: int = 0
    late: int = 0
    damaged: int = 0
    overrun: int = 0
    foreign: int = 0
    unnamed: int = 0
    unrecognised: int = 0
    unread: int = 0
    reconnected: int = 0

    def faults(self) -> dict[str, int]:
        """Return all counts that are not zero, but for that of frames."""
        return {k: n for k, n in vars(self).items() if n and k != "frames"}


class Source(Closing):
    """A stream of motion, live.

    Iterating yields `Block` and `Change` as they come, and waits in between; it ends with the
    stream. A packet that cannot be read is counted, and a lost connection made again: neither
    raises. A context manager, which closes it.

    Attributes:
        name: What it was opened by, as ``"recording:walk.bvh"``.
        tally: What became of all that came.

    Example:
        >>> from mplearn.sources import open_source
        >>> with open_source("demonstrator:7", speed=float("inf"), observe="positions") as source:
        ...     for item in source:
        ...         if isinstance(item, Block):
        ...             break
        >>> source.name, item.rate_hz, source.tally.lost
        ('demonstrator:7', 100.0, 0)
    """

    name: str
    tally: Tally

    @property
    @abstractmethod
    def ended(self) -> bool:
        """Whether nothing more will come."""

    @abstractmethod
    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        """Return what came since the last call, in order; wait for it where nothing did.

        Args:
            timeout_s: How long to wait at most [s]; None for ever.

        Returns:
            Empty after the time has passed, when the stream has ended (`ended` says so), or while
            what came is kept back: until a body is found in it, or for another rate.
        """

    @abstractmethod
    def close(self) -> None:
        """End the stream, also while another thread reads it; a second call does nothing."""

    def __iter__(self) -> Iterator[Block | Change]:
        """Yield what comes until the stream ends."""
        while not self.ended:
            yield from self.read(WAIT_S)

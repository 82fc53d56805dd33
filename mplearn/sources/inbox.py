"""What a receiving thread hands to whoever reads: a queue with an end, that says what it drops."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import TypeAlias

from ..recording import FloatArray
from .source import ChangeKind, Stream

CAPACITY = 2048  # samples that wait at most: about 20 s of a stream
_LARGEST = 2**63  # number of a frame, or time [s]


@dataclass(frozen=True, eq=False, slots=True)
class Sample:
    """A frame as it came in.

    Attributes:
        stream: What it holds; the same object while that stays. Its rate is 0 where unknown.
        values: Shape (D,); NaN where missing.
        arrived_s: When it came, on the clock of `time.monotonic` [s].
        number: The sender's number of the frame, or None.
        time_s: When it was taken, on the sender's clock [s], or None.
        dropped: Samples right before it that found the queue full.
    """

    stream: Stream
    values: FloatArray
    arrived_s: float
    number: int | None = None
    time_s: float | None = None
    dropped: int = 0


@dataclass(frozen=True, slots=True)
class News:
    """Something else than a frame.

    Attributes:
        kind: As `Change.kind`.
        text: What exactly.
        count: Packets that were damaged.
    """

    kind: ChangeKind
    text: str
    count: int = 0


Item: TypeAlias = Sample | News


class Inbox:
    """A queue between the thread that receives and whoever reads.

    Args:
        capacity: Samples that wait at most; what comes beyond is dropped and counted.
    """

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._items: deque[Item] = deque()
        self._capacity = capacity
        self._dropped = 0
        self._closed = self._finished = False
        lock = threading.Lock()
        self._arrived, self._room = threading.Condition(lock), threading.Condition(lock)

    @property
    def closed(self) -> bool:
        """Whether nobody reads any more: the receiver should return."""
        return self._closed

    @property
    def finished(self) -> bool:
        """Whether nothing more will come, and all was taken."""
        return self._closed or (self._finished and not self._items)

    @property
    def ending(self) -> bool:
        """Whether the receiver is done: nothing more will come, or nobody reads."""
        return self._closed or self._finished

    def put(self, sample: Sample, *, wait: bool = False) -> None:
        """Add a frame that came in.

        Args:
            sample: The frame.
            wait: Whether to wait for room where there is none; otherwise it is dropped, and counted
                on the next one that is not. One whose number or time no sender means is damaged.
        """
        for what, value in (("number", sample.number), ("time", sample.time_s)):
            if value is not None and not abs(value) < _LARGEST:  # NaN is not either
                self.damaged(f"a frame with {what} {value!r:.40}")
                return
        with self._arrived:
            while wait and len(self._items) >= self._capacity and not self._closed:
                self._room.wait(0.1)
            if len(self._items) >= self._capacity:
                self._dropped += 1
                return
            if self._dropped:
                sample = Sample(
                    sample.stream,
                    sample.values,
                    sample.arrived_s,
                    sample.number,
                    sample.time_s,
                    self._dropped,
                )
                self._dropped = 0
            self._items.append(sample)
            self._arrived.notify()

    def say(self, kind: ChangeKind, text: str, count: int = 0) -> None:
        """Add something else; news of one kind that follow each other are counted as one."""
        with self._arrived:
            last = self._items[-1] if self._items else None
            if isinstance(last, News) and last.kind == kind:
                self._items[-1] = News(kind, text, last.count + count)
            else:
                self._items.append(News(kind, text, count))
            self._arrived.notify()

    def damaged(self, text: str) -> None:
        """Say that a packet could not be read."""
        self.say("damaged", text, 1)

    def finish(self) -> None:
        """Say that nothing more will come."""
        with self._arrived:
            self._finished = True
            self._arrived.notify_all()

    def close(self) -> int:
        """Let the receiver know that nobody reads any more; return how many frames still wait."""
        with self._arrived:
            self._closed = True
            unread = sum(isinstance(item, Sample) for item in self._items) + self._dropped
            self._dropped = 0
            self._items.clear()
            self._arrived.notify_all()
            self._room.notify_all()
            return unread

    def pause(self, seconds: float) -> bool:
        """Wait, in the receiver; return whether to stop."""
        until = time.monotonic() + seconds
        with self._arrived:
            while not self._closed:
                left = until - time.monotonic()
                if left <= 0:
                    break
                self._arrived.wait(left)
        return self._closed

    def take(self, timeout_s: float) -> list[Item]:
        """Return what waits, or what comes within a time."""
        with self._arrived:
            if not self._items and not self._closed and not self._finished:
                self._arrived.wait(timeout_s)
            items = list(self._items)
            self._items.clear()
            self._room.notify_all()
            return items

    def __len__(self) -> int:
        """Number of items that wait."""
        return len(self._items)

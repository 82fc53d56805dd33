"""A stream that waits for whoever reads it: in memory, beyond that in files without a name."""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from io import FileIO
from pathlib import Path

import numpy as np

from ..arguments import path_of, require_kind, require_number
from ..errors import InvalidValueError
from .source import WAIT_S, Block, Change, Source

AT_ONCE = 50  # frames of blocks that are handed out as one, at most
BEHIND_S, CAUGHT_UP_S = 1.0, 0.2  # when it is said that frames wait, and that they no longer do
MOST_BYTES = 2**30  # that wait at most
_IN_MEMORY_BYTES = 2**23  # of them in memory
_FILE_BYTES = 2**25  # in a file, which is given up once it is read


class BufferedSource(Source):
    """A source that is read at once, in a thread of its own, whoever is slow to take what comes.

    What waits costs 8 bytes a value and 16 a frame: the first 8 MB of it are in memory, the rest in
    files without a name, which are gone with the process. Once ``most_bytes`` wait, or where those
    files cannot be written, nothing more is read until there is room: then it is up to the source
    what waits there, and what it says that it drops.

    Args:
        source: The stream.
        folder: Where those files are; the system's place for such, where None.
        most_bytes: That wait at most.
        arrived: Called, in that thread, when something comes while nothing waits, and at the end.

    Raises:
        InvalidValueError: ``most_bytes`` is not positive.

    Example:
        >>> from mplearn.sources import BufferedSource, open_source
        >>> source = open_source("demonstrator:7", speed=5.0, observe="positions")
        >>> with BufferedSource(source) as buffered:
        ...     items = buffered.read()
        >>> type(items[0]).__name__, items[0].channels[0], buffered.ended
        ('Block', 'LFHD.x', True)
    """

    def __init__(
        self,
        source: Source,
        *,
        folder: str | os.PathLike[str] | None = None,
        most_bytes: int = MOST_BYTES,
        arrived: Callable[[], object] = lambda: None,
    ) -> None:
        require_kind("source", source, Source, "open_source(name) opens one")
        require_number("most_bytes", most_bytes)
        if not most_bytes >= 1:
            raise InvalidValueError(f"most_bytes must be positive, not {most_bytes}")
        self.name, self.tally = source.name, source.tally
        self._source, self._arrived = source, arrived
        self._most_bytes = most_bytes
        self._spill = _Spill(None if folder is None else path_of("folder", folder))
        self._waiting: deque[tuple[float, Block | Change | _Spilled]] = deque()  # since when
        self._newest: list[Block] = []  # will be one block
        self._newest_s = 0.0  # since when the first of them waits
        self._n_waiting, self._rate_hz = 0, 0.0
        self._in_memory, self._n_bytes = 0, 0
        self._held = False  # nothing is read, for it could not be written to a file
        self._finished = self._closed = False
        self._error: BaseException | None = None
        self._late_s = 0.0  # how late frames were taken, at most, since that was said
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name=f"read {source.name}", daemon=True)
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether nothing more will come, and all was taken."""
        return self._closed or (self._finished and self._error is None and self.n_waiting == 0)

    @property
    def n_waiting(self) -> int:
        """Number of blocks and changes that wait to be read."""
        with self._changed:
            return len(self._waiting) + bool(self._newest)

    @property
    def waiting_s(self) -> float:
        """Length of the stream that waits to be read [s]."""
        with self._changed:
            return self._n_waiting / self._rate_hz if self._rate_hz else 0.0

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        """Return what came first of what waits: a block or a change; see `Source.read`.

        Raises:
            BaseException: What the source raised when it was read; all before was returned.
        """
        with self._changed:
            self._changed.wait_for(self._is_ready, timeout_s)
            if self._closed or not (self._waiting or self._newest):
                error, self._error = self._error, None
                if error is not None:
                    raise error
                return []
            if not self._waiting:
                self._seal()
            since_s, item = self._waiting.popleft()
            size = item.n_bytes if isinstance(item, _Spilled) else _size(item)
            self._n_bytes -= size
            self._in_memory -= 0 if isinstance(item, _Spilled) else size
            self._held &= self._in_memory > _IN_MEMORY_BYTES // 2
            self._changed.notify_all()
            if isinstance(item, Change):
                return [item]
            self._n_waiting -= len(item)
            block = self._spill.read(item) if isinstance(item, _Spilled) else item
        return [*self._behind(since_s, float(block.times_s[0])), block]

    def close(self) -> None:
        """End the stream; what still waits is counted as not read."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread is not threading.current_thread():
            self._thread.join(10.0)
        self._source.close()
        with self._changed:
            self._seal()
            unread = sum(_n_came(each) for _, each in self._waiting)
            self.tally.unread += unread
            self.tally.frames -= unread
            self._n_waiting = self._n_bytes = self._in_memory = 0
            self._waiting.clear()
            self._spill.close()

    # ---- in the thread that reads

    def _run(self) -> None:
        try:
            while not (self._closed or self._source.ended):
                for item in self._source.read(WAIT_S):
                    self._put(item)
        except BaseException as error:  # of a source of somebody else, whatever it raises
            self._error = error
        with self._changed:
            self._finished = True
            self._changed.notify_all()
        self._arrived()

    def _put(self, item: Block | Change) -> None:
        now_s = time.monotonic()
        with self._changed:
            self._changed.wait_for(
                lambda: self._closed or not (self._held or self._n_bytes >= self._most_bytes)
            )
            is_first = not (self._waiting or self._newest)
            if isinstance(item, Change):
                self._seal()
                self._waiting.append((now_s, item))
            else:
                if not self._continues(item):
                    self._seal()
                self._newest_s = self._newest_s if self._newest else now_s
                self._newest.append(item)
                self._n_waiting += len(item)
                self._rate_hz = item.rate_hz
                size = _size(item)
                self._n_bytes += size
                self._in_memory += size
            self._changed.notify_all()
        if is_first:
            self._arrived()

    def _continues(self, block: Block) -> bool:
        """Whether a block can be handed out as one with those before it."""
        newest = self._newest
        if not newest:
            return True
        fits = sum(map(len, newest)) + len(block) <= AT_ONCE
        return fits and block.joins and block.stream is newest[0].stream

    def _seal(self) -> None:
        """Make one of the newest blocks, and put it where there is room."""
        if not self._newest:
            return
        block, since_s, self._newest = _joined(self._newest), self._newest_s, []
        if self._in_memory <= _IN_MEMORY_BYTES:
            self._waiting.append((since_s, block))
            return
        try:
            self._waiting.append((since_s, self._spill.write(block)))
            self._in_memory -= _size(block)
        except OSError as error:
            self._waiting.append((since_s, block))
            if not self._held:
                text = f"what waits cannot be written to a file ({error.strerror}): not all is read"
                told = Change("behind", text, float(block.times_s[-1]))
                self._waiting.append((time.monotonic(), told))
            self._held = True

    # ---- for who reads

    def _is_ready(self) -> bool:
        return bool(self._waiting or self._newest) or self._finished or self._closed

    def _behind(self, since_s: float, time_s: float) -> list[Change]:
        """Say that whoever reads is slower than the frames come, or no longer.

        What the source itself held back, until it knew the body, is nobody's fault.
        """
        late_s = time.monotonic() - since_s
        was, self._late_s = self._late_s, max(self._late_s, late_s)
        if was < BEHIND_S <= late_s:
            text = f"frames are read {late_s:.1f} s after they came; what comes meanwhile waits"
            return [Change("behind", text, time_s)]
        if late_s < CAUGHT_UP_S:
            self._late_s = 0.0
            if was >= BEHIND_S:
                text = f"frames are read as they come again, after up to {was:.1f} s"
                return [Change("behind", text, time_s)]
        return []


@dataclass(frozen=True, eq=False, slots=True)
class _Spilled:
    """A block in a file.

    Attributes:
        block: The same without frames.
        file: That.
        at: Where its frames begin [byte].
        shape: Of its frames.
        n_came: Of them those that came.
        n_bytes: What all of it takes.
    """

    block: Block
    file: FileIO
    at: int
    shape: tuple[int, int]
    n_came: int
    n_bytes: int

    def __len__(self) -> int:
        return self.shape[0]


class _Spill:
    """Files that hold blocks until they are read, in the same order.

    Args:
        folder: Where they are.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._files: deque[FileIO] = deque()
        self._end = 0  # of the newest one

    def write(self, block: Block) -> _Spilled:
        """Keep a block.

        Raises:
            OSError: It cannot be written.
        """
        if not self._files or self._end >= _FILE_BYTES:
            file = tempfile.TemporaryFile(dir=self._folder, buffering=0)  # noqa: SIM115
            self._files.append(file)
            self._end = 0
        file, at = self._files[-1], self._end
        parts = block.times_s, block.arrived_s, block.frames
        data = b"".join(np.asarray(each, np.float64).tobytes() for each in parts)
        file.seek(at)
        if file.write(data) != len(data):
            raise OSError(0, "no room is left")
        self._end = at + len(data)
        nothing = np.empty(0)
        rest = replace(block, frames=np.empty((0, 0)), times_s=nothing, arrived_s=nothing)
        n, width = block.frames.shape
        return _Spilled(rest, file, at, (n, width), _n_came(block), len(data))

    def read(self, spilled: _Spilled) -> Block:
        """Return a block; files before its own are given up."""
        while self._files and self._files[0] is not spilled.file:
            self._files.popleft().close()
        n, width = spilled.shape
        values = np.empty(n * (width + 2))
        spilled.file.seek(spilled.at)
        if spilled.file.readinto(values.data) != values.nbytes:
            raise OSError(0, "what was written is no longer there")
        return replace(
            spilled.block,
            times_s=values[:n],
            arrived_s=values[n : 2 * n],
            frames=values[2 * n :].reshape(n, width),
        )

    def close(self) -> None:
        """Give up all."""
        while self._files:
            with suppress(OSError):
                self._files.popleft().close()


def _size(item: Block | Change) -> int:
    """Return how much memory an item takes, but for what all have [byte]."""
    return 8 * len(item) * (len(item.channels) + 2) if isinstance(item, Block) else 0


def _n_came(item: Block | Change | _Spilled) -> int:
    """Return how many frames came, of a block."""
    if isinstance(item, Block):
        return int(np.count_nonzero(~item.gaps))
    return item.n_came if isinstance(item, _Spilled) else 0


def _joined(blocks: list[Block]) -> Block:
    """Return blocks that follow each other as one."""
    if len(blocks) == 1:
        return blocks[0]
    return replace(
        blocks[0],
        frames=np.concatenate([each.frames for each in blocks]),
        times_s=np.concatenate([each.times_s for each in blocks]),
        arrived_s=np.concatenate([each.arrived_s for each in blocks]),
        lost=sum(each.lost for each in blocks),
        doubled=sum(each.doubled for each in blocks),
        late=sum(each.late for each in blocks),
    )

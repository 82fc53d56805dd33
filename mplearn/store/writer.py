"""The thread that writes: what comes in never waits for the disk."""

from __future__ import annotations

import sqlite3
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import StoreError
from ..state import Kept, checkpoint
from .database import named
from .life_state import LifeState
from .records import Record
from .rows import Row, row_of, write_checkpoint, write_rows

_BATCH_BYTES = 512 * 1024  # of parts in one transaction: what comes in is written in between
_DROPPED = 500  # parts that are deleted in one transaction
_FREE_PAGES = 256  # that are given back to the system after a checkpoint
_RETRY_S = 1.0
_KEPT = 2  # checkpoints, and the log from the older one on


@dataclass
class Figures:
    """What writing took, for `Store.info` and benchmarks.

    Attributes:
        commits_s: How long each of the latest commits took [s].
        checkpoints_s: How long each of the latest checkpoints took [s].
        written: Bytes of parts in each of those.
    """

    commits_s: deque[float] = field(default_factory=lambda: deque(maxlen=1000))
    checkpoints_s: deque[float] = field(default_factory=lambda: deque(maxlen=1000))
    written: deque[int] = field(default_factory=lambda: deque(maxlen=1000))


class Writer:
    """Writes records and checkpoints in order, in a thread of its own.

    Where the disk is full, or the file cannot be written for another reason, what came in waits in
    memory and is tried again. What waits is bounded: a checkpoint stands for all before it.

    Args:
        connection: To the store; nobody else uses it from now on.
        path: The store.
        parts: Keys of the parts that are there.
        kept: Numbers of the checkpoints that are there, each with the keys of its parts.

    Attributes:
        problem: Why nothing can be written at the moment; None where all is well.
    """

    def __init__(
        self,
        connection: sqlite3.Connection,
        path: Path,
        parts: set[str],
        kept: dict[int, frozenset[str]],
    ) -> None:
        self.problem: StoreError | None = None
        self.figures = Figures()
        self._connection = connection
        self._path = path
        self._kept, self._loose = Kept(), parts  # what no checkpoint holds, and yet is there
        for seq, keys in kept.items():
            self._kept.add(seq, {f"checkpoint {seq}": tuple(keys)})
            self._loose -= keys
        self._begun: set[str] = set()  # parts of a checkpoint that is not written yet
        self._rows: deque[tuple[int, Record]] = deque()
        self._next: tuple[int, LifeState] | None = None
        self._wake = threading.Condition()
        self._written, self._asked = 0, 0
        self._busy, self._ends = False, False
        self._thread = threading.Thread(target=self._run, name=f"store {path.name}", daemon=True)
        self._thread.start()

    # ---- for the thread of the stream

    def put(self, seq: int, record: Record) -> None:
        """Let a record be written."""
        with self._wake:
            self._rows.append((seq, record))
            self._asked = seq
            self._wake.notify_all()

    def put_checkpoint(self, seq: int, state: LifeState) -> None:
        """Let what is known after a record be written; one that waits is not written any more."""
        with self._wake:
            self._next = seq, state
            self._asked = max(self._asked, seq)
            if self.problem is not None:
                self._forget_before(seq)
            self._wake.notify_all()

    def flush(self, timeout_s: float) -> bool:
        """Wait until all is written; say whether it is. Where it cannot be, nobody waits."""
        with self._wake:
            self._wake.wait_for(lambda: self._is_done() or self.problem is not None, timeout_s)
            return self._is_done()

    def retry(self) -> None:
        """Try now to write what could not be written."""
        with self._wake:
            self.problem = None
            self._wake.notify_all()

    @property
    def n_pending(self) -> int:
        """Records that are not written yet."""
        return len(self._rows)

    def close(self, timeout_s: float) -> None:
        """Write what can be written, and end the thread."""
        with self._wake:
            self._ends = True
            self._wake.notify_all()
        self._thread.join(timeout_s)

    # ---- in the thread

    def _run(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._rows or self._next or self._ends)
                if self._ends and (self._is_done() or self.problem is not None):
                    return
                self._busy = True
            try:
                self._write_rows()
                self._write_checkpoint()
                self._solved(None)
            except sqlite3.Error as error:
                self._solved(error)

    def _solved(self, error: sqlite3.Error | None) -> None:
        with self._wake:
            self._busy = False
            self.problem = None if error is None else named(error, self._path)
            self._wake.notify_all()
            if error is not None:
                if self._next is not None:
                    self._forget_before(self._next[0])
                self._wake.wait_for(lambda: self._ends or self.problem is None, _RETRY_S)

    def _is_done(self) -> bool:
        return not (self._rows or self._next or self._busy)

    def _forget_before(self, seq: int) -> None:
        while self._rows and self._rows[0][0] <= seq:
            self._rows.popleft()

    def _write_rows(self) -> None:
        """Write all records that wait, in one transaction."""
        with self._wake:
            waiting = list(self._rows)
        if not waiting:
            return
        rows: list[Row] = [row_of(seq, record) for seq, record in waiting]
        start = time.perf_counter()
        with _transaction(self._connection):
            write_rows(self._connection, rows)
        self.figures.commits_s.append(time.perf_counter() - start)
        with self._wake:
            self._forget_before(rows[-1].seq)
            self._wake.notify_all()

    def _write_checkpoint(self) -> None:
        """Write a checkpoint: its new parts, some at a time, and then what holds them together."""
        with self._wake:
            if self._next is None:
                return
            seq, state = self._next
        start = time.perf_counter()
        made = checkpoint(state, self._kept)
        for batch in _batches({k: data for k, data in made.new.items() if k not in self._begun}):
            with _transaction(self._connection):
                self._connection.executemany("INSERT OR REPLACE INTO part VALUES (?, ?)", batch)
            self._begun.update(key for key, _ in batch)
            self._write_rows()
        before = list(self._kept)
        kept = sorted({*before, seq})[-_KEPT:]
        with _transaction(self._connection):
            write_checkpoint(self._connection, seq, time.time(), made)
            self._connection.execute("DELETE FROM log WHERE seq <= ?", (kept[0],))
            marks = ", ".join("?" * len(kept))
            self._connection.execute(f"DELETE FROM checkpoint WHERE seq NOT IN ({marks})", kept)
        with self._wake:
            if self._next is not None and self._next[0] == seq:
                self._next = None
        self._loose |= self._begun
        self._begun = set()
        for old in before:
            if old == seq or old not in kept:
                self._loose.update(self._kept.drop(old))
        self._kept.add(seq, made.held)
        self._drop_parts()
        self.figures.checkpoints_s.append(time.perf_counter() - start)
        self.figures.written.append(sum(map(len, made.new.values())) + len(made.document))

    def _drop_parts(self) -> None:
        """Delete the parts that no checkpoint holds any more, and give room back."""
        gone = sorted(key for key in self._loose if key not in self._kept)
        self._loose = set(gone)
        for at in range(0, len(gone), _DROPPED):
            keys = gone[at : at + _DROPPED]
            with _transaction(self._connection):
                self._connection.executemany(
                    "DELETE FROM part WHERE key = ?", [(key,) for key in keys]
                )
            self._loose.difference_update(keys)
            self._write_rows()
        self._connection.execute(f"PRAGMA incremental_vacuum({_FREE_PAGES})").fetchall()


def _batches(parts: Mapping[str, bytes]) -> Iterator[list[tuple[str, bytes]]]:
    """Return parts, some at a time."""
    batch: list[tuple[str, bytes]] = []
    size = 0
    for key, data in parts.items():
        batch.append((key, data))
        size += len(data)
        if size >= _BATCH_BYTES:
            yield batch
            batch, size = [], 0
    if batch:
        yield batch


class _transaction:  # noqa: N801
    """A transaction that is committed, or rolled back where that fails."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def __enter__(self) -> None:
        self._connection.execute("BEGIN IMMEDIATE")

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            try:
                self._connection.execute("COMMIT")
            except sqlite3.Error:
                self._roll_back()
                raise
        else:
            self._roll_back()

    def _roll_back(self) -> None:
        if self._connection.in_transaction:
            self._connection.execute("ROLLBACK")

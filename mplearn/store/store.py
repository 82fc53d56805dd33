"""The file that keeps a life of learning: a log of what came in, and checkpoints of what is known.

The log is written about once a second, a checkpoint less often, both by a thread (`writer.py`).
Opening takes the last checkpoint and learns on from the log, to the same state bit for bit as if
nothing had happened. What no checkpoint needs any more goes.
"""

from __future__ import annotations

import os
import sqlite3
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from ..arguments import path_of, require_number
from ..errors import (
    InvalidValueError,
    NotAStoreError,
    StoreDamagedError,
    StoreError,
    StoreWarning,
    StoreWriteError,
)
from .database import errors_of, integrity, look_at, open_reading, open_writing
from .journal import Entry
from .life_state import LifeState
from .lock import WriterLock
from .records import Frames, Record
from .rows import Row, checkpoints, read_checkpoint, read_rows, record_of
from .schema import version_of
from .writer import Figures, Writer

_COMMAND_S = 5.0  # that a person waits at most for a command to be written
_CLOSE_S = 60.0


class Found(NamedTuple):
    """What a store holds.

    Attributes:
        seq: Number of the last record in the checkpoint.
        state: What was known then.
        rows: The log since then.
        parts: Keys of the parts of each checkpoint that is there.
        damage: What is wrong, where an older checkpoint, or a part of the log, had to do.
    """

    seq: int
    state: LifeState
    rows: list[Row]
    parts: dict[int, frozenset[str]]
    damage: tuple[str, ...] = ()


@dataclass(frozen=True)
class StoreInfo:
    """A store at a glance.

    Attributes:
        path: The file.
        version: Of its tables.
        file_bytes: Size of the file and of what SQLite keeps beside it [byte].
        records: Records in the log.
        checkpoint: Number of the last record in the newest checkpoint; None before the first.
        checkpoint_at: When that was written [s since 1970].
        parts: Number of parts that checkpoints are made of.
        free_bytes: Room in the file that is not used [byte].

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> learner = MotionLearner(LearnerConfig(("x", "y"), 50.0))
        >>> LifelongLearner.open("glance.db", lambda: learner).close()
        >>> glance = info("glance.db")
        >>> glance.path.name, glance.file_bytes > 0, glance.checkpoint is not None
        ('glance.db', True, True)
    """

    path: Path
    version: int
    file_bytes: int
    records: int
    checkpoint: int | None
    checkpoint_at: float | None
    parts: int
    free_bytes: int


class Store:
    """A store, opened to be written to, by this process alone.

    It is used through `LifelongLearner`; others may read it meanwhile (`StoreReader`).

    Args:
        path: The file; made where there is none.
        checkpoint_s: Time of stream between checkpoints [s].

    Attributes:
        path: The file.

    Raises:
        StoreError: It cannot be opened; the class says why.
        InvalidValueError: ``checkpoint_s`` is not positive.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> learner = MotionLearner(LearnerConfig(("x", "y")))
        >>> LifelongLearner.open("kept.db", lambda: learner).close()
        >>> store = Store("kept.db")
        >>> found = store.load()
        >>> store.start(found, lambda: found.life, 100.0)
        >>> store.problem is None
        True
        >>> store.close()
    """

    def __init__(self, path: str | Path, *, checkpoint_s: float = 30.0) -> None:
        require_number("checkpoint_s", checkpoint_s)
        if not checkpoint_s > 0:
            raise InvalidValueError(f"checkpoint_s must be positive, not {checkpoint_s}")
        self.path = Path(os.path.realpath(path_of("path", path)))  # also of links in a circle
        self._checkpoint_s = checkpoint_s
        look_at(self.path)
        self._lock = WriterLock(self.path)
        try:
            self._connection = open_writing(self.path)
        except BaseException:
            self._lock.release()
            raise
        self._writer: Writer | None = None
        self._seq = 0
        self._frames_since, self._rate_hz = 0, 100.0
        self._warned = False

    # ---- opening

    def load(self, *, salvage: bool = False) -> Found | None:
        """Return what the store holds; None where it is new.

        Args:
            salvage: Whether to be content with what comes before damage.

        Raises:
            StoreDamagedError: It is not what was written.
        """
        with errors_of(self.path):
            return read_all(self._connection, self.path, salvage=salvage, older=True)

    def start(self, found: Found | None, state: Callable[[], LifeState], rate_hz: float) -> None:
        """Begin to write, now that what the store holds is known.

        Args:
            found: What `load` returned.
            state: Returns what is known, the log included.
            rate_hz: Frames per second of the stream [1/s].
        """
        with errors_of(self.path):
            keys = {str(key) for (key,) in self._connection.execute("SELECT key FROM part")}
            last = self._connection.execute("SELECT max(seq) FROM log").fetchone()[0]
        kept = {} if found is None else found.parts
        self._rate_hz = rate_hz
        self._writer = Writer(self._connection, self.path, keys, kept)
        self._seq = max(last or 0, 0 if found is None else found.seq)
        if found is None or found.damage:
            self._seq += 1
            self._writer.put_checkpoint(self._seq, state())
            if found is None:
                self.flush()
        else:
            self._frames_since = sum(row.kind == "frames" for row in found.rows) * round(rate_hz)

    # ---- writing

    def append(self, record: Record, state: Callable[[], LifeState]) -> None:
        """Keep a record; see `Log`. Nobody waits for the disk, but for a person's commands."""
        writer = self._running()
        self._seq += 1
        writer.put(self._seq, record)
        if isinstance(record, Frames):
            self._frames_since += len(record.frames)
        if self._frames_since >= self._checkpoint_s * self._rate_hz:
            self._frames_since = 0
            writer.put_checkpoint(self._seq, state())
        if isinstance(record, Entry):
            self.flush(_COMMAND_S)
        self._warn()

    def checkpoint(self, state: LifeState) -> None:
        """Let all that is known be written now, as `close` does."""
        self._frames_since = 0
        self._running().put_checkpoint(self._seq, state)

    def flush(self, timeout_s: float = _CLOSE_S) -> bool:
        """Wait until all is on the disk; say whether it is."""
        return self._running().flush(timeout_s)

    @property
    def problem(self) -> StoreError | None:
        """Why nothing can be written at the moment; None where all is well."""
        return None if self._writer is None else self._writer.problem

    @property
    def figures(self) -> Figures:
        """What writing took."""
        return self._running().figures

    def close(self, state: LifeState | None = None) -> None:
        """Write all that is known, and let others write.

        Raises:
            StoreWriteError: Not all could be written; what was written before is still there.
        """
        writer, self._writer = self._writer, None
        problem: StoreError | None = None
        if writer is not None:
            if state is not None:
                writer.put_checkpoint(self._seq, state)
            writer.retry()
            done = writer.flush(_CLOSE_S)
            writer.close(_CLOSE_S)
            problem = None if done else writer.problem
        try:
            if problem is None:
                self._connection.execute("PRAGMA incremental_vacuum").fetchall()
                self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        except sqlite3.Error:  # a reader holds it: what is beside the file is read as well
            pass
        finally:
            self._connection.close()
            self._lock.release()
        if problem is not None:
            raise StoreWriteError(f"not all that was learned is in the store: {problem}")

    def _running(self) -> Writer:
        if self._writer is None:
            raise StoreError(f"store {self.path} is closed, or was not started")
        return self._writer

    def _warn(self) -> None:
        """Say once that writing fails, and once that it goes on."""
        problem = self.problem
        if problem is not None and not self._warned:
            warnings.warn(
                f"{problem}; learning goes on in memory, and writing is tried again",
                StoreWarning,
                stacklevel=4,
            )
        self._warned = problem is not None


def read_all(
    connection: sqlite3.Connection, path: Path, *, salvage: bool = False, older: bool = False
) -> Found | None:
    """Return the newest checkpoint that is sound, and the log since; None where there is none.

    Args:
        connection: To the store.
        path: The store.
        salvage: Whether a damaged log is good for as far as it is sound.
        older: Whether to look through older checkpoints, too, as whoever writes does.

    Raises:
        StoreDamagedError: There are checkpoints, and none is sound; or the log is damaged.
    """
    connection.execute("BEGIN")
    try:
        damage: list[str] = []
        parts: dict[int, frozenset[str]] = {}
        for seq in checkpoints(connection):
            try:
                loaded = read_checkpoint(connection, seq)
            except StoreDamagedError as error:
                damage.append(str(error))
                continue
            parts[seq] = loaded.parts
            rows = _rows(connection, seq, damage, salvage=salvage)
            if older:
                _others(connection, seq, parts, damage)
            return Found(seq, loaded.state, rows, parts, tuple(damage))
        if damage:
            raise StoreDamagedError(
                f"{path} is damaged: {damage[0]}; a backup of it can be opened instead"
            )
        return None
    finally:
        connection.execute("ROLLBACK")


def _rows(
    connection: sqlite3.Connection, seq: int, damage: list[str], *, salvage: bool
) -> list[Row]:
    rows: list[Row] = []
    try:
        for row in read_rows(connection, seq):
            record_of(row)
            rows.append(row)
    except StoreDamagedError as error:
        if not salvage:
            raise StoreDamagedError(
                f"{error}; what was learned before it can be had with salvage "
                "(`mplearn store check --salvage`), or from a backup"
            ) from error
        damage.append(str(error))
    return rows


def _others(
    connection: sqlite3.Connection, seq: int, parts: dict[int, frozenset[str]], damage: list[str]
) -> None:
    """Find the parts of older checkpoints, which are to be kept."""
    for older in checkpoints(connection):
        if older < seq:
            try:
                parts[older] = read_checkpoint(connection, older).parts
            except StoreDamagedError as error:
                damage.append(str(error))


def is_begun(path: str | Path) -> bool:
    """Whether there is a store that holds something: one that was never finished does not.

    Raises:
        StoreError: There is a file, and it cannot be read.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> is_begun("new.db")
        False
        >>> learner = MotionLearner(LearnerConfig(("x", "y"), 50.0))
        >>> LifelongLearner.open("new.db", lambda: learner).close()
        >>> is_begun("new.db")
        True
    """
    path = path_of("path", path)
    if not path.exists() or not path.stat().st_size:
        return False
    connection = open_reading(path)
    try:
        with errors_of(path):
            return bool(checkpoints(connection))
    except NotAStoreError:
        return False
    finally:
        connection.close()


def backup(path: str | Path, to: str | Path) -> Path:
    """Write a copy of a store as it is now, whoever writes to it; return its path.

    Raises:
        StoreError: It cannot be read, or the copy cannot be written.
        InvalidValueError: There is a file already.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, StoreReader
        >>> config = LearnerConfig(channels=("x", "y"))
        >>> with LifelongLearner.open("life.db", lambda: MotionLearner(config)) as life:
        ...     events = life.learn_many(np.zeros((300, 2)))
        >>> copy = backup("life.db", "copy.db")
        >>> check(copy), info(copy).version == info("life.db").version, is_begun("none.db")
        ((), True, False)
    """
    path, to = path_of("path", path), path_of("to", to)
    if to.exists():
        raise InvalidValueError(f"{to} exists already; a backup is a new file")
    if path.exists() and not is_begun(path):
        raise NotAStoreError(f"{path} holds no store: it was never finished")
    connection = open_reading(path)
    try:
        with errors_of(to):
            connection.execute("VACUUM INTO ?", (str(to),))
    except BaseException:
        for each in (to, to.with_name(f"{to.name}-journal")):
            each.unlink(missing_ok=True)
        raise
    finally:
        connection.close()
    return to


def check(path: str | Path) -> tuple[str, ...]:
    """Return all that is wrong with a store; nothing where it is sound.

    Raises:
        StoreError: It cannot be opened at all.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder) / "life.db"
        ...     learner = MotionLearner(LearnerConfig(("x", "y"), 50.0))
        ...     LifelongLearner.open(path, lambda: learner).close()
        ...     check(path), info(path).path == path
        ((), True)
    """
    path = path_of("path", path)
    connection = open_reading(path)
    try:
        wrong = integrity(connection)
        if not wrong:
            try:
                found = read_all(connection, path, salvage=True, older=True)
                wrong = [*(found.damage if found else ("it holds no checkpoint",))]
            except StoreDamagedError as error:
                wrong = [str(error)]
        return tuple(wrong)
    finally:
        connection.close()


def info(path: str | Path) -> StoreInfo:
    """Return a store at a glance.

    Raises:
        StoreError: It cannot be opened.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> learner = MotionLearner(LearnerConfig(("x", "y"), 50.0))
        >>> LifelongLearner.open("small.db", lambda: learner).close()
        >>> info("small.db").records
        0
    """
    path = path_of("path", path)
    connection = open_reading(path)
    try:
        with errors_of(path):
            records = connection.execute("SELECT count(*) FROM log").fetchone()[0]
            parts = connection.execute("SELECT count(*) FROM part").fetchone()[0]
            newest = connection.execute(
                "SELECT seq, at FROM checkpoint ORDER BY seq DESC LIMIT 1"
            ).fetchone()
            free = connection.execute("PRAGMA freelist_count").fetchone()[0]
            page = connection.execute("PRAGMA page_size").fetchone()[0]
            seq, at = newest or (None, None)
            beside = [path.with_name(path.name + end) for end in ("-wal", "-shm")]
            size = sum(each.stat().st_size for each in (path, *beside) if each.exists())
            version = version_of(connection)
            return StoreInfo(path, version, size, records, seq, at, parts, free * page)
    finally:
        connection.close()

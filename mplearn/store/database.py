"""The file of a store: opened, checked and named if anything is wrong with it."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

from ..errors import (
    NotAStoreError,
    StoreDamagedError,
    StoreError,
    StoreInUseError,
    StoreVersionError,
    StoreWriteError,
)
from ..state import SQLITE
from .schema import APPLICATION_ID, READABLE, VERSION, migrate, version_of

BUSY_S = 10.0
_PAGE = 4096
_WAL_BYTES = 16 * 2**20  # to which the file of what is not yet in the store shrinks again
_CANNOT_WRITE = ("full", "readonly", "read-only", "disk I/O", "unable to open")


def open_writing(path: Path, *, check: bool = True) -> sqlite3.Connection:
    """Open a store to write to it; one is made where there is no file.

    Raises:
        StoreError: It cannot be opened; the class says why.
    """
    look_at(path)
    with errors_of(path):
        connection = _connect(path, "rwc")
        try:
            if not _has_tables(connection):
                connection.execute(f"PRAGMA page_size = {_PAGE}")
                connection.execute("PRAGMA auto_vacuum = INCREMENTAL")
            else:
                _check(connection, path, check=check)
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute(f"PRAGMA journal_size_limit = {_WAL_BYTES}")
            migrate(connection)
            connection.execute("BEGIN IMMEDIATE")
            connection.execute("ROLLBACK")
        except BaseException:
            connection.close()
            raise
    return connection


def open_reading(path: Path, *, check: bool = False) -> sqlite3.Connection:
    """Open a store to look at it, whoever writes to it.

    Raises:
        StoreError: It cannot be opened; the class says why.
    """
    if not path.exists():
        raise NotAStoreError(f"there is no store {path}")
    look_at(path)
    with errors_of(path):
        connection = _connect(path, "ro")
        try:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        except sqlite3.OperationalError:
            connection.close()
            wal = path.with_name(path.name + "-wal")
            if wal.exists() and wal.stat().st_size:
                raise
            connection = _connect(path, "ro&immutable=1")  # where nothing beside it can be written
        try:
            if not _has_tables(connection):
                raise NotAStoreError(f"{path} holds no store: it was never finished")
            _check(connection, path, check=check)
            if version_of(connection) < READABLE:
                raise StoreVersionError(
                    f"{path} is of version {version_of(connection)}, this is {VERSION}: open it "
                    "for writing once, as `mplearn store check` does"
                )
        except BaseException:
            connection.close()
            raise
    return connection


@contextmanager
def errors_of(path: Path) -> Iterator[None]:
    """Let errors of SQLite be named."""
    try:
        yield
    except sqlite3.Error as error:
        raise named(error, path) from error


def named(error: sqlite3.Error, path: Path) -> StoreError:
    """Return what an error of SQLite means."""
    text = str(error)
    if any(word in text for word in _CANNOT_WRITE):
        return StoreWriteError(f"{path} cannot be written: {text}")
    if "locked" in text or "busy" in text:
        return StoreInUseError(f"{path} is held by another program: {text}")
    if "not a database" in text:
        return NotAStoreError(f"{path} is no store, or its beginning is damaged: {text}")
    return StoreDamagedError(f"{path} is damaged: {text}; a backup of it can be opened instead")


def integrity(connection: sqlite3.Connection) -> list[str]:
    """Return what is wrong with the pages of a file; nothing where it is sound."""
    try:
        found = [str(row[0]) for row in connection.execute("PRAGMA integrity_check(20)")]
    except sqlite3.DatabaseError as error:
        return [str(error)]
    return [] if found == ["ok"] else found


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    uri = f"file:{quote(os.path.abspath(path))}?mode={mode}"  # noqa: PTH100  (no links resolved)
    return sqlite3.connect(
        uri, timeout=BUSY_S, isolation_level=None, check_same_thread=False, uri=True
    )


def look_at(path: Path) -> None:
    """Refuse what is no file, and files that are something else by their first bytes.

    Raises:
        StoreError: It is no store.
    """
    if path.is_dir():
        raise NotAStoreError(f"{path} is a folder; a store is a file")
    if not path.exists():
        if not path.parent.is_dir():
            raise NotAStoreError(f"there is no folder {path.parent} for {path.name}")
        return
    try:
        with path.open("rb") as file:
            head = file.read(len(SQLITE))
    except OSError as error:
        raise NotAStoreError(f"{path} cannot be read: {error.strerror}") from error
    if head and head != SQLITE:
        raise NotAStoreError(f"{path} is no store, or its beginning is damaged")


def _has_tables(connection: sqlite3.Connection) -> bool:
    return bool(connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0])


def _check(connection: sqlite3.Connection, path: Path, *, check: bool) -> None:
    """Check whose file it is, of which version, and that its pages are sound.

    Raises:
        StoreError: It is not ours, newer, or damaged.
    """
    owner = int(connection.execute("PRAGMA application_id").fetchone()[0])
    if owner & 0xFFFFFFFF != APPLICATION_ID:
        raise NotAStoreError(
            f"{path} is a database of another program: application id {owner}, not {APPLICATION_ID}"
        )
    version = version_of(connection)
    if version > VERSION:
        raise StoreVersionError(
            f"{path} was written by a newer mplearn: version {version}, this one reads up to "
            f"{VERSION}"
        )
    wrong = integrity(connection) if check else []
    if wrong:
        raise StoreDamagedError(
            f"{path} is damaged: {wrong[0]}"
            + (f" and {len(wrong) - 1} more" if len(wrong) > 1 else "")
            + "; a backup of it can be opened instead"
        )

"""Records, checkpoints and parts as rows of the tables."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from typing import NamedTuple

from ..errors import MPLearnError, StoreDamagedError
from ..state import Checkpoint, from_bytes, resumed, to_bytes
from .commands import from_record, to_record
from .journal import Entry
from .life_state import LifeState
from .records import Begin, Done, End, Frames, Record
from .schema import digest


class Row(NamedTuple):
    """A row of the log."""

    seq: int
    kind: str
    at: float
    data: bytes


def row_of(seq: int, record: Record) -> Row:
    """Return a record as a row."""
    match record:
        case Frames(frames, when):
            return Row(seq, "frames", when, to_bytes(frames))
        case Begin(channels, key):
            return Row(seq, "begin", 0.0, to_bytes({"channels": list(channels), "key": key}))
        case Done(key):
            return Row(seq, "done", 0.0, to_bytes({"key": key}))
        case Entry(number, command, by, when):
            content = {"number": number, "by": by, "command": to_record(command)}
            return Row(seq, "command", when, to_bytes(content))
        case End():
            return Row(seq, "end", 0.0, b"")


def record_of(row: Row) -> Record:
    """Return the record that a row describes.

    Raises:
        StoreDamagedError: It describes none.
    """
    try:
        if row.kind == "frames":
            return Frames(from_bytes(row.data), row.at)
        if row.kind == "end":
            return End()
        content = from_bytes(row.data)
        if row.kind == "begin":
            return Begin(tuple(content["channels"]), content["key"])
        if row.kind == "done":
            return Done(content["key"])
        if row.kind == "command":
            command = from_record(content["command"])
            return Entry(content["number"], command, content["by"], row.at, 0)
    except (MPLearnError, LookupError, TypeError) as error:
        raise StoreDamagedError(f"record {row.seq} is damaged: {error}") from error
    raise StoreDamagedError(f"record {row.seq} is of no known kind, {row.kind!r:.40}")


def write_rows(connection: sqlite3.Connection, rows: list[Row]) -> None:
    """Write rows of the log."""
    connection.executemany(
        "INSERT OR REPLACE INTO log (seq, kind, at, data, digest) VALUES (?, ?, ?, ?, ?)",
        [(*row, digest(*row)) for row in rows],
    )


def read_rows(connection: sqlite3.Connection, after: int) -> Iterator[Row]:
    """Go through the rows of the log after one, in order.

    Raises:
        StoreDamagedError: One is missing, or is not what was written.
    """
    expected = after + 1
    found = connection.execute(
        "SELECT seq, kind, at, data, digest FROM log WHERE seq > ? ORDER BY seq", (after,)
    )
    for *values, said in found:
        row = Row(*values)
        if row.seq != expected:
            raise StoreDamagedError(f"record {expected} is missing; the next one is {row.seq}")
        if digest(*row) != said:
            raise StoreDamagedError(f"record {row.seq} is damaged: its content has another digest")
        expected += 1
        yield row


def write_checkpoint(connection: sqlite3.Connection, seq: int, at: float, made: Checkpoint) -> None:
    """Write a checkpoint whose parts are there."""
    connection.execute(
        "INSERT OR REPLACE INTO checkpoint (seq, at, document, digest) VALUES (?, ?, ?, ?)",
        (seq, at, made.document, digest(seq, at, made.document)),
    )


class Loaded(NamedTuple):
    """A checkpoint that was read.

    Attributes:
        seq: Number of the last record in it.
        at: When it was written [s since 1970].
        state: What was known.
        parts: Keys of its parts.
    """

    seq: int
    at: float
    state: LifeState
    parts: frozenset[str]


def checkpoints(connection: sqlite3.Connection) -> list[int]:
    """Return the numbers of the checkpoints, the newest first."""
    found = connection.execute("SELECT seq FROM checkpoint ORDER BY seq DESC")
    return [int(seq) for (seq,) in found]


def read_checkpoint(connection: sqlite3.Connection, seq: int) -> Loaded:
    """Read a checkpoint.

    Raises:
        StoreDamagedError: It, or a part of it, is not what was written.
    """
    at, document, said = connection.execute(
        "SELECT at, document, digest FROM checkpoint WHERE seq = ?", (seq,)
    ).fetchone()
    if digest(seq, at, document) != said:
        raise StoreDamagedError(f"checkpoint {seq} is damaged: its content has another digest")
    used: set[str] = set()

    def part(key: str) -> bytes:
        used.add(key)
        row = connection.execute("SELECT data FROM part WHERE key = ?", (key,)).fetchone()
        if row is None:
            raise KeyError(key)
        return bytes(row[0])

    try:
        state = resumed(LifeState, document, part)
    except MPLearnError as error:
        raise StoreDamagedError(f"checkpoint {seq} is damaged: {error}") from error
    return Loaded(seq, at, state, frozenset(used))

"""The tables of a store, version after version: each step turns a file of one into the next."""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Callable

APPLICATION_ID = 0x6D706C73  # "mpls"

# What came in since the checkpoint before the last: records in order, gapless.
# Parts of checkpoints, each once, by the hash of its content.
# Checkpoints: what was known after a record, with the keys of its parts.
_FIRST = """
CREATE TABLE log (
    seq INTEGER PRIMARY KEY, kind TEXT NOT NULL, at REAL NOT NULL, data BLOB NOT NULL
) STRICT;
CREATE TABLE part (key TEXT PRIMARY KEY, data BLOB NOT NULL) STRICT;
CREATE TABLE checkpoint (seq INTEGER PRIMARY KEY, at REAL NOT NULL, document BLOB NOT NULL) STRICT;
"""


def digest(*values: object) -> bytes:
    """Return the digest of a row: what it holds but the digest itself."""
    found = hashlib.blake2b(digest_size=16)
    for value in values:
        data = value if isinstance(value, bytes) else repr(value).encode()
        found.update(len(data).to_bytes(8, "little") + data)
    return found.digest()


def _tables(connection: sqlite3.Connection) -> None:
    for statement in _FIRST.split(";")[:-1]:
        connection.execute(statement)


def _digests(connection: sqlite3.Connection) -> None:
    """Give each row a digest, so that damage inside a row is found."""
    connection.create_function("digest", -1, digest, deterministic=True)
    for table, columns in (("log", "seq, kind, at, data"), ("checkpoint", "seq, at, document")):
        connection.execute(f"ALTER TABLE {table} ADD COLUMN digest BLOB NOT NULL DEFAULT x''")
        connection.execute(f"UPDATE {table} SET digest = digest({columns})")


def _rows_of_parts(_: sqlite3.Connection) -> None:
    """Documents may name rows of parts from here on, which those who read the version before miss.

    What is there stays as it is.
    """


def _tables_in_blocks(_: sqlite3.Connection) -> None:
    """Parts may name the blocks of a table from here on; what is there stays as it is."""


MIGRATIONS: tuple[Callable[[sqlite3.Connection], None], ...] = (
    _tables,
    _digests,
    _rows_of_parts,
    _tables_in_blocks,
)
"""Step k turns version k into k + 1."""

VERSION = len(MIGRATIONS)
READABLE = 2  # from this version on a file can be read as it is


def migrate(connection: sqlite3.Connection, to: int = VERSION) -> int:
    """Bring a file to a version, each step whole or not at all; return the version it had.

    Args:
        connection: To the file; no transaction is open.
        to: The version.
    """
    before = version_of(connection)
    for version in range(before, to):
        connection.execute("BEGIN IMMEDIATE")
        try:
            MIGRATIONS[version](connection)
            connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            connection.execute(f"PRAGMA user_version = {version + 1}")
            connection.execute("COMMIT")
        except BaseException:
            connection.execute("ROLLBACK")
            raise
    return before


def version_of(connection: sqlite3.Connection) -> int:
    """Return the version of a file; 0 before it has tables."""
    return int(connection.execute("PRAGMA user_version").fetchone()[0])

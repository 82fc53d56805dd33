"""Who writes to a store: one process at a time, and nobody once that has ended, however it did."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from typing import IO

from ..errors import StoreInUseError, StoreWriteError


class WriterLock:
    """A lock that the system holds for the process: it is free as soon as that is gone.

    It lies on a file beside the store, because SQLite has locks of its own on the store itself.

    Args:
        path: The store.

    Raises:
        StoreInUseError: Somebody else writes; the message says who.
        StoreWriteError: The file of the lock cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path.with_name(path.name + ".lock")
        self._file = self._taken(path)

    def release(self) -> None:
        """Let others write."""
        self._path.unlink(missing_ok=True)  # while it is held: who opens it now, looks again
        self._file.close()

    def _taken(self, path: Path) -> IO[str]:
        while True:
            try:
                file = self._path.open("a+", encoding="utf-8")
            except OSError as error:
                raise StoreWriteError(f"{path} cannot be written: {error.strerror}") from error
            if not _lock(file):
                file.seek(0)
                holder = file.read(200).strip() or "another process"
                file.close()
                raise StoreInUseError(
                    f"{path} is being written to by {holder}, which must end first (Ctrl-C or "
                    "SIGTERM: it keeps what it has learned); readers may open it"
                )
            try:
                same = os.path.samestat(os.fstat(file.fileno()), self._path.stat())
            except FileNotFoundError:
                same = False
            if same:
                break
            file.close()  # it was taken away by who held it before
        file.truncate(0)
        file.write(f"process {os.getpid()} on {socket.gethostname()}")
        file.flush()
        return file


def _lock(file: IO[str]) -> bool:
    """Lock a file for this process, if nobody else has."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        try:
            file.seek(1 << 30)  # beyond the text, which others read
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        except OSError:
            return False
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True

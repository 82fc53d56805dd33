"""Files that are written whole, or not at all."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """Yield a new file beside another, which takes its place at the end, if nothing went wrong.

    So who is interrupted leaves what was there before. A link stays one, what it leads to is
    written; the mode stays; the new file's name ends as the other's does. What is no ordinary file,
    such as a pipe or a device, is yielded itself.

    Args:
        path: The file; its folder is there.

    Raises:
        OSError: It cannot be written.

    Example:
        >>> from pathlib import Path
        >>> Path("a.txt").write_text("old")
        3
        >>> with written_whole("a.txt") as file:
        ...     written = file.write_text("new")
        ...     Path("a.txt").read_text()
        'old'
        >>> Path("a.txt").read_text()
        'new'
    """
    path = Path(os.path.realpath(path))
    if path.is_symlink() or path.is_dir():  # a link yet: in a circle
        number = errno.ELOOP if path.is_symlink() else errno.EISDIR
        raise OSError(number, os.strerror(number), str(path))
    if path.exists() and not path.is_file():
        yield path
        return
    mode = path.stat().st_mode & 0o7777 if path.exists() else 0o644
    try:
        handle, name = tempfile.mkstemp(path.suffix, f".{path.stem}.", path.parent)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    temporary = Path(name)
    try:
        os.close(handle)
        yield temporary
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.chmod(mode)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)

"""Files as they come: plain, packed or in an archive, and the error that names them."""

from __future__ import annotations

import codecs
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedIOBase
from pathlib import Path
from zipfile import ZipExtFile

from ..errors import RecordingError
from .packed.archives import (
    ArchiveError,
    Member,
    archive_of,
    members,
    open_member,
    recordings_in,
)
from .packed.packing import DAMAGE, STARTS, most_unpacked, packing, unpacked_name, unpacking

_LONGEST_SHOWN = 300  # characters of what a file holds
_LARGE_BYTES = 8_000_000
_TELLING = 64  # bytes of plain letters, in which every second one is 0 in UTF-16
_NOTHING = b"\0\x1a"  # behind a text: space of a disk that was not written, the end by DOS
# how what was saved instead of a recording begins, what it is, and what is wanted
_NO_RECORDINGS = (
    (
        b"version https://git-lfs",
        "a pointer of Git LFS",
        "the file that it stands for (git lfs pull)",
    ),
    (b"<!doctype html", "a page of the web", "the file that it links to"),
    (b"<html", "a page of the web", "the file that it links to"),
)
_LAST_CELL = re.compile(r"(?<=[^\s,;])[ \t,;]+([^\s,;]*)\Z")
_WORD = re.compile(r"\b(?!nan\b)[a-z]", re.I)
_ZIP = b"PK\x03\x04"
_PIECE = 4096  # bytes of what is packed that are unpacked at once
# characters that a line, and a cell, of a large table has at least: more lines of nothing than
# memory holds are no measurement
_LEAST_LINE, _LEAST_CELL = 12, 1.6
_LINES_BEFORE = 20  # of which the last numbers tell whether a file's last one is cut off


def suffix(path: Path) -> str:
    """Return the suffix that names the format, lower case: ``86_01.amc.gz`` -> ``.amc``."""
    return Path(unpacked_name(path.name)).suffix.lower()


def stem(path: Path) -> str:
    """Return the name without the suffixes: ``86_01.amc.gz`` -> ``86_01``."""
    return Path(unpacked_name(path.name)).stem


def cmu_subject(name: str) -> str:
    """Return the subject of a name like CMU's, ``86_01`` -> ``86``; empty for other names."""
    match = re.fullmatch(r"(\d+)_\d+", name)
    return match[1] if match else ""


def bad_file(path: Path, found: str, expected: str) -> RecordingError:
    """Return the error of a file that does not hold what its format promises.

    Example:
        >>> from pathlib import Path
        >>> raise bad_file(Path("take.trc"), "a frame of 5 numbers", "7")
        Traceback (most recent call last):
        mplearn.errors.RecordingError: ...take.trc...
    """
    shown = found if len(found) <= _LONGEST_SHOWN else f"{found[:_LONGEST_SHOWN]}..."
    return RecordingError(f"{path}: {shown}; expected {expected}")


def is_file(path: Path) -> bool:
    """Whether a path is a regular file, also in an archive: no folder, pipe, device or nonsense."""
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except NotADirectoryError:  # it leads through a file
        return _inside(path) is not None
    except (OSError, ValueError):  # too long a name, too many links, a null character
        return False


def is_folder(path: Path) -> bool:
    """Whether a path is a folder, also in an archive; an archive itself is a file."""
    try:
        return stat.S_ISDIR(path.stat().st_mode)
    except NotADirectoryError:
        at = archive_of(path / "file")
        return at is not None and bool(contents(path))
    except (OSError, ValueError):
        return False


def may_be_read(path: Path) -> bool:
    """Whether a file may be read by who asks."""
    return os.access(path, os.R_OK) or _inside(path) is not None


def within(path: Path) -> list[Path]:
    """Return what lies in a folder, an archive or a folder in one, in order.

    Not what macOS keeps of a file beside it, ``._one.bvh``.

    Raises:
        OSError: A folder may not be read.
        RecordingError: An archive cannot be looked into.
    """
    if path.is_dir():
        return sorted(each for each in path.iterdir() if not each.name.startswith("._"))
    names = {file.relative_to(path).parts[0] for file in contents(path)}
    return sorted(path / name for name in names)


def contents(path: Path) -> list[Path]:
    """Return the files in an archive, or in a folder in one, that may be recordings, in order.

    Raises:
        RecordingError: It cannot be looked into.
    """
    archive, file = archive_of(path / "file") or (path, "file")
    try:
        return [archive / name for name in recordings_in(archive, file.rpartition("/")[0])]
    except ArchiveError as error:
        raise bad_file(archive, error.found, error.expected) from error


def size_of(path: Path) -> int:
    """Return the size of a file, also in an archive [bytes]; -1 where there is none."""
    inside = _inside(path)
    if inside is not None:
        return inside.size
    return path.stat().st_size if is_file(path) else -1


def older_copies(path: Path) -> int:
    """Return how many files of its name a file in an archive has replaced."""
    inside = _inside(path)
    return inside.older if inside else 0


def _inside(path: Path) -> Member | None:
    """Return the file in an archive that a path leads to; None where it does not."""
    at = archive_of(path)
    try:
        return None if at is None else members(at[0]).get(at[1])
    except ArchiveError:
        return None


def head(path: Path, n_bytes: int = 8192) -> bytes:
    """Return the start of a file, unpacked where it is packed; empty if unreadable."""
    if not is_file(path):
        return b""
    try:
        with _opened(path) as file:
            return _start(file, n_bytes)
    except (*DAMAGE, ArchiveError):
        return b""


def head_text(path: Path, n_bytes: int = 8192) -> str:
    """Return the start of a text file; empty if it is unreadable, or no text."""
    data = _plain(head(path, n_bytes)).rstrip(_NOTHING)
    return "" if b"\0" in data else data.decode("utf-8-sig", errors="replace")


def read_bytes(path: Path) -> bytes:
    """Return the content of a file, unpacked where it is packed, or in an archive.

    Raises:
        RecordingError: The file is missing, empty, unreadable, no regular file, a packed file that
            is damaged or expands beyond what measured motion does, or what was saved instead of a
            recording: a pointer to it, a page of the web, an archive.
    """
    if not is_file(path):
        raise bad_file(path, "no such file", "a readable file")
    inside, how = _inside(path), ""
    try:
        with _raw(path) as file:
            how = packing(file.read(STARTS))
        size = path.stat().st_size if inside is None else inside.packed
        limit = most_unpacked(size) if how or inside else size
        with _opened(path) as file:
            data = _start(file, limit + 1)
    except ArchiveError as error:
        raise bad_file(path, error.found, error.expected) from error
    except DAMAGE as error:
        if (how or inside) and not (isinstance(error, OSError) and error.errno):
            whole = f"{how} file" if how else "archive"
            raise bad_file(path, f"damaged ({error})", f"a whole {whole}") from error
        reason = getattr(error, "strerror", None) or error
        raise bad_file(path, f"cannot be read ({reason})", "a readable file") from error
    if len(data) > limit and (how or inside):
        raise bad_file(path, f"expands to more than {limit} bytes", "a recording of motion")
    if not data.strip():
        raise _empty(path)
    _refuse_other_files(path, data)
    return data


def _empty(path: Path) -> RecordingError:
    return bad_file(path, "the file is empty", f"a {suffix(path)} recording")


def _refuse_other_files(path: Path, data: bytes) -> None:
    """Refuse what was saved instead of a recording, or around it."""
    start = data[:_TELLING].lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    for begins, found, expected in _NO_RECORDINGS:
        if start.startswith(begins):
            raise bad_file(path, f"it is {found}, not a recording", expected)
    if data.startswith(_ZIP) and suffix(path) != ".npz":
        raise bad_file(path, "it is an archive", "a recording, or the archive unpacked")


def read_text(path: Path) -> str:
    r"""Return the content of a text file: UTF-8, Latin-1 of older tools, or UTF-16 of Windows.

    A number in which the file ends is left out: it has not all digits, and is another one.

    Raises:
        RecordingError: As `read_bytes`, or the file is not text.

    Example:
        >>> from pathlib import Path
        >>> _ = Path("take.csv").write_text("time_s,coude gauche\n", encoding="utf-16")
        >>> read_text(Path("take.csv"))
        'time_s,coude gauche\n'
    """
    data = _plain(read_bytes(path)).rstrip(_NOTHING)
    if not data.strip():
        raise _empty(path)
    if b"\0" in data:
        raise bad_file(path, "the file is binary", f"the text of a {suffix(path)} recording")
    if len(data) > _LARGE_BYTES:
        n_lines = data.count(b"\n")
        n_cells = n_lines + sum(map(data.count, (b",", b";", b"\t")))
        if len(data) < max(_LEAST_LINE * n_lines, _LEAST_CELL * n_cells):
            raise bad_file(
                path, f"{n_lines} lines of hardly any characters", "lines of measured values"
            )
    try:
        return _without_cut_number(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        return _without_cut_number(data.decode("latin-1"))


def _without_cut_number(text: str) -> str:
    """Return a text without a last number that has fewer decimals than those of the lines before.

    It is known where no line break is behind it, and all lines before end in numbers that have at
    least two decimals more, or any if it has none; one alone may be a zero that was not
    written, if no exponent is cut.
    """
    end = text.rfind("\n")
    last = _LAST_CELL.search(text, end + 1)
    if last is None or not last[1]:
        return text
    known: list[int] = []
    named = _WORD.search(text, end + 1) is not None
    while end > 0 and len(known) < _LINES_BEFORE:
        begin = text.rfind("\n", 0, end) + 1
        cell = _LAST_CELL.search(text[begin:end].rstrip("\r"))
        if cell is not None:  # else a line of one cell, as the number of a frame
            n_decimals = _n_decimals(cell[1])
            if _WORD.search(text, begin, end) and not (named and n_decimals > 0):
                break  # names of columns
            known.append(n_decimals)
        end = begin - 1
    unsure = "e" not in last[1].lower()
    cut = len(known) > 2 and _n_decimals(last[1]) < min(known) - unsure
    return text[: last.start()] if cut else text


def _n_decimals(cell: str) -> int:
    """Return how many characters stand behind the decimal point, -1 for none."""
    return len(cell.partition(".")[2]) or -1


def _plain(data: bytes) -> bytes:
    """Return text in UTF-32 or UTF-16, by its mark or its zeros, as UTF-8; others as they are."""
    start = data[:_TELLING]
    if data.startswith((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)):
        encoding = "utf-32"
    elif data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "utf-16"
    elif len(start) > 1 and 0 not in start[::2] and not any(start[1::2]):
        encoding = "utf-16-le"
    elif len(start) > 1 and 0 not in start[1::2] and not any(start[::2]):
        encoding = "utf-16-be"
    else:
        return data
    return data.decode(encoding, errors="replace").encode("utf-8", errors="replace")


@contextmanager
def _opened(path: Path) -> Iterator[BufferedIOBase]:
    """Open a file, unpacked where it is packed, whatever it is called."""
    with _raw(path) as file:
        how = packing(file.read(STARTS))
    with _raw(path) as file:
        if how:
            with unpacking(file, how) as unpacked:
                yield unpacked
        else:
            yield file


def _raw(path: Path) -> BufferedIOBase:
    at = archive_of(path)
    return path.open("rb") if at is None else open_member(*at)


def _start(file: BufferedIOBase, n_bytes: int) -> bytes:
    """Return the first so many bytes; those in a zip archive by pieces.

    There bzip2 and LZMA unpack all that they are given, however few bytes are asked for.
    """
    if not isinstance(file, ZipExtFile):
        return file.read(n_bytes)
    data = bytearray()
    while len(data) < n_bytes and (piece := file.read(min(_PIECE, n_bytes - len(data)))):
        data += piece
    return bytes(data)

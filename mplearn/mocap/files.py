"""Files as they come: plain, gzipped or alone in a zip archive, and the error that names them."""

from __future__ import annotations

import codecs
import gzip
import lzma
import re
import stat
import zipfile
import zlib
from collections.abc import Callable
from io import BufferedIOBase
from pathlib import Path
from typing import cast

from ..errors import RecordingError

_MOST_PACKED = 60  # times; tables of measured numbers pack to a half or a tenth
_SMALL_BYTES = 4_000_000
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
_ZIP_NAME = 30  # where an archive names the first file in it
_ZIP, _GZIP = b"PK\x03\x04", b"\x1f\x8b\x08"
# what lies beside a recording in an archive, and is none
_BESIDE = re.compile(
    r"(?:^|/)(?:__MACOSX/|\.|desktop\.ini$|thumbs\.db$|(?:read ?me|licen[cs]e)[^/]*$)"
    r"|\.(?:pdf|md|html?|rtf|docx?|png|jpe?g|gif|mp4|avi|mov|fbx|blend)$",
    re.I,
)
_WORKBOOK = "[Content_Types].xml"  # of programs for offices
_MOST_NAMED = 6
_ZIP_DAMAGE = (zipfile.BadZipFile, lzma.LZMAError, RuntimeError, ValueError, KeyError)
_PIECE = 4096  # bytes of what is packed that are unpacked at once
# characters that a line, and a cell, of a large table has at least: more lines of nothing than
# memory holds are no measurement
_LEAST_LINE, _LEAST_CELL = 12, 1.6
_LINES_BEFORE = 20  # of which the last numbers tell whether a file's last one is cut off


def suffix(path: Path) -> str:
    """Return the suffix that names the format, lower case: ``86_01.amc.gz`` -> ``.amc``.

    Of a zip archive it is that of the only recording in it.
    """
    ending = Path(_ungzipped(path)).suffix.lower()
    if ending != ".zip":
        return ending
    inside = _only_recording(path)
    return Path(inside).suffix.lower() if inside else ending


def stem(path: Path) -> str:
    """Return the name without the suffixes: ``86_01.amc.gz`` -> ``86_01``."""
    return Path(_ungzipped(path)).stem


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
    """Whether a path is a regular file: no folder, no pipe, no device, and no nonsense."""
    return _is(path, stat.S_ISREG)


def is_folder(path: Path) -> bool:
    """Whether a path is a folder."""
    return _is(path, stat.S_ISDIR)


def _is(path: Path, kind: Callable[[int], bool]) -> bool:
    try:
        return kind(path.stat().st_mode)
    except (OSError, ValueError):  # too long a name, too many links, a null character
        return False


def head(path: Path, n_bytes: int = 8192) -> bytes:
    """Return the start of a file, unpacked where it is gzipped; empty if unreadable."""
    if not is_file(path):
        return b""
    try:
        with _opened(path) as file:
            return _start(file, n_bytes)
    except (OSError, EOFError, zlib.error, *_ZIP_DAMAGE):
        return b""


def head_text(path: Path, n_bytes: int = 8192) -> str:
    """Return the start of a text file; empty if it is unreadable, or no text."""
    data = _plain(head(path, n_bytes)).rstrip(_NOTHING)
    return "" if b"\0" in data else data.decode("utf-8-sig", errors="replace")


def read_bytes(path: Path) -> bytes:
    """Return the content of a file, unpacked where it is gzipped, or alone in a zip archive.

    Raises:
        RecordingError: The file is missing, empty, unreadable, no regular file, a packed file that
            is damaged or expands beyond what measured motion does, or what was saved instead of a
            recording: a pointer to it, a page of the web, an archive of several.
    """
    if not is_file(path):
        raise bad_file(path, "no such file", "a readable file")
    packed = False
    try:
        packed = _is_packed(path)
        limit = path.stat().st_size
        if packed:
            limit = max(_SMALL_BYTES, _MOST_PACKED * limit)
        with _opened(path) as file:
            data = _start(file, limit + 1)
    except (OSError, EOFError, zlib.error, *_ZIP_DAMAGE) as error:
        if packed and not (isinstance(error, OSError) and error.errno):
            whole = "gzip file" if _starts(path) == _GZIP else "zip archive"
            raise bad_file(path, f"damaged ({error})", f"a whole {whole}") from error
        reason = getattr(error, "strerror", None) or error
        raise bad_file(path, f"cannot be read ({reason})", "a readable file") from error
    if packed and len(data) > limit:
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
    if data.startswith(_ZIP) and data[_ZIP_NAME:].startswith(b"header.json"):
        raise bad_file(
            path, "it is a library of primitives, not a recording", "a recording of motion"
        )
    if data.startswith(_ZIP) and suffix(path) != ".npz":
        inside = _recordings_in(path)
        if _WORKBOOK in inside:
            raise bad_file(path, "it is a file of an office program", "a table saved as CSV")
        shown = ", ".join(inside[:_MOST_NAMED]) + (", ..." if len(inside) > _MOST_NAMED else "")
        found = f"it is a zip archive of {len(inside)} files ({shown})"
        if not inside:
            found = "it is a zip archive without a recording, or damaged"
        raise bad_file(path, found, "one recording in it, or the files unpacked")


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


def _opened(path: Path) -> BufferedIOBase:
    if _starts(path) == _GZIP:
        return gzip.open(path)
    inside = _only_recording(path) if _is_packed(path) else ""
    if not inside:
        return path.open("rb")
    with zipfile.ZipFile(path) as archive:  # keeps the file open as long as what is in it
        return cast("BufferedIOBase", archive.open(inside))


def _start(file: BufferedIOBase, n_bytes: int) -> bytes:
    """Return the first so many bytes; those in a zip archive by pieces.

    There bzip2 and LZMA unpack all that they are given, however few bytes are asked for.
    """
    if not isinstance(file, zipfile.ZipExtFile):
        return file.read(n_bytes)
    data = bytearray()
    while len(data) < n_bytes and (piece := file.read(min(_PIECE, n_bytes - len(data)))):
        data += piece
    return bytes(data)


def _is_packed(path: Path) -> bool:
    """Whether a file is gzipped, as browsers unpack and leave its name, or alone in an archive."""
    start = _starts(path)
    return start == _GZIP or (start == _ZIP[: len(_GZIP)] and bool(_only_recording(path)))


def _starts(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(len(_GZIP))


def _only_recording(path: Path) -> str:
    """Return the name of the file that is alone in a zip archive; empty for none, and for more."""
    inside = _recordings_in(path)
    return inside[0] if len(inside) == 1 else ""


def _recordings_in(path: Path) -> list[str]:
    """Return the files in a zip archive that may be recordings; none where it is no archive."""
    if Path(_ungzipped(path)).suffix.lower() == ".npz" or not is_file(path):
        return []  # an archive of arrays is one recording
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (OSError, *_ZIP_DAMAGE):
        return []
    return [name for name in names if not name.endswith("/") and not _BESIDE.search(name)]


def _ungzipped(path: Path) -> str:
    return path.name[:-3] if path.name.lower().endswith(".gz") else path.name

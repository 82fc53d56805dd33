"""Archives as folders: a path may lead into one, ``session.zip/walks/one.bvh``."""

from __future__ import annotations

import io
import os
import re
import tarfile
import tempfile
import zipfile
from abc import ABC, abstractmethod
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from functools import cached_property, lru_cache
from pathlib import Path, PurePosixPath
from threading import Lock
from typing import IO, NamedTuple, cast

from .packing import DAMAGE, STARTS, most_unpacked, packing, unpacking

_ZIP_STARTS = (b"PK\x03\x04", b"PK\x05\x06")  # of one with files, of an empty one
_OTHERS = {b"7z\xbc\xaf\x27\x1c": "a 7z", b"Rar!\x1a\x07": "a RAR"}
_TAR, _TAR_AT = b"ustar", 257
_OF_TAR = re.compile(r"\.(?:tar|t[bgx]z2?|tar\.(?:gz|bz2|xz))\Z", re.IGNORECASE)
_OF_OTHERS = re.compile(r"\.(?:zip|7z|rar|tzst|tar\.zst)\Z", re.IGNORECASE)
_OF_ARRAYS = re.compile(r"\.npz(?:\.gz)?\Z", re.IGNORECASE)
# what lies beside recordings in an archive, and is none
_BESIDE = re.compile(
    r"(?:^|/)(?:__MACOSX/|\.|desktop\.ini$|thumbs\.db$|(?:read ?me|licen[cs]e)[^/]*$)"
    r"|\.(?:pdf|md|html?|rtf|docx?|png|jpe?g|gif|mp4|avi|mov|fbx|blend)$",
    re.IGNORECASE,
)
_WORKBOOK = "[Content_Types].xml"  # of programs for offices
_LIBRARY = "header.json"  # of a library of primitives
_ENCRYPTED = 1  # flag of a file in a zip archive
_PIECE = 65_536
_AFTER_SLASH = chr(ord("/") + 1)


class ArchiveError(Exception):
    """What a file is that cannot be looked into, and what is expected instead."""

    def __init__(self, found: str, expected: str) -> None:
        super().__init__(found)
        self.found, self.expected = found, expected


class Member(NamedTuple):
    """A file in an archive.

    Attributes:
        packed: Its size there [bytes].
        size: Its size unpacked, as the archive says [bytes].
        older: How many files of its name stand before it: an archive that files are appended to
            keeps what they replace.
    """

    packed: int
    size: int
    older: int = 0


def is_archive(path: Path) -> bool:
    """Whether a file is an archive of files, by its start; one of arrays (npz) is none.

    Example:
        >>> with zipfile.ZipFile("walks.zip", "w") as made:
        ...     made.writestr("slow.bvh", "HIERARCHY")
        >>> is_archive(Path("walks.zip"))
        True
    """
    if _OF_ARRAYS.search(path.name):
        return False
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            start = file.read(_TAR_AT + len(_TAR))
    except (OSError, ValueError):
        return False
    if start.startswith((*_ZIP_STARTS, *_OTHERS)):
        return True
    of_tar = bool(packing(start)) or start[_TAR_AT:] == _TAR
    return of_tar and _OF_TAR.search(path.name) is not None


def named_archive(path: Path) -> bool:
    """Whether a file is called as archives are."""
    return any(named.search(path.name) is not None for named in (_OF_TAR, _OF_OTHERS))


def archive_kind(path: Path) -> str:
    """Return what kind of archive a file is by its name."""
    return "tar" if _OF_TAR.search(path.name) else "zip"


def archive_of(path: Path) -> tuple[Path, str] | None:
    """Return the archive that a path leads into, and the name there; None where it does not."""
    with suppress(OSError, ValueError):  # not to be known, or no name of a file
        if path.exists():
            return None
        at = next(parent for parent in path.parents if parent.exists())
        if at.is_file() and is_archive(at):
            return at, path.relative_to(at).as_posix()
    return None


def members(archive: Path) -> dict[str, Member]:
    """Return the files in an archive, by name.

    Raises:
        ArchiveError: It cannot be looked into, or is something else that is packed so.
    """
    return _of_recordings(archive).files


def recordings_in(archive: Path, folder: str = "") -> tuple[str, ...]:
    """Return the files in an archive, or a folder in it, that may be recordings, in order.

    See `members`.
    """
    names = _of_recordings(archive).recordings
    if not folder:
        return names
    first = bisect_left(names, f"{folder}/")  # those in a folder follow each other
    return names[first : bisect_left(names, f"{folder}{_AFTER_SLASH}")]


def open_member(archive: Path, name: str) -> io.BufferedIOBase:
    """Open a file in an archive; see `members`."""
    return _opened(archive).open(name)


def _of_recordings(path: Path) -> _Archive:
    """Open an archive that is not something else that is packed so; see `members`."""
    archive = _opened(path)
    if _WORKBOOK in archive.files:
        raise ArchiveError("it is a file of an office program", "a table saved as CSV")
    if next(iter(archive.files), "") == _LIBRARY:
        raise ArchiveError(
            "it is a library of primitives, not a recording", "a recording of motion"
        )
    return archive


def _opened(path: Path) -> _Archive:
    try:
        known = path.stat()
        return _open(path.absolute(), known.st_ino, known.st_mtime_ns, known.st_size, os.getpid())
    except DAMAGE as error:
        if isinstance(error, OSError) and error.errno:
            raise ArchiveError(f"cannot be read ({error.strerror})", "a readable file") from error
        raise ArchiveError(f"damaged ({error})", f"a whole {archive_kind(path)} archive") from error


@lru_cache(maxsize=4)
def _open(path: Path, *_: int) -> _Archive:
    """Open an archive once, as long as it is what it was: each process by itself."""
    with path.open("rb") as file:
        start = file.read(STARTS)
    for begins, what in _OTHERS.items():
        if start.startswith(begins):
            raise ArchiveError(
                f"it is {what} archive, not a recording", "the files unpacked, or a zip archive"
            )
    return _Zip(path) if start.startswith(_ZIP_STARTS) else _Tar(path)


class _Archive(ABC):
    """An archive that is open; ``files`` is what is in it, by name."""

    files: dict[str, Member]

    @cached_property
    def recordings(self) -> tuple[str, ...]:
        """What in it may be a recording, in order."""
        return tuple(sorted(name for name in self.files if not _BESIDE.search(name)))

    @abstractmethod
    def open(self, name: str) -> io.BufferedIOBase:
        """Open a file in it."""


class _Zip(_Archive):
    def __init__(self, path: Path) -> None:
        self._file = zipfile.ZipFile(path)
        files = [i for i in self._file.infolist() if i.filename and not i.is_dir()]
        if files and all(info.flag_bits & _ENCRYPTED for info in files):
            raise _encrypted()
        _refuse_endless(path.stat().st_size, (info.file_size for info in files))
        names, times = _Names(), Counter(info.filename for info in files)
        latest = {info.filename: info for info in files}.values()
        self._named = {name: info for info in latest if (name := names.plain(info.filename))}
        self.files = {
            name: Member(info.compress_size, info.file_size, times[info.filename] - 1)
            for name, info in self._named.items()
        }

    def open(self, name: str) -> io.BufferedIOBase:
        info = self._named[name]
        if info.flag_bits & _ENCRYPTED:
            raise _encrypted()
        try:
            return cast("io.BufferedIOBase", self._file.open(info))
        except NotImplementedError as error:
            how = f"it is packed in a way (method {info.compress_type}) that is not read"
            raise ArchiveError(how, "one packed by deflate, as most are") from error


def _encrypted() -> ArchiveError:
    return ArchiveError("it is encrypted", "an archive that needs no password")


class _Tar(_Archive):
    """A tar archive; one that is packed is unpacked as a whole, once, into a nameless file."""

    def __init__(self, path: Path) -> None:
        self._file = _unpacked(path)
        self._lock = Lock()
        latest: dict[str, tuple[int, int]] = {}
        times: Counter[str] = Counter()
        with tarfile.open(fileobj=self._file, mode="r:") as archive:
            before = -1
            while (info := archive.next()) is not None:
                if archive.offset <= before:  # a negative size leads back, again and again
                    raise tarfile.ReadError("a file ends before it begins")
                before = archive.offset
                archive.members = []  # type: ignore[attr-defined] # else it keeps all of them
                if info.isreg() and not info.issparse():
                    latest[info.name] = info.offset_data, info.size
                    times[info.name] += 1
        _refuse_endless(self._file.seek(0, os.SEEK_END), (size for _, size in latest.values()))
        names = _Names()
        called = {name: raw for raw in latest if (name := names.plain(raw))}
        self._at = {name: latest[raw] for name, raw in called.items()}
        self.files = {
            name: Member(self._at[name][1], self._at[name][1], times[raw] - 1)
            for name, raw in called.items()
        }

    def __del__(self) -> None:
        with suppress(AttributeError):  # where it could not be opened
            self._file.close()

    def open(self, name: str) -> io.BufferedIOBase:
        return io.BufferedReader(_Part(self, *self._at[name]))

    def read(self, at: int, n_bytes: int) -> bytes:
        """Return bytes from a place on, whoever else reads others."""
        with self._lock:
            self._file.seek(at)
            return self._file.read(n_bytes)


class _Part(io.RawIOBase):
    """A file in an archive, which stays open as long as this is read."""

    def __init__(self, archive: _Tar, begin: int, size: int) -> None:
        self._archive, self._at, self._end = archive, begin, begin + size

    def readable(self) -> bool:
        return True

    def readinto(self, into: object) -> int:
        view = memoryview(cast("bytearray", into))
        found = self._archive.read(self._at, min(len(view), self._end - self._at))
        view[: len(found)] = found
        self._at += len(found)
        return len(found)


def _unpacked(path: Path) -> IO[bytes]:
    """Return an open tar archive, unpacked where it is packed."""
    file = path.open("rb")
    how = packing(file.read(STARTS))
    file.seek(0)
    if not how:
        return file
    whole = cast("IO[bytes]", tempfile.TemporaryFile())  # noqa: SIM115 (open as long as needed)
    try:
        with file, unpacking(file, how) as unpacked:
            while piece := unpacked.read(_PIECE):
                whole.write(piece)
                _refuse_endless(path.stat().st_size, (whole.tell(),))
    except BaseException:
        whole.close()
        raise
    whole.seek(0)
    return whole


def _refuse_endless(packed: int, sizes: Iterable[int]) -> None:
    limit = most_unpacked(packed)
    if sum(sizes) > limit:
        raise ArchiveError(f"expands to more than {limit} bytes", "recordings of motion")


class _Names:
    """Paths in an archive, each that of one file."""

    def __init__(self) -> None:
        self._times: Counter[str] = Counter()

    def plain(self, name: str) -> str:
        r"""Return the path for a name: ``.\walks\\one.bvh`` -> ``walks/one.bvh``; empty for none.

        Of another file that would have the same it is ``walks/one (2).bvh``.
        """
        parts = PurePosixPath(name.replace("\\", "/")).parts
        plain = "/".join(part for part in parts if part not in ("/", "..", "//"))
        return self._own(plain) if plain else ""

    def _own(self, plain: str) -> str:
        self._times[plain] += 1
        if self._times[plain] == 1:
            return plain
        folder, slash, file = plain.rpartition("/")
        stem, dot, suffixes = file.partition(".")
        return self._own(f"{folder}{slash}{stem} ({self._times[plain]}){dot}{suffixes}")

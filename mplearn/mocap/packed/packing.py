"""How files are packed one by one (gzip, bzip2, xz), and what they may expand to."""

from __future__ import annotations

import bz2
import gzip
import lzma
import struct
import tarfile
import zipfile
import zlib
from io import BufferedIOBase
from typing import IO, cast

MOST_PACKED = 60  # times; tables of measured numbers pack to a half or a tenth
SMALL_BYTES = 4_000_000
"""What a packed file may expand to, however small it is."""

DAMAGE = (
    OSError,
    EOFError,
    zlib.error,
    lzma.LZMAError,
    zipfile.BadZipFile,
    tarfile.TarError,
    RuntimeError,
    ValueError,
    LookupError,
    struct.error,
    OverflowError,  # sizes and places that no file has
    MemoryError,
)
"""What reading of damaged, encrypted or cut off files and archives raises."""

STARTS = 6
"""Bytes at a file's start that tell how it is packed."""

_SUFFIXES = (".gz", ".bz2", ".xz")
_NAMES = {b"\x1f\x8b\x08": "gzip", b"BZh": "bzip2", b"\xfd7zXZ": "xz"}


def most_unpacked(size: int) -> int:
    """Return what a packed file of so many bytes may expand to [bytes]."""
    return max(SMALL_BYTES, MOST_PACKED * size)


def unpacked_name(name: str) -> str:
    """Return a file's name without what tells how it is packed: ``a.bvh.gz`` -> ``a.bvh``."""
    ending = next((each for each in _SUFFIXES if name.lower().endswith(each)), "")
    return name[: len(name) - len(ending)]


def packing(start: bytes) -> str:
    """Return how a file that starts so is packed; empty where it is not.

    Example:
        >>> packing(gzip.compress(b"HIERARCHY")), packing(b"HIERARCHY")
        ('gzip', '')
    """
    return next((name for begins, name in _NAMES.items() if start.startswith(begins)), "")


def unpacking(file: BufferedIOBase, how: str) -> BufferedIOBase:
    """Return what a packed file holds, as a file that is read from its start on."""
    if how == "bzip2":
        return bz2.BZ2File(cast("IO[bytes]", file))
    if how == "xz":
        return lzma.LZMAFile(cast("IO[bytes]", file))
    return gzip.GzipFile(fileobj=file)

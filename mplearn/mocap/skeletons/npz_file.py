"""Arrays of a NumPy archive from anyone: nothing is unpickled, nothing allocated unseen."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.lib import format as npy

from ..files import bad_file, read_bytes

_EXPECTED = "a NumPy archive (.npz) of plain arrays"
_MOST_PACKED = 60  # times; measured numbers pack to a half or so
_SMALL_BYTES = 4_000_000
_DAMAGE = (zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, KeyError, struct.error,
           NotImplementedError, RuntimeError, SyntaxError, TypeError, TokenError,
           OverflowError)  # fmt: skip


class NPZFile:
    """The arrays of an archive, each read when it is asked for.

    Args:
        path: The file, plain or gzipped.

    Raises:
        RecordingError: It is not such an archive.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        data = read_bytes(path)
        self._limit = max(_SMALL_BYTES, _MOST_PACKED * len(data))
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(data))
            members = self._archive.infolist()
        except _DAMAGE as error:
            raise bad_file(path, f"damaged ({error})", _EXPECTED) from error
        self._members = {m.filename.removesuffix(".npy"): m for m in members}

    def __contains__(self, name: str) -> bool:
        """Whether there is an array of this name."""
        return name in self._members

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the arrays."""
        return tuple(self._members)

    def read(self, name: str) -> np.ndarray[Any, np.dtype[Any]]:
        """Return an array of numbers or text.

        Raises:
            RecordingError: It is damaged, of objects, or says to be larger than it is.
        """
        member = self._members[name]
        if member.file_size > self._limit:
            raise bad_file(self.path, f"{name!r} expands to {member.file_size} bytes", _EXPECTED)
        try:
            content = self._archive.read(member)
            stream = io.BytesIO(content)
            version = npy.read_magic(stream)
            read_header = (
                npy.read_array_header_1_0 if version[0] == 1 else npy.read_array_header_2_0
            )
            shape, _, dtype = read_header(stream)
            size = float(np.prod(shape, dtype=np.float64)) * dtype.itemsize
            if dtype.hasobject or size > len(content):
                raise ValueError(f"shape {shape} of {dtype}")
            return npy.read_array(io.BytesIO(content), allow_pickle=False)
        except _DAMAGE as error:
            reason = str(error)[:80]
            raise bad_file(self.path, f"{name!r} cannot be read ({reason})", _EXPECTED) from error

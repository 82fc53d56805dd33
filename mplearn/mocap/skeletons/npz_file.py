"""Arrays of NumPy's files from anyone: nothing is unpickled, nothing allocated unseen."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.lib import format as npy

from ...errors import RecordingError
from ...recording import FloatArray
from ..files import bad_file, head, read_bytes
from ..packed.packing import most_unpacked

RATES = (
    *("mocap_framerate", "mocap_frame_rate", "framerate", "frame_rate", "fps", "mocap_fps"),
    *("sampling_rate", "sample_rate", "rate_hz", "rate"),
)
"""Names of arrays that say the rate [1/s]."""

LENGTHS = ("mocap_time_length", "time_length", "duration", "duration_s")
"""Names of arrays that say how long the take is [s]."""

_USUAL_HZ = (24, 25, 29.97, 30, 50, 59.94, 60, 90, 100, 119.88, 120, 125, 150, 200, 240, 250, 300)
_ROUNDED = 3e-4  # of a length that is said
_EXPECTED = "plain arrays of NumPy (.npy, or .npz)"
_HEADER_BYTES = 1000
_DAMAGE = (zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, KeyError, struct.error,
           NotImplementedError, RuntimeError, SyntaxError, TypeError, TokenError,
           OverflowError)  # fmt: skip


class Arrays(ABC):
    """Arrays by name, of a file.

    Args:
        path: The file, for messages.
        names: Names of the arrays.
    """

    def __init__(self, path: Path, names: Iterable[str]) -> None:
        self.path = path
        self.names = tuple(names)

    @abstractmethod
    def read(self, name: str) -> np.ndarray[Any, np.dtype[Any]]:
        """Return an array of numbers or text.

        Raises:
            RecordingError: It is damaged, of objects, or says to be larger than it is.
        """

    def first_of(self, names: Iterable[str]) -> str | None:
        """Return the first of some names that there is an array of."""
        return next((name for name in names if name in self.names), None)

    def numbers(self, name: str) -> FloatArray:
        """Return an array of finite numbers, or NaN.

        Raises:
            RecordingError: It holds something else.
        """
        return finite(self.path, name, self.read(name))

    def rate_hz(self, n_frames: int) -> float | None:
        """Return the rate that an array says [1/s]; None where there is none of its names.

        Where only the length of the take is said it is that of so many frames in it: a usual rate,
        if there is one between counting to the last frame and to the end of it.

        Raises:
            RecordingError: It is no rate, or no length.
        """
        name = self.first_of(RATES)
        if name is not None:
            return self._positive(name, "frames a second")
        name = self.first_of(LENGTHS)
        if name is None or n_frames < 2:
            return None
        length_s = self._positive(name, "seconds")
        low, high = (n_frames - 1) / length_s, n_frames / length_s
        usual = [hz for hz in _USUAL_HZ if low * (1 - _ROUNDED) <= hz <= high * (1 + _ROUNDED)]
        return max(usual, default=high)

    def _positive(self, name: str, expected: str) -> float:
        """Return the number that an array holds."""
        value = self.read(name)
        try:
            number = float(value.item())  # or as text
        except (ValueError, TypeError):
            number = np.nan
        if not 0 < number < 1e6:
            raise bad_file(self.path, f"{name} is {value.tolist()}"[:80], expected)
        return number


class HeldArrays(Arrays):
    """Arrays that are there already, as parts of another one.

    Args:
        path: The file, for messages.
        arrays: The arrays by name.
    """

    def __init__(self, path: Path, arrays: Mapping[str, FloatArray]) -> None:
        super().__init__(path, arrays)
        self._arrays = arrays

    def read(self, name: str) -> FloatArray:
        """Return an array; see `Arrays.read`."""
        return self._arrays[name]


class NPZFile(Arrays):
    """The arrays of an archive, each read when it is asked for.

    Args:
        path: The file, plain or gzipped.

    Raises:
        RecordingError: It is not such an archive.
    """

    def __init__(self, path: Path) -> None:
        data = read_bytes(path)
        self._limit = most_unpacked(len(data))
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(data))
            members = self._archive.infolist()
        except _DAMAGE as error:
            raise bad_file(path, f"damaged ({error})", _EXPECTED) from error
        self._members = {m.filename.removesuffix(".npy"): m for m in members}
        super().__init__(path, self._members)

    def read(self, name: str) -> np.ndarray[Any, np.dtype[Any]]:
        """Return an array; see `Arrays.read`."""
        member = self._members[name]
        if member.file_size > self._limit:
            raise bad_file(self.path, f"{name!r} expands to {member.file_size} bytes", _EXPECTED)
        try:
            content = self._archive.read(member)
        except _DAMAGE as error:
            raise _unreadable(self.path, repr(name), error) from error
        return _array(self.path, content, repr(name))

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the shape that an array says it has; empty where it is damaged."""
        try:
            with self._archive.open(self._members[name]) as stream:
                return _header(io.BytesIO(stream.read(_HEADER_BYTES)))[0]
        except _DAMAGE:
            return ()


def npy_shape(path: Path) -> tuple[int, ...]:
    """Return the shape that an ``.npy`` file says at its start; empty where it is none."""
    try:
        shape, _, _ = _header(io.BytesIO(head(path)))
    except _DAMAGE:
        return ()
    return shape


def read_npy(path: Path) -> np.ndarray[Any, np.dtype[Any]]:
    """Return the array of an ``.npy`` file, plain or gzipped.

    Raises:
        RecordingError: It is damaged, or of objects.
    """
    return _array(path, read_bytes(path), "the array")


def finite(path: Path, name: str, array: np.ndarray[Any, np.dtype[Any]]) -> FloatArray:
    """Return an array as numbers, if it holds finite ones, or NaN.

    Raises:
        RecordingError: It holds something else.
    """
    if array.dtype.kind not in "fiu":
        raise bad_file(path, f"{name} of {array.dtype}", "numbers")
    values: FloatArray = np.asarray(array, dtype=np.float64)
    if np.isinf(values).any():
        raise bad_file(path, f"{name} holds infinite values", "finite numbers")
    return values


def _array(path: Path, content: bytes, name: str) -> np.ndarray[Any, np.dtype[Any]]:
    try:
        shape, _, dtype = _header(io.BytesIO(content))
        size = float(np.prod(shape, dtype=np.float64)) * dtype.itemsize
        if dtype.hasobject or size > len(content):
            raise ValueError(f"shape {shape} of {dtype}")
        return npy.read_array(io.BytesIO(content), allow_pickle=False)
    except _DAMAGE as error:
        raise _unreadable(path, name, error) from error


def _header(stream: io.BytesIO) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return shape, order and type of an array, as NumPy writes them before it."""
    version = npy.read_magic(stream)
    read_header = npy.read_array_header_1_0 if version[0] == 1 else npy.read_array_header_2_0
    return read_header(stream)


def _unreadable(path: Path, name: str, error: Exception) -> RecordingError:
    return bad_file(path, f"{name} cannot be read ({str(error)[:80]})", _EXPECTED)

"""The chunks of an XDF file, as LabRecorder writes them [XDF].

Read here and not with pyxdf, which is the oracle of the tests: a damaged file must neither take the
process down nor its memory. Streams of text are passed over.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...recording import FloatArray
from ..files import bad_file

_EXPECTED = "a whole XDF file"
_FORMATS = {
    "float32": "<f4",
    "double64": "<f8",
    "int8": "<i1",
    "int16": "<i2",
    "int32": "<i4",
    "int64": "<i8",
}
_MOST_CHANNELS = 100_000


@dataclass(eq=False)
class Stream:
    """A stream of numbers.

    Attributes:
        info: Its header.
        dtype: Type of its values.
        n_channels: How many values a sample has.
        rate_hz: Its nominal rate [1/s]; 0 for none.
        times: Time stamp of each sample [s]; where the file leaves it out, one step on. Doubles.
        raw: The samples' values, as bytes.
    """

    info: ElementTree.Element
    dtype: np.dtype[np.generic]
    n_channels: int
    rate_hz: float
    times: array[float] = field(default_factory=lambda: array("d"))
    raw: bytearray = field(default_factory=bytearray)

    @property
    def name(self) -> str:
        """Name of the stream."""
        return self.info.findtext("name", "").strip()

    def values(self, channels: Sequence[int]) -> FloatArray:
        """Return some channels of the samples, shape (T, len(channels))."""
        flat = np.frombuffer(self.raw, self.dtype)
        return flat.reshape(-1, self.n_channels)[:, channels].astype(np.float64)


def parse_xdf(path: Path, data: bytes) -> tuple[list[Stream], bool]:
    """Return the streams of numbers of a file, and whether its end is cut off.

    Raises:
        RecordingError: It is no XDF file, or is damaged.
    """
    if data[:4] != b"XDF:":
        raise bad_file(path, f"starts with {data[:4]!r}", _EXPECTED)
    streams: dict[int, Stream] = {}
    at = 4
    while at < len(data):
        length, begin = _length(path, data, at)
        end = begin + length
        if end > len(data):
            return list(streams.values()), True
        if length < 2:
            raise bad_file(path, f"a chunk of {length} bytes at byte {at}", _EXPECTED)
        (tag,) = struct.unpack_from("<H", data, begin)
        if tag == 2:
            _open_stream(path, data[begin + 2 : end], streams)
        elif tag == 3 and length >= 6:
            (number,) = struct.unpack_from("<I", data, begin + 2)
            if number in streams:
                _take_samples(path, data, begin + 6, end, streams[number])
        at = end
    return list(streams.values()), False


def _length(path: Path, data: bytes, at: int) -> tuple[int, int]:
    """Return a length of varying width, and where what it measures begins."""
    width = data[at]
    if width not in (1, 4, 8):
        raise bad_file(path, f"a length of {width} bytes at byte {at}", _EXPECTED)
    return int.from_bytes(data[at + 1 : at + 1 + width], "little"), at + 1 + width


def _open_stream(path: Path, chunk: bytes, streams: dict[int, Stream]) -> None:
    number = int.from_bytes(chunk[:4], "little")
    if b"<!" in chunk:  # no writer has declarations; entities can grow without end
        raise bad_file(path, "a stream's header with a declaration", _EXPECTED)
    try:
        info = ElementTree.fromstring(chunk[4:])
        n_channels = int(float(info.findtext("channel_count", "")))
        rate_hz = float(info.findtext("nominal_srate", "0"))
    except (ElementTree.ParseError, ValueError, OverflowError) as error:
        raise bad_file(path, f"a damaged header of a stream ({error})", _EXPECTED) from error
    format = _FORMATS.get(info.findtext("channel_format", "").strip())
    if format is not None and 0 < n_channels <= _MOST_CHANNELS:
        rate_hz = rate_hz if 0 < rate_hz < np.inf else 0.0
        streams[number] = Stream(info, np.dtype(format), n_channels, rate_hz)


def _take_samples(path: Path, data: bytes, at: int, end: int, stream: Stream) -> None:
    size = stream.n_channels * stream.dtype.itemsize
    step_s = 1.0 / stream.rate_hz if stream.rate_hz else 0.0
    count, at = _length(path, data, at)
    for _ in range(count):
        if at >= end:
            raise bad_file(path, f"{count} samples in a chunk that ends at byte {end}", _EXPECTED)
        stamped = data[at]
        at += 1
        if stamped == 8 and at + 8 <= end:
            (time_s,) = struct.unpack_from("<d", data, at)
            at += 8
        elif stamped == 0:
            time_s = stream.times[-1] + step_s if stream.times else 0.0
        else:
            raise bad_file(path, f"a time stamp of {stamped} bytes at byte {at}", _EXPECTED)
        if at + size > end:
            raise bad_file(path, f"a sample cut off at byte {end}", _EXPECTED)
        stream.times.append(time_s)
        stream.raw += data[at : at + size]
        at += size

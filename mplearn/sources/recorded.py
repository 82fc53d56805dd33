"""A stream kept as a file while it is read: XDF, which LabRecorder's readers know [XDF]."""

from __future__ import annotations

import struct
import time
from pathlib import Path
from typing import BinaryIO
from xml.sax.saxutils import escape

import numpy as np

from ..errors import InvalidValueError
from ..mocap import UNITS_M
from .source import Block, Change, Source, Stream

FLUSH_S = 1.0  # so much is lost at most when the process is killed
_FILE, _STREAM, _SAMPLES, _END = 1, 2, 3, 6


class RecordedSource(Source):
    """A source that is written to an XDF file as it comes: its own names, axes and unit.

    A frame that never came is written as missing measurements; a stream that is described otherwise
    becomes another stream of the file. Frames are stamped with this machine's clock at the start,
    and evenly from there.

    Args:
        source: The stream.
        path: The file; one that is there is replaced.

    Raises:
        InvalidValueError: The file is not named ``.xdf``.
        OSError: It cannot be written.
    """

    def __init__(self, source: Source, path: Path) -> None:
        if path.suffix.lower() != ".xdf":
            raise InvalidValueError(f"a stream is kept as a file named .xdf, not {path.name!r}")
        self.name, self.tally = source.name, source.tally
        self._source = source
        self._file: BinaryIO | None = path.open("wb")
        head = b"<?xml version='1.0'?><info><version>1.0</version></info>"
        self._file.write(b"XDF:" + chunk(_FILE, head))
        self._start_s, self._flushed_s = time.time(), time.monotonic()
        self._stream: Stream | None = None
        self._number, self._count = 0, 0
        self._span = (0.0, 0.0)  # time stamps of the stream's first and last frame

    @property
    def ended(self) -> bool:
        """Whether nothing more will come."""
        return self._source.ended

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        """Return what came, and write it; see `Source.read`."""
        items = self._source.read(timeout_s)
        if self._file is not None:
            for item in items:
                if isinstance(item, Block):
                    self._write(self._file, item)
            if time.monotonic() - self._flushed_s > FLUSH_S:
                self._file.flush()
                self._flushed_s = time.monotonic()
            if self._source.ended:
                self._finish()
        return items

    def close(self) -> None:
        """End the stream, and the file."""
        self._source.close()
        self._finish()

    # ---- inside

    def _write(self, file: BinaryIO, block: Block) -> None:
        if block.stream is not self._stream:
            self._end_stream(file)
            self._stream = block.stream
            self._number, self._count = self._number + 1, 0
            self._span = (self._start_s + float(block.times_s[0]),) * 2
            header = struct.pack("<I", self._number) + described(self.name, block.stream)
            file.write(chunk(_STREAM, header))
        width = (block.frames.shape[1],)
        rows = np.zeros(len(block), [("size", "u1"), ("time", "<f8"), ("row", "<f8", width)])
        rows["size"], rows["time"], rows["row"] = 8, self._start_s + block.times_s, block.frames
        count = b"\x04" + struct.pack("<I", len(block))
        file.write(chunk(_SAMPLES, struct.pack("<I", self._number) + count + rows.tobytes()))
        self._count += len(block)
        self._span = self._span[0], float(rows["time"][-1])

    def _end_stream(self, file: BinaryIO) -> None:
        if self._stream is None:
            return
        first, last = self._span
        text = (
            f"<?xml version='1.0'?><info><first_timestamp>{first!r}</first_timestamp>"
            f"<last_timestamp>{last!r}</last_timestamp><sample_count>{self._count}</sample_count>"
            "</info>"
        )
        file.write(chunk(_END, struct.pack("<I", self._number) + text.encode()))
        self._stream = None

    def _finish(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            with file:
                self._end_stream(file)


def chunk(tag: int, content: bytes) -> bytes:
    """Return a chunk of an XDF file."""
    return b"\x04" + struct.pack("<IH", len(content) + 2, tag) + content


def described(name: str, stream: Stream) -> bytes:
    """Return the description of a stream, by the layer's conventions for motion capture."""
    unit = next((each for each, m in UNITS_M.items() if m == stream.unit_m), "")
    channels = []
    for label in stream.channels:
        kind = ""
        if stream.is_markers:
            kind = f"<marker>{_text(label[:-2])}</marker><type>Position{label[-1].upper()}</type>"
            kind += f"<unit>{unit}</unit>" if unit else ""
        channels.append(f"<channel><label>{_text(label)}</label>{kind}</channel>")
    return (
        f"<?xml version='1.0'?><info><name>{_text(name)}</name><type>MoCap</type>"
        f"<channel_count>{len(stream.channels)}</channel_count>"
        f"<nominal_srate>{stream.rate_hz!r}</nominal_srate>"
        "<channel_format>double64</channel_format>"
        f"<desc><subject><id>{_text(stream.subject)}</id></subject>"
        f"<channels>{''.join(channels)}</channels></desc></info>"
    ).encode()


def _text(name: str) -> str:
    return escape("".join(c if c.isprintable() else " " for c in name))

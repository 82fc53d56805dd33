"""Our own format: JSON, an object a line; over TCP, a pipe, or UDP with a line or more a datagram.

A *header* says what a stream holds, a *frame* what was measured; see the how-to on live sources.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from ...mocap import DIRECTIONS, named_unit
from ...recording import FloatArray, Skeleton, marker_channels
from ..inbox import Sample
from ..source import Stream

VERSION = 1
MOST_STREAMS, MOST_CHANNELS = 64, 100_000
_KINDS = ("markers", "joints", "channels")


def header_line(stream: Stream, number: int = 0) -> bytes:
    """Return the header of a stream, with its end of line.

    Args:
        stream: What it holds.
        number: Which of several streams it is, as its frames say it.
    """
    header: dict[str, Any] = {"mplearn": VERSION, "stream": number}
    if stream.rate_hz:
        header["rate_hz"] = stream.rate_hz
    if stream.skeleton is not None:
        header["joints"] = list(stream.skeleton.names)
        header["parents"] = list(stream.skeleton.parents)
        header["offsets"] = stream.skeleton.offsets.tolist()
        header["ends"] = [i for i, is_end in enumerate(stream.skeleton.ends) if is_end]
    elif stream.is_markers:
        header["markers"] = list(stream.points)
    else:
        header["channels"] = list(stream.channels)
    if stream.unit_m is not None:
        header["unit_m"] = stream.unit_m
    said = {"up": stream.up, "subject": stream.subject}
    header |= {key: value for key, value in said.items() if value}
    return json.dumps(header).encode() + b"\n"


def frame_line(
    values: FloatArray,
    number: int | None = None,
    time_s: float | None = None,
    stream: int = 0,
) -> bytes:
    """Return a frame, shape (D,), with its end of line; NaN is written as null."""
    frame: dict[str, Any] = {"stream": stream} if stream else {}
    if number is not None:
        frame["n"] = number
    if time_s is not None:
        frame["t"] = time_s
    frame["v"] = [None if math.isnan(value) else value for value in values.tolist()]
    return json.dumps(frame).encode() + b"\n"


class LineParser:
    """Reads lines of one sender."""

    def __init__(self) -> None:
        self._streams: dict[int, tuple[bytes, Stream]] = {}

    def parse(self, line: bytes, arrived_s: float) -> Sample | Stream | None:
        """Return the frame of a line, or what its header says; None for a blank line.

        Raises:
            ValueError: The line is neither, or a frame without a header before it (`UnnamedError`).
        """
        if not line.strip():
            return None
        try:
            read = json.loads(line)
        except RecursionError:
            raise ValueError("not JSON that a stream has") from None
        if not isinstance(read, dict):
            raise ValueError(f"a line is a JSON object, not {line[:40]!r}")
        number = read.get("stream", 0)
        if not isinstance(number, int) or isinstance(number, bool):
            raise ValueError(f"stream must be an integer, not {number!r:.40}")
        if "mplearn" in read:
            return self._header(line, read, number)
        known = self._streams.get(number)
        if known is None:
            raise UnnamedError(f"a frame of stream {number}, of which no header came yet")
        return Sample(
            known[1], _values(read.get("v")), arrived_s, _integer(read.get("n")), _time(read)
        )

    def _header(self, line: bytes, read: dict[str, Any], number: int) -> Stream:
        if read["mplearn"] != VERSION:
            raise ValueError(f"mplearn must be {VERSION}, not {read['mplearn']!r:.40}")
        known = self._streams.get(number)
        if known is not None and known[0] == line:
            return known[1]
        if known is None and len(self._streams) >= MOST_STREAMS:
            raise ValueError(f"more than {MOST_STREAMS} streams")
        stream = _stream(read)
        self._streams[number] = (line, stream)
        return stream


class UnnamedError(ValueError):
    """A frame came before it was said what it holds."""


def _stream(header: dict[str, Any]) -> Stream:
    kinds = [kind for kind in _KINDS if kind in header]
    if len(kinds) != 1:
        raise ValueError(f"a header has one of {', '.join(_KINDS)}")
    names = header[kinds[0]]
    if not (isinstance(names, list) and names and all(isinstance(name, str) for name in names)):
        raise ValueError(f"{kinds[0]} must be a list of names")
    if len(names) > MOST_CHANNELS:
        raise ValueError(f"more than {MOST_CHANNELS} {kinds[0]}")
    skeleton = None
    if kinds[0] == "joints":
        ends = set(header.get("ends", []))
        skeleton = Skeleton(
            tuple(names),
            tuple(int(parent) for parent in header["parents"]),
            np.array(header["offsets"], dtype=np.float64),
            tuple(i in ends for i in range(len(names))),
        )
    rate_hz = header.get("rate_hz", 0.0)
    if not (_is_number(rate_hz) and 0.0 <= rate_hz <= 10_000.0):
        raise ValueError(f"rate_hz must lie in [1, 10000], not {rate_hz!r:.40}")
    unit = header.get("unit_m", header.get("unit"))
    unit_m: float | None = named_unit(unit) if isinstance(unit, str) else unit
    fine = unit_m is not None and _is_number(unit_m) and 0.0 < unit_m < 1e6
    if unit is not None and not fine:
        raise ValueError(f"unit_m must be a length [m], unit a name such as 'mm', not {unit!r:.40}")
    up, subject = header.get("up", ""), header.get("subject", "")
    if up and up not in DIRECTIONS:
        raise ValueError(f"up must be one of {', '.join(DIRECTIONS)}, not {up!r:.40}")
    if not isinstance(subject, str):
        raise ValueError(f"subject must be a name, not {subject!r:.40}")
    channels = tuple(names) if kinds[0] == "channels" else marker_channels(tuple(names))
    return Stream(channels, float(rate_hz), skeleton, unit_m, up, subject)


def _values(values: Any) -> FloatArray:
    if not isinstance(values, list):
        raise ValueError("a frame has values v: a list of numbers")
    try:
        row = np.array(values, dtype=np.float64)
    except (TypeError, OverflowError) as error:
        raise ValueError(f"v must be a list of numbers: {error}") from None
    if row.ndim != 1:
        raise ValueError("v must be a list of numbers, without lists in it")
    row[np.isinf(row)] = np.nan
    return row


def _integer(number: Any) -> int | None:
    if number is not None and (not isinstance(number, int) or isinstance(number, bool)):
        raise ValueError(f"n must be an integer, not {number!r:.40}")
    return number


def _time(frame: dict[str, Any]) -> float | None:
    time_s = frame.get("t")
    if time_s is None:
        return None
    if not (_is_number(time_s) and abs(time_s) < math.inf):
        raise ValueError(f"t must be seconds, not {time_s!r:.40}")
    return float(time_s)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)

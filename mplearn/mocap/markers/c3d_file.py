"""The bytes of a C3D file: a header, a chain of parameter records, and the frames [C3D].

Everything is checked against the file's size before it is believed: a damaged file must not take
the process down, as it does about one time in a hundred with ezc3d, which reads the same and is the
oracle of the tests.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from math import prod
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ...recording import FloatArray
from ..files import bad_file

Parameters: TypeAlias = dict[str, dict[str, "list[str] | FloatArray"]]

_BLOCK = 512
_DEC = 85
_BYTE_ORDER = {84: "<", _DEC: "<", 86: ">"}  # PC, DEC, SGI
_INTEGERS = {1: "i1", 2: "i2"}
_EXPECTED = "a whole C3D file"
_POSE = 17  # numbers of a pose
_SQUARE = 0.02  # by which a turn is off a rotation, at most


@dataclass(frozen=True, eq=False)
class C3DContent:
    """What a C3D file holds.

    Attributes:
        points: Positions, shape (T, M, 3), in the file's unit and axes; NaN where not measured.
        parameters: Texts or numbers, by group and name, in upper case.
        rate_hz: Frames per second after the header [1/s].
        said_frames: How many frames the file says that it holds, if that is not what it holds.
        unmeasured: Whether no point is said to be measured, and all are there nevertheless.
        poses: How segments lie, as Theia writes them where there are no points, shape (T, S, 4, 4);
            NaN where not seen.
    """

    points: FloatArray
    parameters: Parameters
    rate_hz: float
    said_frames: int | None = None
    unmeasured: bool = False
    poses: FloatArray | None = None

    def texts(self, group: str, name: str) -> list[str]:
        """Return a parameter's texts; none where it is missing or holds numbers."""
        value = self.parameters.get(group, {}).get(name, [])
        return value if isinstance(value, list) else []

    def numbers(self, group: str, name: str) -> FloatArray:
        """Return a parameter's numbers; none where it is missing or holds texts."""
        value = self.parameters.get(group, {}).get(name, [])
        return np.empty(0) if isinstance(value, list) else value


def parse_c3d(path: Path, data: bytes) -> C3DContent:
    """Parse a C3D file, with reals or integers, written on a PC, a DEC or an SGI machine.

    Args:
        path: The file, for messages.
        data: Its content.

    Raises:
        RecordingError: It is no C3D file, is damaged, or holds no points or no whole frame.
    """
    if len(data) < 2 * _BLOCK or data[1] != 0x50:
        raise bad_file(path, "no C3D header", _EXPECTED)
    at = (data[0] - 1) * _BLOCK
    if at < _BLOCK or at + 4 > len(data):
        raise bad_file(path, f"its parameters should start at byte {at}", _EXPECTED)
    processor = data[at + 3]
    if processor not in _BYTE_ORDER:
        raise bad_file(path, f"processor type {processor}", "84, 85 or 86")
    order = _BYTE_ORDER[processor]
    n_points, n_analog, first, last = struct.unpack_from(order + "4H", data, 2)
    (start,) = struct.unpack_from(order + "H", data, 16)
    scale, rate_hz = (float(_reals(data[i : i + 4], processor)[0]) for i in (12, 20))
    begin = (start - 1) * _BLOCK
    n_blocks = data[at + 2]
    stop = min(len(data), at + n_blocks * _BLOCK if n_blocks else max(begin, 0))
    content = C3DContent(
        np.empty((0, 0, 3)), _parameters(path, data, at + 4, stop, processor), rate_hz
    )
    if n_points == 0:
        return _with_poses(path, data, content, last - first + 1, processor)
    if start < 2 or not np.isfinite(scale) or scale == 0.0:
        raise bad_file(path, f"frames at block {start}, scale {scale}", _EXPECTED)
    width, real = 4 * n_points + n_analog, scale < 0.0
    n_bytes = width * (4 if real else 2)
    n_used = len(data.rstrip(b"\0")) - begin
    said, n_frames = _frame_count(content, last - first + 1, n_bytes, len(data) - begin, n_used)
    if n_frames < 1:
        raise bad_file(
            path, f"{said} frames, {len(data)} of {begin + said * n_bytes} bytes", _EXPECTED
        )
    raw = data[begin : begin + n_frames * n_bytes]
    values = _reals(raw, processor) if real else np.frombuffer(raw, order + "i2")
    table = values.reshape(n_frames, width)[:, : 4 * n_points].reshape(n_frames, n_points, 4)
    points = table[:, :, :3].astype(np.float64) * (1.0 if real else scale)
    nowhere = ~np.isfinite(table).all(axis=2) | (points == 0.0).all(axis=2)
    gone = nowhere | (table[:, :, 3] < 0)
    unmeasured = bool(gone.all() and not nowhere.all())
    points[nowhere if unmeasured else gone] = np.nan
    return C3DContent(
        points, content.parameters, rate_hz, None if said == n_frames else said, unmeasured
    )


def _with_poses(
    path: Path, data: bytes, content: C3DContent, in_header: int, processor: int
) -> C3DContent:
    """Return a content without points with the poses of its segments.

    They are matrices, column by column, and how sure each is; as many as `ROTATION:RATIO` says to
    a frame.
    """
    start, used, ratio = (
        int(value[0]) if len(value := content.numbers("ROTATION", name)) else default
        for name, default in (("DATA_START", 0), ("USED", 0), ("RATIO", 1))
    )
    begin, n_segments, ratio = (start % 65536 - 1) * _BLOCK, used % 65536, max(ratio, 1)
    if begin < 2 * _BLOCK or not n_segments:
        raise bad_file(path, "it holds no points", "a C3D file with markers, or poses of segments")
    n_bytes = 4 * _POSE * n_segments * ratio
    n_used = len(data.rstrip(b"\0")) - begin
    said, n_frames = _frame_count(content, in_header, n_bytes, len(data) - begin, n_used)
    if n_frames < 1:
        raise bad_file(
            path, f"{said} frames, {len(data)} of {begin + said * n_bytes} bytes", _EXPECTED
        )
    values = _reals(data[begin : begin + n_frames * n_bytes], processor)
    table = values.reshape(n_frames * ratio, n_segments, _POSE)
    poses = table[..., : _POSE - 1].reshape(*table.shape[:2], 4, 4).swapaxes(-1, -2).copy()
    turns = poses[..., :3, :3]
    square = np.abs(turns.swapaxes(-1, -2) @ turns - np.eye(3)).max(axis=(-1, -2)) < _SQUARE
    poses[~(square & np.isfinite(poses).all(axis=(-1, -2)))] = np.nan
    rates = content.numbers("ROTATION", "RATE")
    return replace(
        content,
        points=np.empty((len(poses), 0, 3)),
        poses=poses,
        rate_hz=float(rates[0]) if len(rates) and rates[0] > 0 else content.rate_hz * ratio,
        said_frames=None if said == n_frames else said,
    )


def _parameters(path: Path, data: bytes, at: int, stop: int, processor: int) -> Parameters:
    """Walk the chain of records up to the end of their blocks.

    Groups have negative numbers, parameters their group's.
    """
    order = _BYTE_ORDER[processor]
    groups: dict[int, str] = {}
    found: dict[int, dict[str, list[str] | FloatArray]] = {}
    while at + 2 <= stop:
        name_length, number = struct.unpack_from("bb", data, at)
        if name_length == 0:
            break
        link = at + 2 + abs(name_length)  # the next record is named relative to here
        if link + 4 > len(data):
            raise bad_file(path, f"parameters cut off at byte {len(data)}", _EXPECTED)
        (step,) = struct.unpack_from(order + "h", data, link)
        end = link + step if step else len(data)
        name = data[at + 2 : link].decode("latin-1").strip().upper()
        if number > 0:
            kind, n_dimensions = struct.unpack_from("bB", data, link + 2)
            sizes = tuple(data[link + 4 : link + 4 + n_dimensions])
            begin = link + 4 + n_dimensions
            used = begin + prod(sizes) * abs(kind)
            if end < used:  # some SGI files have the last offset in a PC's order
                end = link + int.from_bytes(step.to_bytes(2, "big", signed=True), "little")
            if kind not in (-1, 1, 2, 4) or n_dimensions > 7 or used > min(end, len(data)):
                raise bad_file(path, f"a damaged parameter {name!r} at byte {at}", _EXPECTED)
            found.setdefault(number, {})[name] = _value(data[begin:used], kind, sizes, processor)
        else:
            groups[-number] = name
        if end <= link:
            raise bad_file(path, f"a parameter {name!r} at byte {at} that leads back", _EXPECTED)
        at = end
    return {name: found.get(number, {}) for number, name in groups.items()}


def _value(raw: bytes, kind: int, sizes: tuple[int, ...], processor: int) -> list[str] | FloatArray:
    if kind == -1:
        length = sizes[0] if sizes else 1
        texts = [raw[i : i + length] for i in range(0, len(raw), length)] if length else []
        return [text.decode("latin-1").replace("\0", "").strip() for text in texts]
    if kind == 4:
        return _reals(raw, processor)
    return np.frombuffer(raw, _BYTE_ORDER[processor] + _INTEGERS[kind]).astype(np.float64)


def _reals(raw: bytes, processor: int) -> FloatArray:
    """Return the reals in some bytes; a DEC's have their halves exchanged and count in quarters."""
    if processor == _DEC:
        halves = np.frombuffer(raw, "<u2").reshape(-1, 2)[:, ::-1]
        return np.ascontiguousarray(halves).view("<f4")[:, 0].astype(np.float64) / 4.0
    return np.frombuffer(raw, _BYTE_ORDER[processor] + "f4").astype(np.float64)


def _frame_count(
    content: C3DContent, in_header: int, n_bytes: int, n_there: int, n_used: int
) -> tuple[int, int]:
    """Return how many frames the file says it holds, and how many to read.

    The header's 16 bits do not hold numbers from 65,536 on; of what other places say, that counts
    which fills the file to its last block. Where none says more than 16 bits hold, all that is
    there may be frames.
    """
    ends = [content.numbers("TRIAL", f"ACTUAL_{end}_FIELD") for end in ("START", "END")]
    counts = [int(count) for count in content.numbers("POINT", "LONG_FRAMES")[:1] if count > 0]
    if all(len(words) == 2 for words in ends):
        first, last = (low % 65536 + 65536 * (high % 65536) for low, high in ends)
        counts.append(int(last - first) + 1)
    counts += [int(count) % 65536 for count in content.numbers("POINT", "FRAMES")[:1]]
    if in_header == 65535 and n_bytes > 0:
        counts.append(-(-n_used // n_bytes))
    counts = [count for count in (*counts, in_header) if 0 < count < 2**32]
    if n_bytes <= 0 or not counts:
        return max(in_header, 0), 0
    filling = [n for n in counts if n * n_bytes <= n_there < n * n_bytes + _BLOCK]
    fitting = [n for n in counts if n * n_bytes <= n_there]
    if filling or fitting:
        # with data behind the frames nothing fills the file: the header is right if it can be
        said = filling[0] if filling else max(fitting)
        return said, said
    return min(counts), max(n_there, 0) // n_bytes

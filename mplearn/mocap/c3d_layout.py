"""A look at a C3D file's bones before a parser in C++ trusts them.

The file is blocks of 512 bytes: a header, a chain of parameter records, and the frames. A damaged
count there would make a parser read beyond the file or ask for all the memory there is.
"""

from __future__ import annotations

import struct
from math import prod
from pathlib import Path

from .files import bad_file

_BLOCK = 512
_EXPECTED = "a whole C3D file"
_ITEM_BYTES = (-1, 1, 2, 4)  # text, byte, integer, real
_BYTE_ORDER = {84: "<", 85: "<", 86: ">"}  # PC, DEC (its reals differ, its integers do not), SGI


def check_layout(path: Path, data: bytes) -> None:
    """Check that header, parameters and frames lie inside the file.

    Args:
        path: The file, for messages.
        data: Its content.

    Raises:
        RecordingError: It is no C3D file, is cut off, or holds no points.
    """
    if len(data) < 2 * _BLOCK or data[1] != 0x50:
        raise bad_file(path, "no C3D header", _EXPECTED)
    parameters = (data[0] - 1) * _BLOCK
    if parameters < _BLOCK or parameters + 4 > len(data):
        raise bad_file(path, f"its parameters should start at byte {parameters}", _EXPECTED)
    order = _BYTE_ORDER.get(data[parameters + 3])
    if order is None:
        raise bad_file(path, f"processor type {data[parameters + 3]}", "84, 85 or 86")
    n_points, n_analog, first, last = struct.unpack_from(order + "4H", data, 2)
    (scale,) = struct.unpack_from(order + "f", data, 12)
    (start,) = struct.unpack_from(order + "H", data, 16)
    if n_points == 0:
        raise bad_file(path, "it holds no points", "a C3D file with markers")
    frame_bytes = (4 * n_points + n_analog) * (4 if scale < 0 else 2)
    end = (start - 1) * _BLOCK + (last - first + 1) * frame_bytes
    if start < 2 or (last >= first and end > len(data)):
        raise bad_file(path, f"cut off at byte {len(data)} of {end}", _EXPECTED)
    _check_parameters(path, data, parameters + 4, order)


def _check_parameters(path: Path, data: bytes, at: int, order: str) -> None:
    """Walk the chain of records: groups have negative numbers, parameters their group's."""
    groups: set[int] = set()
    owners: set[int] = set()
    while at + 2 <= len(data):
        name_length, number = struct.unpack_from("bb", data, at)
        if name_length == 0:
            break
        link = at + 2 + abs(name_length)  # the next record is named relative to here
        if link + 4 > len(data):
            raise bad_file(path, f"parameters cut off at byte {len(data)}", _EXPECTED)
        (step,) = struct.unpack_from(order + "h", data, link)
        used = link + 2
        if number > 0:
            owners.add(number)
            kind, n_dimensions = struct.unpack_from("bB", data, used)
            count = prod(data[used + 2 : used + 2 + n_dimensions])
            used += 2 + n_dimensions + count * abs(kind)
            if kind not in _ITEM_BYTES or n_dimensions > 7:
                raise bad_file(path, f"a damaged parameter at byte {at}", _EXPECTED)
        elif number == 0 or -number in groups:
            raise bad_file(path, f"group {-number} twice or without a number", _EXPECTED)
        else:
            groups.add(-number)
        end = link + step if step else len(data)
        if used >= end or used + 1 + data[used] > end:  # a description of so many letters follows
            raise bad_file(path, f"a damaged record at byte {at}", _EXPECTED)
        at = end
    if not owners <= groups:
        raise bad_file(
            path, f"parameters of group {min(owners - groups)}, which is not there", _EXPECTED
        )

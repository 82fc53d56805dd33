"""The container of glTF 2.0 [glTF]: a JSON document and a binary buffer in one file.

`Document` gathers numbers into the buffer as accessors; `read_glb` opens a file, and `numbers`
takes those of an accessor out of it.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from mplearn.errors import RecordingError
from mplearn.recording import FloatArray, IntArray

_MAGIC, _VERSION = 0x46546C67, 2
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_FLOAT, _UNSIGNED = 5126, 5125
_TYPES = {
    5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", _UNSIGNED: "<u4", _FLOAT: "<f4",
}  # fmt: skip
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
VERTICES, CORNERS = 34962, 34963  # what a buffer view is for: places of corners, faces by corners


class Document:
    """A glTF document that is being written.

    Attributes:
        content: All of it but buffer, views and accessors, by the names of the format.
    """

    def __init__(self) -> None:
        self.content: dict[str, Any] = {"asset": {"version": "2.0", "generator": "mplearn"}}
        self._views: list[dict[str, int]] = []
        self._accessors: list[dict[str, Any]] = []
        self._data = bytearray()

    def add(self, values: FloatArray | IntArray, target: int | None = None) -> int:
        """Add numbers, shape (N,) or (N, K), as floats, or as whole numbers for `CORNERS`.

        Returns:
            The index of their accessor.
        """
        kind = _UNSIGNED if target == CORNERS else _FLOAT
        array = np.ascontiguousarray(values, dtype=_TYPES[kind])
        width = 1 if array.ndim == 1 else array.shape[1]
        view = {"buffer": 0, "byteOffset": len(self._data), "byteLength": array.nbytes}
        if target is not None:
            view["target"] = target
        self._data += array.tobytes()
        self._views.append(view)
        columns = array.reshape(len(array), width)
        self._accessors.append(
            {
                "bufferView": len(self._views) - 1,
                "componentType": kind,
                "count": len(array),
                "type": next(name for name, n in _WIDTHS.items() if n == width),
                "min": columns.min(axis=0).tolist(),
                "max": columns.max(axis=0).tolist(),
            }
        )
        return len(self._accessors) - 1

    def write(self, path: Path) -> None:
        """Write a GLB file."""
        whole = self.content | {
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._data)}],
        }
        text = json.dumps(whole, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self._data) + bytes(-len(self._data) % 4)
        length = 12 + 8 + len(text) + 8 + len(data)
        with path.open("wb") as file:
            file.write(struct.pack("<3I", _MAGIC, _VERSION, length))
            file.write(struct.pack("<2I", len(text), _JSON) + text)
            file.write(struct.pack("<2I", len(data), _BINARY) + data)


def read_glb(path: Path) -> tuple[dict[str, Any], bytes]:
    """Return the document and the buffer of a GLB file.

    Raises:
        RecordingError: It is none, or is cut off.
    """
    data = path.read_bytes()
    try:
        magic, version, length = struct.unpack_from("<3I", data)
        n_text, kind = struct.unpack_from("<2I", data, 12)
        if (magic, version, kind) != (_MAGIC, _VERSION, _JSON) or length > len(data):
            raise ValueError(f"{len(data)} of {length} bytes of version {version}")
        content = json.loads(data[20 : 20 + n_text])
        if not isinstance(content, dict):
            raise TypeError("its JSON is no object")
        buffer = b""
        if len(data) > 28 + n_text:
            n_binary, kind = struct.unpack_from("<2I", data, 20 + n_text)
            buffer = data[28 + n_text : 28 + n_text + n_binary] if kind == _BINARY else b""
    except (struct.error, ValueError, TypeError, RecursionError) as error:
        raise RecordingError(f"{path}: no GLB file: {error}") from error
    return content, buffer


def numbers(content: dict[str, Any], buffer: bytes, accessor: int) -> FloatArray:
    """Return the numbers of an accessor, shape (N, K), whole ones as they stand.

    Raises:
        KeyError, IndexError, TypeError, ValueError: The document does not hold them.
    """
    said = content["accessors"][accessor]
    view = content["bufferViews"][said["bufferView"]]
    kind, width = np.dtype(_TYPES[said["componentType"]]), _WIDTHS[said["type"]]
    start = view.get("byteOffset", 0) + said.get("byteOffset", 0)
    stride = view.get("byteStride", kind.itemsize * width)
    shape, strides = (said["count"], width), (stride, kind.itemsize)
    found = np.ndarray(shape, kind, buffer, start, strides)
    return found.astype(np.float64)

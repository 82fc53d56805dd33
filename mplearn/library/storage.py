"""The library's file: a zip of one JSON header and the arrays it names; no pickle, no code.

``header.json`` holds plain values; an array stands there as ``{"$array": [offset, dtype, shape]}``
and its bytes in ``arrays.bin``. Each array is kept in the narrowest type that holds it exactly.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import struct
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import LibraryError

FORMAT = "mplearn-library"
SCHEMA = 1
_MARK = "$array"
_DTYPES = ("<i2", "<i4", "<i8", "<f2", "<f4", "<f8", "|b1")
_MAX_BYTES = 1 << 30
_EPOCH = (1980, 1, 1, 0, 0, 0)  # a fixed date: equal libraries are equal files


def digest(content: Any) -> str:
    """Return the hash of plain values and arrays, 64 hexadecimal digits."""
    return _hash(*_packed(content))


def write(path: Path, content: Any) -> None:
    """Write plain values and arrays to a file, all of it or nothing.

    Raises:
        LibraryError: The content holds something else, or the file cannot be written.
    """
    body, blob = _packed(content)
    header = {"format": FORMAT, "schema": SCHEMA, "sha256": _hash(body, blob), "content": body}
    parts = {"header.json": _json(header), "arrays.bin": blob}
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise LibraryError(f"cannot write {path}: {error.strerror}") from error
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            with zipfile.ZipFile(file, "w") as archive:
                for part, data in parts.items():
                    info = zipfile.ZipInfo(part, _EPOCH)
                    info.compress_type = zipfile.ZIP_DEFLATED
                    archive.writestr(info, data, compresslevel=9)
            file.flush()
            os.fsync(file.fileno())
        temporary.chmod(0o644)
        temporary.replace(path)
    except OSError as error:
        raise LibraryError(f"cannot write {path}: {error.strerror}") from error
    finally:
        temporary.unlink(missing_ok=True)


def read(path: Path) -> Any:
    """Return what `write` wrote.

    Raises:
        LibraryError: The file cannot be read, is damaged, foreign, or of a newer version.
    """
    try:
        header_bytes, blob = _parts(path)
    except FileNotFoundError:
        raise LibraryError(f"there is no file {path}") from None
    except (zipfile.BadZipFile, zlib.error, struct.error, EOFError, LookupError, ValueError) as e:
        raise LibraryError(f"{path} is damaged, or not an mplearn library: {e}") from e
    except (NotImplementedError, RuntimeError, OverflowError, OSError) as error:
        raise LibraryError(f"{path} cannot be read: {error}") from error
    try:
        header = json.loads(header_bytes, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise LibraryError(f"{path} is damaged: its header is not JSON ({error})") from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise LibraryError(f"{path} is not an mplearn library")
    schema = header.get("schema")
    if not isinstance(schema, int) or schema < 1:
        raise LibraryError(f"{path} is damaged: its schema is {schema!r}")
    if schema > SCHEMA:
        raise LibraryError(
            f"{path} was written by a newer mplearn (schema {schema}); this one reads {SCHEMA}"
        )
    if _hash(header.get("content"), blob) != header.get("sha256"):
        raise LibraryError(f"{path} is damaged: its checksum does not match its content")
    try:
        return _unpacked(header["content"], blob)
    except (ValueError, TypeError, LookupError, RecursionError) as error:
        raise LibraryError(f"{path} holds malformed arrays: {error}") from error


def _parts(path: Path) -> tuple[bytes, bytes]:
    with zipfile.ZipFile(path) as archive:
        names = ("header.json", "arrays.bin")
        size = sum(archive.getinfo(name).file_size for name in names)
        if size > _MAX_BYTES:
            raise ValueError(f"its content claims {size} bytes, more than {_MAX_BYTES}")
        header, blob = (archive.read(name) for name in names)
    return header, blob


def _json(value: Any) -> bytes:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def _hash(body: Any, blob: bytes) -> str:
    return hashlib.sha256(_json(body) + b"\0" + blob).hexdigest()


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not JSON")


def _packed(content: Any) -> tuple[Any, bytes]:
    """Return plain JSON values that name arrays, and the bytes of those arrays."""
    blob = bytearray()
    known: dict[tuple[str, bytes], int] = {}

    def pack(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            narrow = _narrowest(value)
            data = narrow.tobytes()
            key = (narrow.dtype.str, data)
            if key not in known:  # equal arrays are kept once
                known[key] = len(blob)
                blob.extend(data)
            return {_MARK: [known[key], narrow.dtype.str, value.dtype.str, list(value.shape)]}
        if isinstance(value, dict):
            if not all(isinstance(key, str) for key in value):
                raise LibraryError(f"keys must be strings, not {list(value)[:3]}")
            return {key: pack(item) for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return [pack(item) for item in value]
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, float) and not math.isfinite(value):
            return pack(np.array(value))
        if value is None or isinstance(value, (str, bool, int, float)):
            return value
        raise LibraryError(f"a library cannot hold a {type(value).__name__}")

    return pack(content), bytes(blob)


def _narrowest(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    kind = array.dtype.kind
    if array.dtype.str not in _DTYPES:
        raise LibraryError(f"a library cannot hold an array of {array.dtype}")
    for dtype in _DTYPES:
        if np.dtype(dtype).kind == kind and np.dtype(dtype).itemsize <= array.dtype.itemsize:
            with np.errstate(over="ignore"):
                narrow = array.astype(dtype)
            if np.array_equal(narrow.astype(array.dtype), array, equal_nan=kind == "f"):
                return np.ascontiguousarray(narrow)
    return np.ascontiguousarray(array)


def _unpacked(body: Any, blob: bytes) -> Any:
    if isinstance(body, list):
        return [_unpacked(item, blob) for item in body]
    if not isinstance(body, dict):
        return body
    if _MARK not in body:
        return {key: _unpacked(item, blob) for key, item in body.items()}
    offset, narrow, dtype, shape = body[_MARK]
    if narrow not in _DTYPES or dtype not in _DTYPES or offset < 0 or min(shape, default=1) < 0:
        raise ValueError(f"an array is described as {body[_MARK]}")
    count = math.prod(shape)
    data = blob[offset : offset + count * np.dtype(narrow).itemsize]
    whole = np.frombuffer(data, dtype=narrow, count=count).astype(dtype).reshape(shape)
    return whole if shape else whole.item()

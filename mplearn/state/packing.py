"""Plain values and arrays as JSON and bytes.

An array stands in the JSON as ``{"$array": [offset, narrow, dtype, shape]}``: its bytes follow in
the narrowest type that holds it exactly, equal arrays once.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from ..errors import StateError

ARRAY = "$array"
_DTYPES = ("<i2", "<i4", "<i8", "<f2", "<f4", "<f8", "|b1")


def packed(content: Any) -> tuple[Any, bytes]:
    """Return plain JSON values that name arrays, and the bytes of those arrays.

    Raises:
        StateError: The content holds something else.
    """
    blob = bytearray()
    return _packed(content, blob, {}), bytes(blob)


def _packed(value: Any, blob: bytearray, known: dict[tuple[str, bytes], int]) -> Any:
    """Return a value of what `packed` returns; ``known`` are places of arrays in the blob.

    No function inside that one, which would be a cycle, and keep all bytes until it is found.
    """
    if isinstance(value, np.ndarray):
        narrow = _narrowest(value)
        data = narrow.tobytes()
        key = (narrow.dtype.str, data)
        if key not in known:
            known[key] = len(blob)
            blob.extend(data)
        return {ARRAY: [known[key], narrow.dtype.str, value.dtype.str, list(value.shape)]}
    if isinstance(value, dict):
        if not all(isinstance(key, str) for key in value):
            raise StateError(f"keys must be strings, not {list(value)[:3]}")
        return {key: _packed(item, blob, known) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_packed(item, blob, known) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return _packed(np.array(value), blob, known)
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    raise StateError(f"a state cannot hold a {type(value).__name__}")


def unpacked(body: Any, blob: bytes | memoryview) -> Any:
    """Return the plain values and arrays that `packed` returned; equal arrays are one object.

    Raises:
        StateError: They describe none.
    """
    try:
        return _unpacked(body, blob, {})
    except (ValueError, TypeError, LookupError, OverflowError, RecursionError) as error:
        raise StateError(f"holds malformed arrays: {error}") from error


def _unpacked(value: Any, blob: bytes | memoryview, seen: dict[tuple[Any, ...], Any]) -> Any:
    """Return a value of what `unpacked` returns; ``seen`` are the arrays so far."""
    if isinstance(value, list):
        return [_unpacked(item, blob, seen) for item in value]
    if not isinstance(value, dict):
        return value
    if ARRAY not in value:
        return {key: _unpacked(item, blob, seen) for key, item in value.items()}
    offset, narrow, dtype, shape = value[ARRAY]
    key = (offset, narrow, dtype, *shape)
    if key not in seen:
        seen[key] = _array(blob, offset, narrow, dtype, shape)
    return seen[key]


def as_json(value: Any) -> bytes:
    """Return plain values as JSON; equal values as equal bytes."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def from_json(data: bytes) -> Any:
    """Return what `as_json` described.

    Raises:
        StateError: It is no JSON.
    """
    try:
        return _DECODER.decode(data.decode())
    except (ValueError, RecursionError) as error:
        raise StateError(f"is not JSON ({error})") from error


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not JSON")


_DECODER = json.JSONDecoder(parse_constant=_refuse)


def _array(blob: bytes | memoryview, offset: int, narrow: str, dtype: str, shape: list[int]) -> Any:
    if narrow not in _DTYPES or dtype not in _DTYPES or offset < 0 or min(shape, default=1) < 0:
        raise ValueError(f"an array is described as {[offset, narrow, dtype, shape]}")
    count = math.prod(shape)
    data = blob[offset : offset + count * np.dtype(narrow).itemsize]
    whole = np.frombuffer(data, dtype=narrow, count=count).astype(dtype).reshape(shape)
    return whole if shape else whole.item()


def _narrowest(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    kind = array.dtype.kind
    if array.dtype.str not in _DTYPES:
        raise StateError(f"a state cannot hold an array of {array.dtype}")
    for dtype in _DTYPES:
        if np.dtype(dtype).kind == kind and np.dtype(dtype).itemsize <= array.dtype.itemsize:
            with np.errstate(over="ignore", invalid="ignore"):
                narrow = array.astype(dtype)
            if narrow.astype(array.dtype).tobytes() == array.tobytes():  # what a NaN says, too
                return np.ascontiguousarray(narrow)
    return np.ascontiguousarray(array)

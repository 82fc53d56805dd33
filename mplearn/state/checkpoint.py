"""Checkpoints: a state as a small document, and parts that are written once, by their content.

A `Blob` or `SharedState` is packed into one string of bytes, whose hash is its key; whatever holds
it refers to it by that. As long as the part stays the same object, neither is worked out again: a
checkpoint costs what has changed since the last one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Container, Mapping
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from ..errors import StateError
from .declared import Blob, SharedState, fields_of, to_plain
from .packing import as_json, from_json, packed, unpacked
from .structure import from_plain

T = TypeVar("T")
_KEY = "$key"
_WHOLE = "$whole 3"  # what a document names that, with its parts, leaves out no field of now
_WHOLE_THEN = ("$whole", "$whole 2")  # or none of those that there were then


class Checkpoint(NamedTuple):
    """A state in bytes.

    Attributes:
        document: All that is no shared part, with the keys of those that are.
        parts: Keys of the shared parts that the state is made of, without repeats.
        new: The bytes of those that were not known before, by key; none refers to a later one.

    Example:
        >>> import numpy as np
        >>> one = Blob(np.arange(3.0))
        >>> first = checkpoint(one)
        >>> later = checkpoint(one, known=first.parts)  # nothing of it is new
        >>> later.document == first.document, len(first.new), len(later.new)
        (True, 1, 0)
    """

    document: bytes
    parts: tuple[str, ...]
    new: Mapping[str, bytes]


Part: TypeAlias = Blob | SharedState


def checkpoint(state: Any, known: Container[str] = ()) -> Checkpoint:
    """Return a state in bytes, without the shared parts that are kept somewhere already.

    Args:
        state: The state.
        known: Keys of the parts that are kept.

    Example:
        >>> import numpy as np
        >>> first = checkpoint(Blob(np.arange(3.0)))
        >>> len(first.new), len(checkpoint(Blob(np.arange(3.0)), first.parts).new)
        (1, 0)
    """
    found: dict[str, None] = {}
    new: dict[str, bytes] = {}

    def note(part: Part) -> dict[str, str]:
        known_content = _content(part)
        key, inner, data = _packed(part) if known_content is None else (*known_content, b"")
        if key not in found:
            for each in inner:
                note(each)
            found[key] = None
            if key not in known:
                new[key] = data or _packed(part)[2]
        return {_KEY: key}

    document = to_bytes({_WHOLE: to_plain(state, note, whole=True)})
    return Checkpoint(document, tuple(found), new)


def resumed(kind: type[T], document: bytes, part: Callable[[str], bytes]) -> T:
    """Return the state of a checkpoint.

    Args:
        kind: Its type.
        document: Of the checkpoint.
        part: Returns the bytes of a part by its key.

    Raises:
        StateError: Something is damaged or missing, or describes no such state.

    Example:
        >>> from mplearn.segmentation import SegmenterState, make_segmenter
        >>> state = make_segmenter("zero-velocity", 2, 100.0).state()
        >>> written = checkpoint(state)
        >>> resumed(SegmenterState, written.document, written.new.__getitem__).n_frames
        0
    """
    try:
        content = from_bytes(document)
        named = next(iter(content)) if isinstance(content, dict) and len(content) == 1 else ""
        inner = content[named] if named in (_WHOLE, *_WHOLE_THEN) else content
        return from_plain(kind, _put_together(inner, part, {}), whole=named == _WHOLE)
    except RecursionError as error:
        raise StateError("its parts are nested too deep") from error


def _put_together(value: Any, part: Callable[[str], bytes], seen: dict[str, Any]) -> Any:
    """Return plain values with parts in the place of their keys; ``seen`` are those so far."""
    if isinstance(value, list):
        return [
            _below(f"[{i}]", item, part, seen) if isinstance(item, (dict, list)) else item
            for i, item in enumerate(value)
        ]
    if not isinstance(value, dict):
        return value
    if _KEY not in value:
        return {
            name: _below(name, item, part, seen) if isinstance(item, (dict, list)) else item
            for name, item in value.items()
        }
    key = value[_KEY]
    if not isinstance(key, str):
        raise StateError(f"a part must be named by its key, not {key!r:.60}")
    if key not in seen:
        data = _fetched(part, key)
        if hash_of(data) != key:
            raise StateError(f"part {key} is damaged: its content has another key")
        content = _put_together(from_bytes(data), part, seen)
        seen[key] = Blob(content) if isinstance(content, np.ndarray) else content
    return seen[key]


def _below(place: str, value: Any, part: Callable[[str], bytes], seen: dict[str, Any]) -> Any:
    try:
        return _put_together(value, part, seen)
    except StateError as error:
        raise error.below(place) from None


def key_of(part: Part) -> str:
    """Return the key of a shared part: the hash of its content, worked out once.

    Example:
        >>> import numpy as np
        >>> key_of(Blob(np.zeros(3))) == key_of(Blob(np.zeros(3))) != key_of(Blob(np.ones(3)))
        True
    """
    known = _content(part)
    return _packed(part)[0] if known is None else known[0]


def _content(part: Part) -> tuple[str, tuple[Part, ...]] | None:
    """Return the key of a part and the parts that it refers to itself, if it was packed before."""
    found: tuple[str, tuple[Part, ...]] | None = getattr(part, "content", None)
    return found


def _packed(part: Part) -> tuple[str, tuple[Part, ...], bytes]:
    """Pack a part: return its key, the parts that it refers to itself, and its bytes."""
    inner: list[Part] = []

    def note(each: Part) -> dict[str, str]:
        inner.append(each)
        return {_KEY: key_of(each)}

    data = to_bytes(part.array if isinstance(part, Blob) else fields_of(part, note, whole=True))
    key = hash_of(data)
    object.__setattr__(part, "content", (key, tuple(inner)))
    return key, tuple(inner), data


def hash_of(data: bytes) -> str:
    """Return the key of a content.

    Example:
        >>> len(hash_of(b"motion")), hash_of(b"motion") == hash_of(b"motion")
        (32, True)
    """
    return hashlib.blake2b(data, digest_size=16).hexdigest()


def to_bytes(plain: Any) -> bytes:
    """Return plain values and arrays as bytes: those of a document, or of a part.

    Example:
        >>> data = to_bytes({"n": 3, "last": np.array([1.5, np.nan])})
        >>> from_bytes(data)["last"].tolist()
        [1.5, nan]
    """
    body, blob = packed(plain)
    text = as_json(body)
    return len(text).to_bytes(8, "little") + text + blob


def from_bytes(data: bytes) -> Any:
    """Return the plain values and arrays that `to_bytes` described.

    Raises:
        StateError: The bytes are damaged.

    Example:
        >>> from_bytes(to_bytes({"n": 3, "names": ["bow", "wave"]}))
        {'n': 3, 'names': ['bow', 'wave']}
    """
    length = int.from_bytes(data[:8], "little")
    return unpacked(from_json(data[8 : 8 + length]), memoryview(data)[8 + length :])


def _fetched(part: Callable[[str], bytes], key: str) -> bytes:
    try:
        return part(key)
    except LookupError as error:
        raise StateError(f"part {key} is missing") from error

"""Checkpoints: a state as a small document, and parts that are written once, by their content.

A `Blob` or `SharedState` is packed into one string of bytes, whose hash is its key; whatever holds
it refers to it by that. As long as the part stays the same object, neither is worked out again: a
checkpoint costs what has changed since the last one.

A long row of parts is itself kept in parts: the blocks of a `Row`, which its owner keeps as long as
nothing in them changes. What comes without is cut into some of about `_ROW` each: where one ends is
said by the key of its last, so that one that changes, comes or goes changes those near it alone.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from ..errors import StateError
from .declared import Blob, Block, IntTable, Row, SharedState, fields_of, to_plain
from .kept import Kept
from .packing import as_json, from_json, packed, unpacked
from .structure import from_plain

T = TypeVar("T")
_KEY, _ROWS = "$key", "$rows"
_ROW = 64  # a power of two, to 256
_WHOLE = "$whole 5"  # what a document names that, with its parts, leaves out no field of now
_WHOLE_THEN = (
    "$whole",
    "$whole 2",
    "$whole 3",
    "$whole 4",
)  # or none of those that there were then


class Checkpoint(NamedTuple):
    """A state in bytes.

    Attributes:
        document: All that is no shared part, with the keys of those that are.
        held: What it names: the keys of all parts that each is made of, itself last, by its key.
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
    held: Mapping[str, tuple[str, ...]]
    new: Mapping[str, bytes]

    @property
    def parts(self) -> tuple[str, ...]:
        """Keys of the shared parts that the state is made of, without repeats."""
        return tuple(dict.fromkeys(chain.from_iterable(self.held.values())))


Part: TypeAlias = Blob | SharedState | Block[SharedState]


class _Content(NamedTuple):
    """What a part was packed into.

    Attributes:
        key: Hash of its bytes.
        inner: The parts that it refers to itself.
        made_of: Keys of all parts that it is made of, each after those that it refers to itself.
    """

    key: str
    inner: tuple[Part, ...]
    made_of: tuple[str, ...]


def checkpoint(state: Any, known: Container[str] = ()) -> Checkpoint:
    """Return a state in bytes, without the shared parts that are kept somewhere already.

    Args:
        state: The state.
        known: Keys of the parts that are kept. Of a `Kept`, what it holds is whole; of any other,
            it is looked up whether all is there that a part is made of.

    Example:
        >>> import numpy as np
        >>> first = checkpoint(Blob(np.arange(3.0)))
        >>> len(first.new), len(checkpoint(Blob(np.arange(3.0)), first.parts).new)
        (1, 0)
    """
    held: dict[str, tuple[str, ...]] = {}
    done: set[str] = set()
    new: dict[str, bytes] = {}

    def note(part: Part) -> str:
        content, data = _content(part), b""
        if content is None:
            content, data = _packed(part)
        if content.key not in held:
            held[content.key] = content.made_of
            write(part, content, data)
        return content.key

    def write(part: Part, content: _Content, data: bytes) -> None:
        if content.key in done:
            return
        done.add(content.key)
        there = content.key in known
        if there and (isinstance(known, Kept) or all(map(known.__contains__, content.made_of))):
            return
        for each in content.inner:
            write(each, _made_of(each), b"")
        if not there:
            new[content.key] = data or _packed(part)[1]

    def share(each: Blob | SharedState | IntTable | Sequence[SharedState]) -> dict[str, str]:
        if isinstance(each, (Blob, SharedState)):
            return {_KEY: note(each)}
        blocks = each.blocks if isinstance(each, (Row, IntTable)) else _blocks(each)
        return {_ROWS: " ".join(map(note, blocks))}

    document = to_bytes({_WHOLE: to_plain(state, share, whole=True)})
    return Checkpoint(document, held, new)


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
    if _ROWS in value:
        return _row(value[_ROWS], part, seen)
    if _KEY not in value:
        return {
            name: _below(name, item, part, seen) if isinstance(item, (dict, list)) else item
            for name, item in value.items()
        }
    key = value[_KEY]
    if not isinstance(key, str):
        raise StateError(f"a part must be named by its key, not {key!r:.60}")
    return _fetched(key, part, seen)


def _fetched(key: str, part: Callable[[str], bytes], seen: dict[str, Any]) -> Any:
    """Return the content of a part by its key."""
    if key not in seen:
        try:
            data = part(key)
        except LookupError as error:
            raise StateError(f"part {key} is missing") from error
        if hash_of(data) != key:
            raise StateError(f"part {key} is damaged: its content has another key")
        content = _put_together(from_bytes(data), part, seen)
        seen[key] = Blob(content) if isinstance(content, np.ndarray) else content
    return seen[key]


def _row(keys: Any, part: Callable[[str], bytes], seen: dict[str, Any]) -> list[Any]:
    """Return a row of parts, those of rows that it consists of one after another."""
    if not isinstance(keys, str):
        raise StateError(f"a row of parts must be named by its keys, not {keys!r:.60}")
    row = []
    for key in keys.split():
        content = _fetched(key, part, seen)
        row += content if isinstance(content, list) else [content]
    return row


def _below(place: str, value: Any, part: Callable[[str], bytes], seen: dict[str, Any]) -> Any:
    try:
        return _put_together(value, part, seen)
    except StateError as error:
        raise error.below(place) from None


def _blocks(row: Sequence[SharedState]) -> Iterator[Block[SharedState]]:
    """Cut a row of parts behind each whose key has 0 for its last digits."""
    start = 0
    for end, each in enumerate(row, start=1):
        if int(key_of(each)[-2:], 16) % _ROW == 0 or end == len(row):
            yield Block(row[start:end])
            start = end


def key_of(part: Part) -> str:
    """Return the key of a shared part: the hash of its content, worked out once.

    Example:
        >>> import numpy as np
        >>> key_of(Blob(np.zeros(3))) == key_of(Blob(np.zeros(3))) != key_of(Blob(np.ones(3)))
        True
    """
    return _made_of(part).key


def _content(part: Part) -> _Content | None:
    """Return what a part was packed into, if it was."""
    found: _Content | None = getattr(part, "content", None)
    return found


def _made_of(part: Part) -> _Content:
    """Return what a part is packed into, worked out once."""
    return _content(part) or _packed(part)[0]


def _packed(part: Part) -> tuple[_Content, bytes]:
    """Pack a part: return what refers to it, and its bytes."""
    inner: list[Part] = []

    def note(each: Blob | SharedState | IntTable | Sequence[SharedState]) -> Any:
        if isinstance(each, IntTable):
            inner.extend(each.blocks)
            return {_ROWS: " ".join(map(key_of, each.blocks))}
        if not isinstance(each, (Blob, SharedState)):
            return [note(item) for item in each]
        inner.append(each)
        return {_KEY: key_of(each)}

    if isinstance(part, Block):
        inner += part
        data = to_bytes({_ROWS: " ".join(map(key_of, part))})
    else:
        data = to_bytes(part.array if isinstance(part, Blob) else fields_of(part, note, whole=True))
    key = hash_of(data)
    made_of = dict.fromkeys(name for each in inner for name in _made_of(each).made_of)
    content = _Content(key, tuple(inner), (*made_of, key))
    object.__setattr__(part, "content", content)
    return content, data


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

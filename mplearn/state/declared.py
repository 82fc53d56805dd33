"""How a stateful object declares its state: frozen dataclasses with checked types; as plain values.

cattrs and msgspec turn dataclasses into plain values, too. Neither knows arrays, whose types,
shapes and ranges are most of what must be checked here, nor parts that are kept once by their
content; and both convert what merely looks like the wanted type. What would remain of either is the
walk over dataclass fields, which is the smaller part of `structure`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from itertools import chain
from typing import Any, TypeAlias, TypeGuard, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from .fields import absent_fields, saved_names
from .packing import packed

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class State:
    """Base of all states: what an object needs to go on as if nothing had happened.

    A subclass is a dataclass (``frozen=True, eq=False``) whose fields are plain values, arrays,
    tuples of those, `Blob`, and other states. Arrays in it are never written to: who makes a state
    copies what changes later, and so does who resumes from one. States are equal if all that they
    hold is, NaN included.

    Example:
        >>> from mplearn.segmentation import make_segmenter
        >>> from mplearn.state import from_plain, to_plain
        >>> state = make_segmenter("zero-velocity", 2, 100.0).state()
        >>> from_plain(type(state), to_plain(state)) == state
        True
        >>> from_plain(type(state), to_plain(state) | {"n_frames": -1})
        Traceback (most recent call last):
        mplearn.errors.StateError: n_frames: ...
    """

    def check(self) -> None:
        """Check what holds between fields; types, shapes and ranges are checked before.

        Raises:
            StateError: It does not hold; the place is that of the field.
        """

    def __eq__(self, other: object) -> bool:
        """Whether all that two states hold is equal bit for bit."""
        if type(other) is not type(self):
            return NotImplemented
        return packed(to_plain(self)) == packed(to_plain(other))

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True, eq=False)
class SharedState(State):
    """A state that is kept once, by content: as long as it does not change, it is one object.

    An owner returns the same object from its ``state()`` until something has changed; a checkpoint
    writes it once, and refers to it from then on.

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> graph = TransitionGraph()
        >>> graph.add_node(1)
        >>> graph.state() is graph.state()  # nothing has changed in between
        True
    """


class Blob:
    """An array that never changes, kept once by its content, such as an exemplar.

    Args:
        array: The values; nobody writes to them from now on.

    Example:
        >>> import numpy as np
        >>> Blob(np.arange(6.0).reshape(3, 2)).array.shape
        (3, 2)
    """

    __slots__ = ("array", "content")

    def __init__(self, array: NDArray[Any]) -> None:
        self.array = np.ascontiguousarray(array)
        self.content: Any = None  # key and parts, once somebody asked (`checkpoint`)

    def __len__(self) -> int:
        """Length of the first axis."""
        return len(self.array)

    def __repr__(self) -> str:
        """Return the shape."""
        return f"Blob{self.array.shape}"


class Block(tuple[T, ...]):
    """Some states of a `Row` that are kept together, once by their content.

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> len(Block([TransitionGraph().state()] * 3))
        3
    """

    content: Any = None  # as that of a `Blob`


class Row(tuple[T, ...]):
    """A long row of states in blocks, each the same object as long as nothing in it changes.

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> empty = TransitionGraph().state()
        >>> row = Row.of([Block([empty, empty]), Block([empty])])
        >>> len(row), list(map(len, row.blocks))
        (3, [2, 1])
    """

    blocks: tuple[Block[T], ...] = ()

    @classmethod
    def of(cls, blocks: Iterable[Block[T]]) -> Row[T]:
        """Return blocks as a row."""
        parts = tuple(blocks)
        row = cls(chain.from_iterable(parts))
        row.blocks = parts
        return row


class IntTable:
    """A long table of whole numbers in blocks of rows, each kept once by its content.

    Args:
        blocks: Some rows each, at least one block; nobody writes to them from now on.

    Example:
        >>> import numpy as np
        >>> table = IntTable([Blob(np.array([[1, 2], [2, 3]])), Blob(np.array([[3, 1]]))])
        >>> len(table), table.array[:, 0].tolist()
        (3, [1, 2, 3])
    """

    __slots__ = ("_array", "blocks")

    def __init__(self, blocks: Iterable[Blob]) -> None:
        self.blocks = tuple(blocks)
        self._array: NDArray[np.int64] | None = None

    @property
    def array(self) -> NDArray[np.int64]:
        """All rows, put together once; nobody writes to them."""
        if self._array is None:
            parts = [block.array for block in self.blocks]
            self._array = parts[0] if len(parts) == 1 else np.concatenate(parts)
        return self._array

    def __len__(self) -> int:
        """Number of rows."""
        return sum(map(len, self.blocks))

    def __repr__(self) -> str:
        """Return the numbers of rows and blocks."""
        return f"IntTable({len(self)} rows in {len(self.blocks)} blocks)"


class KeptBlocks:
    """The blocks of a table that grows: those in which nothing has changed stay the same objects.

    Example:
        >>> import numpy as np
        >>> kept, rows = KeptBlocks(), np.arange(600).reshape(-1, 1)
        >>> first = kept.table(rows)
        >>> rows[3] += 1
        >>> kept.touch(3)
        >>> [a is b for a, b in zip(first.blocks, kept.table(rows).blocks, strict=True)]
        [False, True, True]
    """

    def __init__(self) -> None:
        self._blocks: list[Blob] = []
        self._touched: set[int] = set()

    def touch(self, row: int) -> None:
        """Take note that a row has changed. That rows have come behind the last is noticed."""
        self._touched.add(row // ROWS)

    def table(self, rows: NDArray[np.int64] | Sequence[int]) -> IntTable:
        """Return all rows, copied where something in their block has changed."""
        blocks, n_blocks = self._blocks, max(-(-len(rows) // ROWS), 1)
        del blocks[n_blocks:]
        for at in range(n_blocks):
            start, end = at * ROWS, min((at + 1) * ROWS, len(rows))
            if at == len(blocks) or at in self._touched or len(blocks[at]) != end - start:
                blocks[at:] = [Blob(np.array(rows[start:end], np.int64)), *blocks[at + 1 :]]
        self._touched.clear()
        return IntTable(blocks)

    def copy(self) -> KeptBlocks:
        """Return the blocks of a copy of the table."""
        twin = KeptBlocks()
        twin._blocks, twin._touched = list(self._blocks), set(self._touched)
        return twin


Share: TypeAlias = Callable[[Blob | SharedState | IntTable | tuple[SharedState, ...]], Any]
ROWS = 256  # of a table that are kept together
MANY = 32  # parts in a row that are kept in parts of them


def to_plain(value: Any, share: Share | None = None, *, whole: bool = False) -> Any:
    """Return dataclasses as dictionaries, tuples and sets as lists, blobs as arrays.

    Arrays are not copied.

    Args:
        value: A state, a configuration, or anything they hold.
        share: Says what stands for a part that is kept by its content, or for a row of more than
            `MANY` such states; the parts themselves by default.
        whole: With all fields, as what is stored has them: one that is lost is then missed. Else a
            `newer` one is left out where it has the value that its absence means, so that equal
            content of any version has one hash.

    Example:
        >>> from mplearn.tree import TreeConfig
        >>> to_plain(TreeConfig(min_exemplars=4))["min_exemplars"]
        4
    """
    if isinstance(value, (np.ndarray, str, int, float)) or value is None:
        return value.item() if isinstance(value, np.generic) else value
    if share is not None and isinstance(value, (Blob, SharedState, IntTable)):
        return share(value)
    if isinstance(value, (Blob, IntTable)):
        return value.array
    if isinstance(value, (tuple, list)):
        if share is not None and len(value) > MANY and _is_row(value):
            return share(value)
        return [to_plain(item, share, whole=whole) for item in value]
    if isinstance(value, dict):
        return {key: to_plain(value[key], share, whole=whole) for key in sorted(value)}
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    if is_dataclass(value):
        return fields_of(value, share, whole=whole)
    return value.item() if isinstance(value, np.generic) else value


def _is_row(value: Any) -> TypeGuard[tuple[SharedState, ...]]:
    return isinstance(value, Row) or all(isinstance(item, SharedState) for item in value)


def fields_of(value: Any, share: Share | None = None, *, whole: bool = False) -> dict[str, Any]:
    """Return the fields of a dataclass as plain values by name, see `to_plain`.

    Example:
        >>> from mplearn.segmentation import TurnConfig
        >>> fields_of(TurnConfig(zigzag=0.4))["zigzag"]
        0.4
    """
    names, absent = _names(cast(Any, type(value)))
    return {
        saved: to_plain(getattr(value, name), share, whole=whole)
        for name, saved in names.items()
        if whole or name not in absent or getattr(value, name) != absent[name]
    }


@cache
def _names(kind: Any) -> tuple[dict[str, str], dict[str, Any]]:
    """Return the names of the fields as saved, and what the absence of some means."""
    called = saved_names(kind)
    saved = {each.name: called.get(each.name, each.name) for each in fields(kind)}
    return saved, absent_fields(kind)

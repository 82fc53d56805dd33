"""What a state says of its fields: ranges, shapes, and what holds for files of other versions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, TypeAlias, TypeVar

import numpy as np

from ..errors import StateError

T = TypeVar("T")
_ABSENT = "absent"
LARGEST = 1e250  # of a number in a state, where nothing else is said: what lies beyond is damage


@dataclass(frozen=True)
class Range:
    """Marks a number that lies in [low, high]; NaN never does.

    It is used as in ``Annotated[float, Range(0.0)]``.

    Example:
        >>> from dataclasses import dataclass
        >>> from typing import Annotated
        >>> from mplearn.state import State, from_plain
        >>> @dataclass(frozen=True)
        ... class Clock(State):
        ...     time_s: Annotated[float, Range(0.0)]
        >>> from_plain(Clock, {"time_s": -1.0})
        Traceback (most recent call last):
        mplearn.errors.StateError: ...
    """

    low: float = -LARGEST
    high: float = LARGEST


@dataclass(frozen=True)
class Array:
    """Marks an array, as in ``Annotated[FloatArray, Array("n", "n", low=0.0)]``.

    Args:
        *shape: Length of each axis: a number, a name (equal names in one state are equal lengths),
            or None for any.
        low: Smallest value.
        high: Largest value.
        nan: Whether NaN may stand for what is missing.

    Example:
        >>> import numpy as np
        >>> from mplearn.graph import GraphState, TransitionGraph
        >>> from mplearn.state import from_plain, to_plain
        >>> plain = to_plain(TransitionGraph().state())  # its edges are Array(None, 5, ...)
        >>> from_plain(GraphState, plain | {"edges": np.zeros((2, 3), np.int64)})
        Traceback (most recent call last):
        mplearn.errors.StateError: edges: ...
    """

    shape: tuple[int | str | None, ...]
    low: float
    high: float
    nan: bool

    def __init__(
        self,
        *shape: int | str | None,
        low: float = -LARGEST,
        high: float = LARGEST,
        nan: bool = False,
    ) -> None:
        for name, value in (("shape", shape), ("low", low), ("high", high), ("nan", nan)):
            object.__setattr__(self, name, value)


WHOLE = 2.0**53  # of a whole number: up to it, numbers are exact
Count: TypeAlias = Annotated[int, Range(0, WHOLE)]


def complete(kind: type[T]) -> type[T]:
    """Mark a dataclass whose fields must all be there, whatever defaults its constructor has.

    Elsewhere a field that is missing takes its default: as where a setting is newer than a file.

    Example:
        >>> from dataclasses import dataclass
        >>> from mplearn.state import State, from_plain
        >>> @complete
        ... @dataclass(frozen=True)
        ... class Tally(State):
        ...     seen: int = 0
        ...     lost: int = 0
        >>> from_plain(Tally, {"seen": 7})
        Traceback (most recent call last):
        mplearn.errors.StateError: ...
    """
    _COMPLETE.add(kind)
    return kind


def newer(default: T, *, absent: T) -> T:
    """Return the field of a setting that is newer than files that are about.

    Args:
        default: What it is in a new configuration.
        absent: What an older file means that does not name it: how things were before. Where it is
            that, it is left out of what is hashed, so that an old file's content keeps its hash.

    Example:
        >>> from dataclasses import dataclass
        >>> from mplearn.state import from_plain, to_plain
        >>> @dataclass(frozen=True)
        ... class Rules:
        ...     order: int = 2
        ...     reach: float = newer(1.5, absent=1.0)
        >>> from_plain(Rules, {"order": 3})
        Rules(order=3, reach=1.0)
        >>> to_plain(Rules(3, 1.0)), to_plain(Rules())
        ({'order': 3}, {'order': 2, 'reach': 1.5})
    """
    made: T = field(default=default, metadata={_ABSENT: absent})
    return made


def saved_as(**names: str) -> Callable[[type[T]], type[T]]:
    """Mark fields of a dataclass that go by other names in what is saved: those they had before.

    What is read may name them either way.

    Example:
        >>> from dataclasses import dataclass
        >>> from mplearn.state import from_plain, to_plain
        >>> @saved_as(order="depth")
        ... @dataclass(frozen=True)
        ... class Rules:
        ...     order: int = 2
        >>> to_plain(Rules(3))
        {'depth': 3}
        >>> from_plain(Rules, {"depth": 3}) == from_plain(Rules, {"order": 3})
        True
    """

    def mark(kind: type[T]) -> type[T]:
        _SAVED_AS[kind] = names
        return kind

    return mark


def saved_names(kind: type) -> dict[str, str]:
    """Return the names of fields in what is saved, of those that go by another name there."""
    return _SAVED_AS.get(kind, {})


def absent_fields(kind: Any) -> dict[str, Any]:
    """Return the `newer` fields of a dataclass by name, and what the absence of each means."""
    return {each.name: each.metadata[_ABSENT] for each in fields(kind) if _ABSENT in each.metadata}


def is_complete(kind: type) -> bool:
    """Whether a dataclass is so marked."""
    return kind in _COMPLETE


_COMPLETE: set[type] = set()
_SAVED_AS: dict[type, dict[str, str]] = {}


def require(holds: bool, place: str, problem: str | Callable[[], str]) -> None:
    """Raise a `StateError` at a place where something does not hold.

    Example:
        >>> require(2 > 3, "nodes[0].left", "must be greater than 3")
        Traceback (most recent call last):
        mplearn.errors.StateError: nodes[0].left: must be greater than 3
    """
    if not holds:
        raise StateError(problem if isinstance(problem, str) else problem(), place)


def require_no_cycle(parents: Mapping[int, int | None], place: Callable[[int], str]) -> None:
    """Raise a `StateError` where a node lies below itself.

    Args:
        parents: The node above each node; one that is not among them is above all.
        place: Returns the place of what is said of a node.

    Example:
        >>> require_no_cycle({1: None, 2: 1, 3: 2}, "nodes[{}].parent".format)
        >>> require_no_cycle({1: 2, 2: 1}, "nodes[{}].parent".format)
        Traceback (most recent call last):
        mplearn.errors.StateError: nodes[2].parent: node 2 lies below itself
    """
    safe: set[int] = set()
    for start in parents:
        path: list[int] = []
        at: int | None = start
        while at is not None and at in parents and at not in safe:
            if at in path[-1:] or (len(path) > len(parents)):
                raise StateError(f"node {at} lies below itself", place(at))
            path.append(at)
            at = parents[at]
        safe.update(path)


def shown(value: object) -> str:
    """Return a value for a message, shortened."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} {value.shape}"
    if isinstance(value, (dict, list, tuple)):
        return f"a {type(value).__name__} of {len(value)}"
    if isinstance(value, int | float | bool | str | None):
        return f"{value!r:.60}"
    return f"a {type(value).__name__}"


def limits(low: float, high: float) -> str:
    """Return a range for a message."""
    if math.isinf(low) and math.isinf(high):
        return "any number"
    return f"in [{low:g}, {high:g}]"

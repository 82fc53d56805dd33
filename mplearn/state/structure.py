"""Plain values as typed states: every value is checked, what is wrong is named with its place."""

from __future__ import annotations

import math
import operator
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from typing import (
    Annotated,
    Any,
    Literal,
    NamedTuple,
    TypeAlias,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from ..errors import MPLearnError, StateError
from .declared import Blob, IntTable, KeptBlocks, Row, State
from .fields import (
    LARGEST,
    WHOLE,
    Array,
    Range,
    absent_fields,
    is_complete,
    limits,
    saved_names,
    shown,
)

T = TypeVar("T")


class Scope(NamedTuple):
    """What the reader of a field knows of the state that it is in.

    Attributes:
        whole: Whether each field must be there.
        lengths: Of the axes that have names.
    """

    whole: bool
    lengths: dict[str, int]


Reader: TypeAlias = Callable[[Any, Scope], Any]

_LONGEST_TEXT = 100_000


def from_plain(kind: type[T], value: Any, *, whole: bool = False) -> T:
    """Return the typed state, or configuration, that plain values describe.

    A field that is not known is refused.

    Args:
        kind: A dataclass.
        value: What `to_plain` returned, or an instance of ``kind``, which is checked all the same.
        whole: Whether each field must be there, as where `to_plain` wrote it whole. Else one that
            is missing takes its default, if it has one: what is read may be older than the field.

    Raises:
        StateError: They describe none; its place says where.

    Example:
        >>> from mplearn.segmentation import ZeroVelocityConfig
        >>> from mplearn.state import to_plain
        >>> plain = to_plain(ZeroVelocityConfig())
        >>> from_plain(ZeroVelocityConfig, plain) == ZeroVelocityConfig()
        True
        >>> from_plain(ZeroVelocityConfig, plain | {"speed": 1.0})
        Traceback (most recent call last):
        mplearn.errors.StateError: ...speed...
    """
    return cast(T, _reader(cast(Any, kind))(value, Scope(whole, {})))


def validated(state: T) -> T:
    """Return a typed state after checking all that it holds, once: states never change.

    Raises:
        StateError: Something in it is wrong; its place says where.

    Example:
        >>> from dataclasses import replace
        >>> from mplearn.segmentation import make_segmenter
        >>> state = make_segmenter("zero-velocity", 2, 100.0).state()
        >>> validated(state).n_frames
        0
        >>> validated(replace(state, n_frames=-1))
        Traceback (most recent call last):
        mplearn.errors.StateError: ...
    """
    return from_plain(type(state), state)


@contextmanager
def within(place: str) -> Iterator[None]:
    """Let errors of the block be `StateError`, with places seen from above.

    Args:
        place: The field that the block is about.

    Example:
        >>> from mplearn.state import require
        >>> with within("tree"), within("nodes[3]"):
        ...     require(2 > 3, "left", "must be less")
        Traceback (most recent call last):
        mplearn.errors.StateError: tree.nodes[3].left: must be less
    """
    try:
        yield
    except StateError as error:
        raise error.below(place) from None
    except MPLearnError as error:
        raise StateError(str(error), place) from error


@cache
def _reader(kind: Any) -> Reader:
    """Return what reads values of a type."""
    origin, args = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _marked(args[0], args[1])
    if origin in (Union, types.UnionType):
        return _optional(args)
    if origin is Literal:
        return _one_of(args)
    if origin is tuple:
        return _many(_reader(args[0])) if args[1:] == (...,) else _row(args)
    if origin is frozenset:
        return _set(_reader(args[0]))
    if origin is dict:
        return _table(_reader(args[1]))
    if origin is np.ndarray:
        return _any_array if get_args(args[1])[0] is Any else _array(kind, None)
    if is_dataclass(kind):
        return _dataclass(cast(type, kind))
    if isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields"):
        hints = get_type_hints(kind, include_extras=True)
        row = _row(tuple(hints[name] for name in kind._fields), kind._fields)
        return lambda value, scope: kind(*row(value, scope))
    readers: dict[Any, Reader] = {
        bool: _bool,
        int: _number(int, Range(-WHOLE, WHOLE)),
        float: _number(float, None),
        str: _text,
    }
    if kind not in readers:
        raise TypeError(f"a state cannot hold {kind}")
    return readers[kind]


def _marked(kind: Any, marker: Any) -> Reader:
    if isinstance(marker, Range) and kind in (int, float):
        return _number(kind, marker)
    if isinstance(marker, Array):
        if kind is Blob:
            return _blob(marker)
        if kind is IntTable:
            return _int_table(marker)
        return _array(kind, marker)
    return _reader(kind)


def _optional(args: tuple[Any, ...]) -> Reader:
    inner = [each for each in args if each is not type(None)]
    if len(inner) != 1 or len(inner) == len(args):
        raise TypeError(f"a state can hold one type or None, not {args}")
    read = _reader(inner[0])
    return lambda value, scope: None if value is None else read(value, scope)


def _one_of(allowed: tuple[Any, ...]) -> Reader:
    def read(value: Any, _: Scope) -> Any:
        if not any(type(value) is type(each) and value == each for each in allowed):
            raise StateError(f"must be one of {list(allowed)}, not {shown(value)}")
        return value

    return read


def _items(value: Any) -> list[Any] | tuple[Any, ...]:
    if not isinstance(value, (list, tuple)):
        raise StateError(f"must be a list, not {shown(value)}")
    return value


def _many(read: Reader) -> Reader:
    def read_all(value: Any, scope: Scope) -> tuple[Any, ...]:
        found = []
        for i, item in enumerate(_items(value)):
            try:
                found.append(read(item, scope))
            except StateError as error:
                raise error.below(f"[{i}]") from None
        return _kept(value, found)

    return read_all


def _row(kinds: tuple[Any, ...], names: tuple[str, ...] = ()) -> Reader:
    readers = [_reader(kind) for kind in kinds]

    def read(value: Any, scope: Scope) -> tuple[Any, ...]:
        items = _items(value)
        if len(items) != len(readers):
            raise StateError(f"must be a list of {len(readers)}, not of {len(items)}")
        found = []
        for i, (one, item) in enumerate(zip(readers, items, strict=True)):
            try:
                found.append(one(item, scope))
            except StateError as error:
                raise error.below(names[i] if names else f"[{i}]") from None
        return _kept(value, found)

    return read


def _kept(value: Any, found: list[Any]) -> tuple[Any, ...]:
    """Return what was found; the same tuple, where it was found in one that needs no change."""
    kept: tuple[Any, ...] = value if type(value) in (tuple, Row) else ()
    return kept if value is kept and all(map(operator.is_, kept, found)) else tuple(found)


def _set(read: Reader) -> Reader:
    listed = _many(read)

    def read_set(value: Any, scope: Scope) -> frozenset[Any]:
        items = listed(sorted(value) if isinstance(value, (set, frozenset)) else value, scope)
        if len(set(items)) != len(items):
            raise StateError(f"must hold each value once, not {shown(list(items))}")
        return frozenset(items)

    return read_set


def _table(read: Reader) -> Reader:
    def read_all(value: Any, scope: Scope) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise StateError(f"must be a dictionary, not {shown(value)}")
        found = {}
        for key, item in value.items():
            name = _text(key, scope)
            try:
                found[name] = read(item, scope)
            except StateError as error:
                raise error.below(name) from None
        return found

    return read_all


def _bool(value: Any, _: Scope) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise StateError(f"must be true or false, not {shown(value)}")
    return bool(value)


def _text(value: Any, _: Scope) -> str:
    if not isinstance(value, str):
        raise StateError(f"must be text, not {shown(value)}")
    if len(value) > _LONGEST_TEXT or any("\ud800" <= each <= "\udfff" for each in value):
        raise StateError(f"must be text in Unicode of at most {_LONGEST_TEXT} characters")
    return value


def _number(kind: type, marker: Range | None) -> Reader:
    low, high = (-LARGEST, LARGEST) if marker is None else (marker.low, marker.high)
    if kind is int:
        low, high = max(low, -WHOLE), min(high, WHOLE)
    allowed = (int, np.integer) if kind is int else (int, float, np.integer, np.floating)
    called = "a whole number" if kind is int else "a number"

    def read(value: Any, _: Scope) -> Any:
        if isinstance(value, (bool, np.bool_)) or not isinstance(value, allowed):
            raise StateError(f"must be {called}, not {shown(value)}")
        number: Any = value
        infinite = number in (-math.inf, math.inf)
        if not (infinite and marker is None) and not (
            low <= number <= high and (infinite or abs(number) <= LARGEST or kind is int)
        ):
            raise StateError(f"must be {called} {limits(low, high)}, not {shown(value)}")
        return kind(value)

    return read


def _any_array(value: Any, _: Scope) -> Any:
    if not isinstance(value, np.ndarray):
        raise StateError(f"must be an array, not {shown(value)}")
    return value


def _array(kind: Any, marker: Array | None) -> Reader:
    dtype = np.dtype(get_args(get_args(kind)[1])[0])
    check = _array_check(dtype, marker or Array())
    shaped = marker is not None

    def read(value: Any, scope: Scope) -> Any:
        check(value, scope if shaped else None)
        return value

    return read


def _blob(marker: Array) -> Reader:
    check = _array_check(np.dtype(np.float64), marker)

    def read(value: Any, scope: Scope) -> Blob:
        check(value.array if isinstance(value, Blob) else value, scope)
        return value if isinstance(value, Blob) else Blob(value)

    return read


def _int_table(marker: Array) -> Reader:
    check = _array_check(np.dtype(np.int64), marker)

    def read(value: Any, scope: Scope) -> IntTable:
        if isinstance(value, np.ndarray):
            check(value, scope)
            return KeptBlocks().table(value)
        table: IntTable = value if isinstance(value, IntTable) else IntTable(_items(value))
        if table is not value:
            whole = all(isinstance(each, Blob) and each.array.ndim for each in table.blocks)
            alike = whole and {(each.array.dtype, each.array.shape[1:]) for each in table.blocks}
            if not alike or len(alike) > 1:
                raise StateError("must be an array, or blocks of one")
        check(table.array, scope)
        return table

    return read


def _array_check(dtype: np.dtype[Any], marker: Array) -> Callable[[Any, Scope | None], None]:
    low, high, bounded = marker.low, marker.high, dtype.kind != "b"
    if dtype.kind == "i":
        low, high = max(low, -WHOLE), WHOLE if high == LARGEST else high

    def check(value: Any, scope: Scope | None) -> None:
        if not isinstance(value, np.ndarray) or value.dtype != dtype:
            raise StateError(f"must be an array of {dtype}, not {shown(value)}")
        if scope is not None:
            _check_shape(value.shape, marker.shape, scope.lengths)
        if not (bounded and value.size):
            return
        if marker.nan:
            least, most = np.fmin.reduce(value, axis=None), np.fmax.reduce(value, axis=None)
            if least != least:  # all is missing
                return
        else:
            least, most = value.min(), value.max()
        if most == math.inf or least == -math.inf:  # what is finite is no larger than elsewhere
            finite = value[np.isfinite(value)]
            fits = bool((np.abs(finite) <= LARGEST).all())
        else:
            fits = dtype.kind == "i" or (least >= -LARGEST and most <= LARGEST)
        if not (fits and low <= least and most <= high):
            missing = "" if marker.nan or dtype.kind != "f" else ", none missing"
            raise StateError(
                f"must hold numbers {limits(low, high)}{missing}, not {least:g} to {most:g}"
            )

    return check


def _check_shape(
    shape: tuple[int, ...], wanted: tuple[int | str | None, ...], lengths: dict[str, int]
) -> None:
    fits = len(shape) == len(wanted)
    for length, name in zip(shape, wanted, strict=False):
        if isinstance(name, str):
            fits = fits and lengths.setdefault(name, length) == length
        else:
            fits = fits and name in (None, length)
    if not fits:
        named = [str(lengths.get(str(name), name)) if name is not None else "*" for name in wanted]
        raise StateError(f"must have shape ({', '.join(named)}), not {shape}")


def _dataclass(kind: type) -> Reader:
    """Return what reads a dataclass; its own hints are looked up when it is first read."""
    known: list[tuple[str, Reader, bool]] = []
    names = {each.name for each in fields(kind)}
    called = {saved: name for name, saved in saved_names(kind).items()}

    def readers() -> list[tuple[str, Reader, bool]]:
        if not known:
            hints = get_type_hints(kind, include_extras=True)
            for each in fields(kind):
                default = each.default is not MISSING or each.default_factory is not MISSING
                optional = default and not is_complete(kind)
                known.append((each.name, _reader(hints[each.name]), optional))
        return known

    def read(value: Any, above: Scope) -> Any:
        typed = isinstance(value, kind)
        if typed and vars(value).get("_checked"):
            return value
        given = {name: getattr(value, name) for name in names} if typed else value
        if not isinstance(given, dict):
            raise StateError(f"must be a dictionary, not {shown(value)}")
        asked: dict[str, str] = {}  # fields by the names that they are given by
        if not typed and any(saved in given for saved in called):
            asked = {name: saved for saved, name in called.items() if saved in given}
            twice = [name for name in asked if name in given]
            if twice:
                raise StateError(f"names {twice[0]!r} twice, also as {asked[twice[0]]!r}")
            given = {called.get(key, key): value for key, value in given.items()}
        strange = [key for key in given if key not in names]
        if strange:
            raise StateError(f"has no field {strange[0]!r:.60}; known are {sorted(names)}")
        scope = Scope(above.whole, {})
        found = {} if typed or above.whole else absent_fields(kind)
        for name, one, optional in readers():
            if name not in given:
                if optional and not above.whole:
                    continue
                raise StateError("is missing", name)
            try:
                found[name] = one(given[name], scope)
            except StateError as error:
                raise error.below(asked.get(name, name)) from None
        if typed and all(found[name] is given[name] for name in names):
            made = value
        else:
            try:
                made = kind(**found)
            except StateError:
                raise
            except (MPLearnError, ValueError, TypeError, ArithmeticError) as error:
                raise StateError(str(error)) from error
        if isinstance(made, State):
            made.check()
            object.__setattr__(made, "_checked", True)
        return made

    return read

"""Typed states as plain values and arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, cast

import numpy as np

from .declared import Blob, SharedState, absent_fields

Share = Callable[[Blob | SharedState], Any]


def to_plain(value: Any, share: Share | None = None) -> Any:
    """Return dataclasses as dictionaries, tuples and sets as lists, blobs as arrays.

    Arrays are not copied.

    Args:
        value: A state, a configuration, or anything they hold.
        share: Says what stands for a part that is kept by its content; the part itself by default.
    """
    if isinstance(value, (np.ndarray, str, int, float)) or value is None:
        return value.item() if isinstance(value, np.generic) else value
    if share is not None and isinstance(value, (Blob, SharedState)):
        return share(value)
    if isinstance(value, Blob):
        return value.array
    if isinstance(value, (tuple, list)):
        return [to_plain(item, share) for item in value]
    if isinstance(value, dict):
        return {key: to_plain(item, share) for key, item in value.items()}
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    if is_dataclass(value):
        return fields_of(value, share)
    return value.item() if isinstance(value, np.generic) else value


def fields_of(value: Any, share: Share | None = None) -> dict[str, Any]:
    """Return the fields of a dataclass as plain values by name.

    A `newer` field is left out where it has the value that its absence means, so that what an older
    version wrote is written again as it was.
    """
    names, absent = _names(cast(Any, type(value)))
    return {
        name: to_plain(getattr(value, name), share)
        for name in names
        if name not in absent or getattr(value, name) != absent[name]
    }


@cache
def _names(kind: Any) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return the names of the fields, and what the absence of some means."""
    return tuple(each.name for each in fields(kind)), absent_fields(kind)

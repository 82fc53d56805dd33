"""Configurations as a person writes them: every setting by its name; what is not named is usual.

A file is read otherwise (`from_plain`): there, what is not named is older than the setting.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, TypeVar, cast, get_type_hints

from .declared import to_plain
from .fields import absent_fields, saved_names
from .structure import from_plain

T = TypeVar("T")


def to_settings(config: Any) -> dict[str, Any]:
    """Return all settings of a configuration, a dataclass, as plain values by name.

    Example:
        >>> from mplearn.segmentation import TurnConfig
        >>> to_settings(TurnConfig(axis_s=2.0))["axis_s"]
        2.0
    """
    return {each.name: _plain(getattr(config, each.name)) for each in fields(config)}


def from_settings(kind: type[T], settings: Any) -> T:
    """Return the configuration that settings describe; one that is not named takes its default.

    Args:
        kind: A dataclass.
        settings: What `to_settings` returned, or any part of it, at any depth.

    Raises:
        StateError: A setting is not known, or has no such value; its place says which.

    Example:
        >>> from dataclasses import dataclass
        >>> from mplearn.state import from_plain, newer
        >>> @dataclass(frozen=True)
        ... class Rules:
        ...     order: int = 2
        ...     reach: float = newer(1.5, absent=1.0)
        >>> from_settings(Rules, {"order": 3}), from_plain(Rules, {"order": 3})
        (Rules(order=3, reach=1.5), Rules(order=3, reach=1.0))
        >>> to_settings(Rules(3, 1.0))
        {'order': 3, 'reach': 1.0}
    """
    return from_plain(kind, _filled(kind, settings))


def _plain(value: Any) -> Any:
    return to_settings(value) if is_dataclass(value) else to_plain(value)


def _filled(kind: Any, settings: Any) -> Any:
    """Return settings with the default of each `newer` one that they do not name."""
    if not (is_dataclass(kind) and isinstance(settings, dict)):
        return settings
    hints, saved = get_type_hints(kind), saved_names(cast(type, kind))
    filled = dict(settings)
    for each in fields(kind):
        names = {each.name, saved.get(each.name, each.name)} & settings.keys()
        for name in names:
            filled[name] = _filled(hints[each.name], settings[name])
        if not names and each.name in absent_fields(kind):
            filled[each.name] = _plain(each.default)
    return filled

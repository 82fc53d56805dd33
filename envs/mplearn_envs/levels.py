"""Values with named levels, as how a body differs, or what changes: from how they are given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

from mplearn.errors import InvalidValueError

T = TypeVar("T")


def from_levels(name: str, given: Any, levels: Mapping[str, T]) -> T:
    """Return values from their level's name, themselves, or some of them by name.

    A mapping may name a ``level`` that it starts from; otherwise it starts from the first.

    Args:
        name: What the environment calls them.
        given: How they were given.
        levels: The values of each level, instances of one dataclass.

    Raises:
        InvalidValueError: There is no such level or value, or one is out of its range.

    Example:
        >>> from mplearn_envs.execution.bodies import BODIES
        >>> from_levels("body", {"level": "harsh", "masses": 0.0}, BODIES).masses
        0.0
    """
    usual = next(iter(levels.values()))
    kind: Any = type(usual)
    same: T = given
    if isinstance(given, kind):
        return same
    if isinstance(given, str) and given in levels:
        return levels[given]
    known = [each.name for each in fields(kind)]
    if not isinstance(given, Mapping):
        raise InvalidValueError(
            f"{name} must be one of {tuple(levels)}, {kind.__name__} or a mapping of {known}, "
            f"not {given!r:.80}"
        )
    values = dict(given)
    level = values.pop("level", next(iter(levels)))
    if not (isinstance(level, str) and level in levels):
        raise InvalidValueError(f"level must be one of {tuple(levels)}, not {level!r:.80}")
    if unknown := [key for key in values if key not in known]:
        has = "have" if name.endswith("s") else "has"
        raise InvalidValueError(f"{name} {has} the values {known}, and level, not {unknown}")
    start: Any = levels[level]
    changed: T = replace(start, **values)
    return changed

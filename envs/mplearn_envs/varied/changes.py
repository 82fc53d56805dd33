"""What changes while the robot acts: what it knows, its demonstrator's habits, who that is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, TypeAlias

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn_envs.levels import from_levels

ChangesName: TypeAlias = Literal["none", "growing", "habits", "people", "all"]
When: TypeAlias = float | tuple[float, ...] | None  # a mean time between, or the moments


@dataclass(frozen=True)
class Changes:
    """What changes in an episode of the task `follow`.

    Attributes:
        watched: How many motions of the demonstrator the robot has seen when an episode begins.
            What it has not seen is illegal; each way becomes legal when it is shown, and the prior
            counts what was shown. None: it knows all ways of whoever is there.
        habits_s: When the demonstrator changes habits, see ``evenness``: a number is the mean time
            between two changes, which come at random [s]; several are the moments [s]; None: never.
        people_s: When another of the environment's people takes over: as ``habits_s``.
        evenness: How even new habits are. A changed demonstrator has the ways of before, and what
            comes how often after each primitive is drawn anew, from a Dirichlet distribution round
            the person's own shares whose parameters sum up to this: near 0 always the same one of
            them, by chance; of many, the person's own shares.

    Raises:
        InvalidValueError: A value is out of its range.

    Example:
        >>> Changes(watched=30, people_s=(20.0, 40.0)).people_s
        (20.0, 40.0)
    """

    watched: int | None = None
    habits_s: When = None
    people_s: When = None
    evenness: float = 1.0

    def __post_init__(self) -> None:
        watched: object = self.watched
        if watched is not None:
            whole = isinstance(watched, (int, np.integer)) and not isinstance(watched, bool)
            if not (whole and 1 <= watched <= 100_000):  # type: ignore[operator]
                raise InvalidValueError(
                    f"watched must be an integer in [1, 100000], or None, not {watched!r:.80}"
                )
            object.__setattr__(self, "watched", int(watched))  # type: ignore[call-overload]
        for name in ("habits_s", "people_s"):
            object.__setattr__(self, name, _when(name, getattr(self, name)))
        if not (_is_number(self.evenness) and 1e-3 <= self.evenness <= 1e6):
            raise InvalidValueError(f"evenness must lie in [0.001, 1e6], not {self.evenness!r}")


def _when(name: str, given: object) -> When:
    """Return a mean time or moments, as they are kept."""
    if given is None:
        return None
    if isinstance(given, (tuple, list)):
        if given and all(_is_number(t) and t > 0 for t in given):
            moments = tuple(float(t) for t in given)
            if all(a < b for a, b in pairwise(moments)):
                return moments
    elif _is_number(given) and given >= 0.1:  # type: ignore[operator]
        return float(given)  # type: ignore[arg-type]
    raise InvalidValueError(
        f"{name} must be a mean time of at least 0.1 s, or rising moments after 0 s, or None, "
        f"not {given!r:.80}"
    )


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        return False
    return bool(np.isfinite(value))


NOTHING = Changes()
CHANGES: dict[str, Changes] = {
    "none": NOTHING,
    "growing": Changes(watched=60),
    "habits": Changes(habits_s=20.0),
    "people": Changes(people_s=20.0),
    "all": Changes(watched=60, habits_s=20.0, people_s=30.0),
}


def make_changes(given: Changes | str | Mapping[str, Any]) -> Changes:
    """Return changes from their level's name, themselves, or their values by name.

    A mapping may name a ``level`` that it starts from.

    Raises:
        InvalidValueError: There is no such level or value, or one is out of its range.

    Example:
        >>> make_changes({"level": "all", "watched": 20}).watched
        20
    """
    return from_levels("changes", given, CHANGES)

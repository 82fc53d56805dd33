"""The robots that go by a name."""

from __future__ import annotations

from collections.abc import Callable

from mplearn.errors import InvalidValueError

from .description import Robot
from .humanoid import humanoid
from .unitree import unitree_g1

ROBOTS: dict[str, Callable[[], Robot]] = {"humanoid": humanoid, "unitree_g1": unitree_g1}


def make_robot(name: str) -> Robot:
    """Return a robot by name.

    Raises:
        InvalidValueError: There is none of that name.
        MissingDependencyError: Its model is not installed.
    """
    if name not in ROBOTS:
        raise InvalidValueError(f"robot must be one of {tuple(ROBOTS)}, not {name!r}")
    return ROBOTS[name]()

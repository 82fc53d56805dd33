"""The robots that go by a name."""

from __future__ import annotations

from collections.abc import Callable

from mplearn.errors import InvalidValueError

from .description import Robot
from .humanoid import humanoid
from .unitree import unitree_g1

ROBOTS: dict[str, Callable[[], Robot]] = {"humanoid": humanoid, "unitree_g1": unitree_g1}


def make_robot(robot: str | Robot) -> Robot:
    """Return a robot by its name, or the robot itself.

    Raises:
        InvalidValueError: There is none of that name.
        MissingDependencyError: Its model is not installed.
    """
    if isinstance(robot, Robot):
        return robot
    if not isinstance(robot, str) or robot not in ROBOTS:
        raise InvalidValueError(f"robot must be one of {tuple(ROBOTS)} or a Robot, not {robot!r}")
    return ROBOTS[robot]()

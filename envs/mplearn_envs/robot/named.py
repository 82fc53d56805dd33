"""The robots that go by a name, or are described in a file."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from mplearn.errors import InvalidValueError

from .description import Robot
from .humanoid import humanoid
from .packaged import PACKAGED, packaged_robot
from .robot_file import described_robot

ROBOTS: dict[str, Callable[[], Robot]] = {
    "humanoid": humanoid,
    **{name: partial(packaged_robot, name) for name in PACKAGED},
}


def make_robot(robot: str | Path | Robot) -> Robot:
    """Return a robot by its name, from the file that describes it, or the robot itself.

    Args:
        robot: One of `ROBOTS`, a TOML file (see `described_robot`), or a robot.

    Raises:
        InvalidValueError: There is none of that name.
        MissingDependencyError: Its model is not installed.
        RobotError: The file describes no robot.

    Example:
        >>> make_robot("humanoid").feet
        ('foot_l', 'foot_r')
    """
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, Path) or str(robot).lower().endswith((".toml", ".xml")):
        return described_robot(Path(robot))
    if not isinstance(robot, str) or robot not in ROBOTS:
        raise InvalidValueError(
            f"robot must be one of {tuple(ROBOTS)}, a FILE.toml or a Robot, not {robot!r}"
        )
    return ROBOTS[robot]()

"""A robot of one's own, described in a file.

.. code-block:: toml

    name = "mine"
    mjcf = "mine.xml"          # beside this file

    [segments]                 # the body of each role
    pelvis = "base_link"
    thigh_l = "left_hip_yaw_link"

    [attention]                # angles [rad] of the hinges, upright, legs straight, arms hanging
    left_elbow_joint = 1.57
"""

from __future__ import annotations

import tomllib
from math import isfinite
from pathlib import Path

from mplearn.errors import RobotError

from .description import Robot
from .roles import NEEDED_ROLES

_KEYS = ("name", "mjcf", "segments", "attention")


def described_robot(path: Path) -> Robot:
    """Return the robot that a TOML file describes; see this module and `Robot.from_mjcf`.

    Raises:
        RobotError: There is no such file, it lacks something, or the model is no humanoid on two
            feet, with the reason.

    Example:
        >>> import os
        >>> from mplearn_envs.robot import ROLES, humanoid
        >>> written = Path("mine.xml").write_text(humanoid().xml)
        >>> segments = (f'{role} = "{role}"' for role in ROLES)
        >>> lines = ('mjcf = "mine.xml"', "[segments]", *segments)
        >>> written = Path("mine.toml").write_text(os.linesep.join(lines))
        >>> described_robot(Path("mine.toml")).name
        'mine'
    """
    if path.suffix.lower() != ".toml":
        raise RobotError(
            f"{path} says where bodies are, not which is a foot: to perform, a robot needs a file "
            f"FILE.toml with name, mjcf, [segments] (bodies of {', '.join(NEEDED_ROLES)}) and "
            "[attention]"
        )
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RobotError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise RobotError(f"{path} is no TOML: {error}") from error
    unknown = sorted(set(content) - set(_KEYS))
    missing = sorted({"mjcf", "segments"} - set(content))
    if unknown or missing:
        raise RobotError(f"{path}: missing {missing}, unknown {unknown}; it may hold {_KEYS}")
    if not isinstance(content["mjcf"], str):
        raise RobotError(f"{path}: mjcf must be the name of a file, not {content['mjcf']!r}")
    segments, attention = content["segments"], content.get("attention", {})
    if not isinstance(segments, dict) or not isinstance(attention, dict):
        raise RobotError(f"{path}: [segments] and [attention] must be tables")
    if not all(isinstance(body, str) for body in segments.values()):
        raise RobotError(f"{path}: [segments] must name bodies")
    if not all(isinstance(a, int | float) and isfinite(a) for a in attention.values()):
        raise RobotError(f"{path}: [attention] must hold angles [rad]")
    name = str(content.get("name", path.stem))
    return Robot.from_mjcf(path.parent / content["mjcf"], name, segments, attention=attention)

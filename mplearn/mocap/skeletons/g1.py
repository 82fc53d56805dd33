"""The Unitree G1 with 29 joints: which joint hangs where, as far as motions of it need that.

Measures are those of the maker's description (g1_29dof_rev_1_0); `mplearn_envs.robot.unitree_g1`
is the whole robot. In the zero posture it stands with straight legs and forearms ahead.
"""

from __future__ import annotations

import numpy as np

from ...maths.rotations import axis_angle_to_matrix
from .kinematics import Joint

# each joint, what it hangs on, its place in it [m], its axis, and how its frame is tilted in its
# parent: about which axis and how far [rad]; the left side, which the right one mirrors
_TILT_LEG, _TILT_ARM = 0.174905, 0.279283
_LEG = (
    ("hip_pitch", "pelvis", (0.0, 0.064452, -0.1027), "y", "", 0.0),
    ("hip_roll", "hip_pitch", (0.0, 0.052, -0.030465), "x", "y", -_TILT_LEG),
    ("hip_yaw", "hip_roll", (0.025001, 0.0, -0.12412), "z", "", 0.0),
    ("knee", "hip_yaw", (-0.078273, 0.0021489, -0.17734), "y", "y", _TILT_LEG),
    ("ankle_pitch", "knee", (0.0, -0.000094445, -0.30001), "y", "", 0.0),
    ("ankle_roll", "ankle_pitch", (0.0, 0.0, -0.017558), "x", "", 0.0),
)
_WAIST = (
    ("waist_yaw", "pelvis", (0.0, 0.0, 0.0), "z", "", 0.0),
    ("waist_roll", "waist_yaw", (-0.0039635, 0.0, 0.044), "x", "", 0.0),
    ("waist_pitch", "waist_roll", (0.0, 0.0, 0.0), "y", "", 0.0),
)
_ARM = (
    ("shoulder_pitch", "waist_pitch", (0.0039563, 0.10022, 0.24778), "y", "x", _TILT_ARM),
    ("shoulder_roll", "shoulder_pitch", (0.0, 0.038, -0.013831), "x", "x", -_TILT_ARM),
    ("shoulder_yaw", "shoulder_roll", (0.0, 0.00624, -0.1032), "z", "", 0.0),
    ("elbow", "shoulder_yaw", (0.015783, 0.0, -0.080518), "y", "", 0.0),
    ("wrist_roll", "elbow", (0.1, 0.00188791, -0.01), "x", "", 0.0),
    ("wrist_pitch", "wrist_roll", (0.038, 0.0, 0.0), "y", "", 0.0),
    ("wrist_yaw", "wrist_pitch", (0.046, 0.0, 0.0), "z", "", 0.0),
)
# where chains end: the toes, the rubber hands, and the top of the head at a stature of 1.32 m
_TOES, _HAND, _HEAD = (0.12, 0.0, -0.03), (0.12, 0.0, 0.0), (0.004, 0.0, 0.48)

G1_JOINTS: tuple[str, ...] = tuple(
    f"{name}_joint"
    for name in (
        *(f"{side}_{row[0]}" for side in ("left", "right") for row in _LEG),
        *(row[0] for row in _WAIST),
        *(f"{side}_{row[0]}" for side in ("left", "right") for row in _ARM),
    )
)
"""Names of the 29 joints, in the order of the maker's description and of most data sets."""

BASE = ("base_x", "base_y", "base_height", "base_yaw", "base_roll", "base_pitch")
"""Names of what moves the pelvis: places [m], then angles [rad], yaw first (z-x'-y'')."""


def g1_joints() -> tuple[Joint, ...]:
    """Return the skeleton, its columns those of `BASE`, then of `G1_JOINTS`; angles are radians."""
    axes = np.eye(3)
    root_turns = tuple((axes["xyz".index(axis)], 3 + i) for i, axis in enumerate("zxy"))
    joints = [Joint("pelvis", -1, np.zeros(3), root_turns, ((0, 0), (1, 1), (2, 2)))]
    index = {"pelvis": 0}
    for side in ("left", "right", ""):
        for row in (*_LEG,) if side else _WAIST:
            _hang(joints, index, side, row)
    for side in ("left", "right"):
        for row in _ARM:
            _hang(joints, index, side, row)
    for name, parent, place in (
        ("head_end", "waist_pitch", _HEAD),
        *(
            (f"{side}_{name}_end", f"{side}_{parent}", place)
            for side in ("left", "right")
            for name, parent, place in (("toes", "ankle_roll", _TOES), ("hand", "wrist_yaw", _HAND))
        ),
    ):
        joints.append(Joint(name, index[parent], np.array(place), is_end=True))
    return tuple(joints)


def _hang(
    joints: list[Joint],
    index: dict[str, int],
    side: str,
    row: tuple[str, str, tuple[float, float, float], str, str, float],
) -> None:
    name, parent, (x, y, z), axis, tilted, tilt = row
    own = f"{side}_{name}" if side else name
    hangs_on = index.get(f"{side}_{parent}", index.get(parent, 0))
    if side == "right":  # mirrored: what is to the left is to the right, and turns about x change
        y, tilt = -y, -tilt if tilted == "x" else tilt
    before = np.eye(3)
    if tilted:
        before = axis_angle_to_matrix(np.eye(3)["xyz".index(tilted)], np.array(tilt))
    column = len(BASE) + G1_JOINTS.index(f"{own}_joint")
    index[own] = len(joints)
    joints.append(
        Joint(
            f"{own}_joint",
            hangs_on,
            np.array([x, y, z]),
            ((np.eye(3)["xyz".index(axis)], column),),
            before=before,
        )
    )

"""The robot: kinematics, inertias and looks of the 30-DoF humanoid of the second experiment.

[Kulic2012], 4.2: the IRT platform robot is human-sized with 38 DoF: three joints in the head,
seven in each arm, six in each leg, one at the hip, and eight in fingers and toes that were not
used. The paper gives no link sizes, masses, joint limits or axis of the hip joint. Assumed here:

* 1.65 m and 63 kg. Thigh and shank 0.40 m, ankle 0.085 m above the sole, hips 0.18 m apart; the
  rest has a person's proportions (see `human`): upper arm 0.307 m, forearm 0.241 m, shoulders 0.33
  m apart.
* Masses [kg]: pelvis 9, chest 22, head 4, upper arm 2.2, forearm 1.6, hand 0.5 and 0.05 a finger
  group, thigh 5.2, shank 3.0, foot 1.2, toes 0.15.
* The hip joint turns the chest about the vertical (``waist_yaw``).
* The first two axes of the shoulder are turned by 40 deg about the vertical, and the first is
  raised by 10 deg, as on many humanoids (all three stay perpendicular at rest, so every posture
  can be reached). An upper arm along the first axis is the singular posture of the shoulder; here
  it points back, outwards and up, or forward, across the body and down, where arms rarely go. With
  the lateral axis it would be the arm held out sideways, in the middle of every abduction.
* Fingers and toes are held at zero. Only the soles collide: a box of 24 x 11 x 4 cm a foot.

The model has no actuators, floor or lights: whoever simulates it adds them.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from .body import Body, load_body
from .mjcf import (
    COLLIDES,
    Hinge,
    X,
    Y,
    Z,
    add_part,
    add_sole,
    box,
    capsule,
    cylinder,
    ellipsoid,
    empty_model,
)

HEIGHT_M = 1.65
HIP_HEIGHT_M = 0.885
HELD = (*tuple(f"finger_{i}_{s}" for s in "lr" for i in (1, 2, 3)), "toe_l", "toe_r")
SHOULDER_TURN_DEG, SHOULDER_RAISE_DEG = 40.0, 10.0  # of the left one's axes; the right mirrors it

_HIP, _ANKLE, _SHOULDER, _ELBOW, _WRIST = 0.15, 0.10, 0.03, 0.02, 0.01  # armatures

_MATERIALS = {
    "shell": {"rgba": [0.93, 0.94, 0.96, 1], "specular": 0.6, "shininess": 0.7},
    "frame": {"rgba": [0.16, 0.17, 0.20, 1], "specular": 0.4, "shininess": 0.5},
    "visor": {"rgba": [0.04, 0.05, 0.08, 1], "specular": 1.0, "shininess": 1.0},
    "light": {"rgba": [0.15, 0.75, 0.95, 1], "emission": 0.8},
}


@cache
def robot_body() -> Body:
    """Return the robot: 38 hinges on a free base, of which 30 are driven and 8 held at zero.

    Example:
        >>> len(robot_body().driven_names)
        30
    """
    return load_body("robot", held=HELD)


def build_robot() -> Any:
    """Draw the robot; returns a ``dm_control.mjcf`` model."""
    root = empty_model("robot", _MATERIALS)
    pelvis = add_part(
        root.worldbody, "pelvis", (0, 0, HIP_HEIGHT_M), (), 9.0, (0, 0, 0.05), (0.18, 0.26, 0.18)
    )
    pelvis.add("freejoint", name="base")
    ellipsoid(pelvis, (0, 0, 0.035), (0.095, 0.135, 0.085), "shell")
    cylinder(pelvis, (0, 0, 0.09), (0, 0, 0.19), 0.07, "frame")
    for y in (0.09, -0.09):
        cylinder(pelvis, (-0.05, y, 0), (0.06, y, 0), 0.052, "frame")
    chest = _chest(pelvis)
    _head(chest)
    for side in "lr":
        _arm(chest, side)
    for side in "lr":
        _leg(pelvis, side)
    return root


def _chest(pelvis: Any) -> Any:
    hinges = [Hinge("waist_yaw", Z, -60, 60, _HIP)]
    chest = add_part(
        pelvis, "chest", (0, 0, 0.2045), hinges, 22.0, (0, 0, 0.14), (0.20, 0.30, 0.36)
    )
    ellipsoid(chest, (0.0, 0, 0.02), (0.085, 0.12, 0.075), "frame")
    ellipsoid(chest, (0.0, 0, 0.175), (0.105, 0.155, 0.135), "shell")
    ellipsoid(chest, (0.025, 0, 0.185), (0.09, 0.115, 0.09), "shell")
    capsule(chest, (0, -0.115, 0.25), (0, 0.115, 0.25), 0.055, "shell")
    box(chest, (-0.095, 0, 0.17), (0.03, 0.085, 0.10), "frame")
    cylinder(chest, (0.109, 0, 0.185), (0.117, 0, 0.185), 0.022, "light")
    capsule(chest, (0, 0, 0.27), (-0.005, 0, 0.34), 0.038, "frame")
    return chest


def _head(chest: Any) -> None:
    hinges = [
        Hinge("neck_yaw", Z, -80, 80, _WRIST),
        Hinge("neck_pitch", Y, -65, 60, _WRIST),
        Hinge("neck_roll", X, -40, 40, _WRIST),
    ]
    head = add_part(
        chest, "head", (-0.01, 0, 0.33), hinges, 4.0, (0.01, 0, 0.10), (0.16, 0.14, 0.20)
    )
    ellipsoid(head, (0.01, 0, 0.118), (0.098, 0.083, 0.113), "shell")
    ellipsoid(head, (0.034, 0, 0.108), (0.079, 0.070, 0.082), "visor")
    for y in (0.028, -0.028):
        ellipsoid(head, (0.1045, y, 0.118), (0.006, 0.010, 0.012), "light")
    for y in (0.079, -0.079):
        cylinder(head, (0.005, y - 0.008, 0.11), (0.005, y + 0.008, 0.11), 0.028, "frame")
    head.add("site", name="head_top", pos=[0.01, 0, 0.231])


def _arm(chest: Any, side: str) -> None:
    out = 1.0 if side == "l" else -1.0
    turn, rise = np.radians((SHOULDER_TURN_DEG, SHOULDER_RAISE_DEG))
    pitch_axis = (
        -out * np.sin(turn) * np.cos(rise),
        np.cos(turn) * np.cos(rise),
        out * np.sin(rise),
    )
    roll = (-75, 95) if side == "l" else (-95, 75)
    hinges = [
        Hinge(f"shoulder_pitch_{side}", pitch_axis, -230, 100, _SHOULDER),
        Hinge(f"shoulder_roll_{side}", (np.cos(turn), out * np.sin(turn), 0), *roll, _SHOULDER),
        Hinge(f"shoulder_yaw_{side}", Z, -150, 150, _SHOULDER),
    ]
    arm = add_part(
        chest,
        f"upper_arm_{side}",
        (0, 0.165 * out, 0.2508),
        hinges,
        2.2,
        (0, 0, -0.13),
        (0.09, 0.09, 0.33),
    )
    ellipsoid(arm, (0, 0.012 * out, 0.005), (0.062, 0.058, 0.066), "shell")
    capsule(arm, (0, 0, -0.05), (0, 0, -0.26), 0.041, "shell")
    cylinder(arm, (0, -0.042, -0.307), (0, 0.042, -0.307), 0.038, "frame")
    hinges = [
        Hinge(f"elbow_{side}", Y, -150, 0, _ELBOW),
        Hinge(f"wrist_yaw_{side}", Z, -100, 100, _WRIST),
    ]
    forearm = add_part(
        arm, f"forearm_{side}", (0, 0, -0.307), hinges, 1.6, (0, 0, -0.1), (0.07, 0.07, 0.26)
    )
    capsule(forearm, (0, 0, -0.045), (0, 0, -0.19), 0.036, "shell")
    cylinder(forearm, (0, 0, -0.20), (0, 0, -0.241), 0.026, "frame")
    hinges = [
        Hinge(f"wrist_pitch_{side}", Y, -45, 45, _WRIST),
        Hinge(f"wrist_roll_{side}", X, -80, 80, _WRIST),
    ]
    hand = add_part(
        forearm, f"hand_{side}", (0, 0, -0.241), hinges, 0.5, (0, 0, -0.05), (0.08, 0.03, 0.10)
    )
    ellipsoid(hand, (0, 0, -0.045), (0.04, 0.021, 0.05), "shell")
    capsule(hand, (0.028, -0.006 * out, -0.03), (0.045, -0.016 * out, -0.075), 0.011, "frame")
    for i, x in enumerate((0.025, 0.0, -0.025), start=1):
        low, high = (-90, 5) if side == "l" else (-5, 90)
        finger = add_part(
            hand,
            f"finger_{i}_{side}",
            (x, 0, -0.088),
            [Hinge(f"finger_{i}_{side}", X, low, high, 0.002)],
            0.05,
            (0, 0, -0.035),
            (0.02, 0.02, 0.08),
        )
        capsule(finger, (0, 0, 0.0), (0, 0, -0.065), 0.0105, "frame")


def _leg(pelvis: Any, side: str) -> None:
    out = 1.0 if side == "l" else -1.0
    roll = (-30, 60) if side == "l" else (-60, 30)
    hinges = [
        Hinge(f"hip_yaw_{side}", Z, -60, 60, _HIP),
        Hinge(f"hip_roll_{side}", X, *roll, _HIP),
        Hinge(f"hip_pitch_{side}", Y, -140, 45, _HIP),
    ]
    thigh = add_part(
        pelvis, f"thigh_{side}", (0, 0.09 * out, 0), hinges, 5.2, (0, 0, -0.17), (0.13, 0.13, 0.40)
    )
    capsule(thigh, (0, 0.004 * out, -0.075), (0.002, 0, -0.31), 0.066, "shell")
    cylinder(thigh, (0, -0.056, -0.40), (0, 0.056, -0.40), 0.05, "frame")
    shank = add_part(
        thigh,
        f"shank_{side}",
        (0, 0, -0.40),
        [Hinge(f"knee_{side}", Y, 0, 150, _HIP)],
        3.0,
        (0, 0, -0.17),
        (0.11, 0.11, 0.40),
    )
    capsule(shank, (0.004, 0, -0.085), (0.0, 0, -0.30), 0.051, "shell")
    ellipsoid(shank, (-0.014, 0, -0.15), (0.055, 0.05, 0.10), "shell")
    cylinder(shank, (0, 0, -0.33), (0, 0, -0.39), 0.034, "frame")
    hinges = [
        Hinge(f"ankle_pitch_{side}", Y, -45, 60, _ANKLE),
        Hinge(f"ankle_roll_{side}", X, -35, 35, _ANKLE),
    ]
    foot = add_part(
        shank, f"foot_{side}", (0, 0, -0.40), hinges, 1.2, (0.025, 0, -0.055), (0.22, 0.10, 0.06)
    )
    sole, half = (0.03, 0.0, -0.065), (0.12, 0.055, 0.02)
    foot.add(
        "geom",
        name=f"sole_{side}",
        type="box",
        pos=list(sole),
        size=list(half),
        group=COLLIDES,
        contype=1,
        conaffinity=1,
        rgba=[0.8, 0.3, 0.3, 0.4],
    )
    add_sole(foot, side, sole, half)
    cylinder(foot, (0, -0.04, 0), (0, 0.04, 0), 0.036, "frame")
    box(foot, (0.0, 0, -0.074), (0.09, 0.053, 0.011), "frame")
    capsule(foot, (-0.052, 0, -0.047), (0.06, 0, -0.047), 0.037, "shell")
    toes = add_part(
        foot,
        f"toes_{side}",
        (0.09, 0, -0.065),
        [Hinge(f"toe_{side}", Y, -60, 30, 0.005)],
        0.15,
        (0.03, 0, 0),
        (0.06, 0.10, 0.04),
    )
    box(toes, (0.029, 0, -0.009), (0.03, 0.053, 0.011), "frame")
    ellipsoid(toes, (0.008, 0, 0.004), (0.05, 0.045, 0.022), "shell")

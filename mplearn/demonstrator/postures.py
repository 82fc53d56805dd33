"""The key postures between which a primitive moves, as data: values of channels.

A posture is what differs from upright standing with hanging arms (`STAND`); signs are those of the
body's joints (a negative shoulder pitch raises the arm forward, a negative elbow flexes it).
"""

from __future__ import annotations

from collections.abc import Mapping

from .channels import both_sides, mirrored
from .gymnastics import CHANGES, KNEE_L, PLACES

_STAND = both_sides(
    {
        "shoulder_pitch_l": 0.04,
        "shoulder_roll_l": 0.13,
        "shoulder_yaw_l": -0.15,
        "elbow_l": -0.28,
        "forearm_yaw_l": -0.1,
        "neck_pitch": 0.04,
        "crouch": 0.004,
        "pelvis_x": 0.01,
        "foot_y_l": 0.015,
        "foot_yaw_l": 0.10,
    }
)

_ARM_UP_L = PLACES["up"]
_GUARD = both_sides(
    {
        "clavicle_protraction_l": -0.15,
        "shoulder_pitch_l": -0.72,
        "shoulder_roll_l": 0.18,
        "shoulder_yaw_l": -0.18,
        "elbow_l": -2.05,
        "forearm_yaw_l": -0.3,
        "lumbar_pitch": 0.06,
        "thorax_pitch": 0.06,
        "neck_pitch": 0.02,
        "crouch": 0.018,
    }
)
_PUNCH_L = {
    **_GUARD,
    "clavicle_protraction_l": -0.35,
    "shoulder_pitch_l": -1.50,
    "shoulder_roll_l": 0.40,
    "shoulder_yaw_l": -0.15,
    "elbow_l": -0.15,
    "forearm_yaw_l": -1.0,
    "lumbar_yaw": -0.38,
    "pelvis_yaw": -0.16,
    "neck_yaw": 0.45,
    "pelvis_x": 0.035,
}
_BOW = both_sides(
    {
        "pelvis_pitch": 0.62,
        "lumbar_pitch": 0.36,
        "thorax_pitch": 0.20,
        "neck_pitch": 0.10,
        "pelvis_x": -0.125,
        "crouch": 0.010,
        "shoulder_pitch_l": -0.72,
        "elbow_l": -0.25,
    }
)
_SQUAT = both_sides(
    {
        "crouch": 0.24,
        "pelvis_x": -0.13,
        "pelvis_pitch": 0.48,
        "lumbar_pitch": 0.16,
        "neck_pitch": -0.30,
        "shoulder_pitch_l": -1.90,
        "shoulder_roll_l": 0.10,
        "elbow_l": -0.35,
    }
)
_KICK_L = {
    "foot_x_l": 0.72,
    "foot_z_l": 0.40,
    "foot_pitch_l": -0.75,
    "pelvis_y": -0.122,
    "pelvis_pitch": -0.14,
    "pelvis_roll": 0.03,
    "pelvis_yaw": -0.10,
    "lumbar_pitch": 0.16,
    "lumbar_roll": -0.05,
    "lumbar_yaw": 0.12,
    "crouch": 0.014,
    "shoulder_pitch_l": 0.30,
    "shoulder_roll_l": 0.32,
    "shoulder_pitch_r": -0.45,
    "shoulder_roll_r": -0.30,
    "elbow_l": -0.45,
    "elbow_r": -0.60,
}
_MARCH_L = {
    **KNEE_L,
    "shoulder_pitch_r": -0.60,
    "elbow_r": -0.95,
    "shoulder_pitch_l": 0.32,
    "elbow_l": -0.50,
}
_TWIST_L = {
    "lumbar_yaw": 0.55,
    "pelvis_yaw": 0.22,
    "neck_yaw": 0.30,
    "shoulder_pitch_l": 0.25,
    "shoulder_roll_l": 0.45,
    "shoulder_pitch_r": -0.65,
    "elbow_l": -0.55,
    "elbow_r": -0.75,
}
_SIDES = both_sides(PLACES["side"])
_WAVE_R = {
    "clavicle_elevation_r": -0.15,
    "shoulder_pitch_r": -0.35,
    "shoulder_roll_r": -1.20,
    "shoulder_yaw_r": -1.35,
    "elbow_r": -1.75,
}

_PAPER: Mapping[str, Mapping[str, float]] = {
    "stand": {},
    "both arms up": both_sides({**_ARM_UP_L, "lumbar_pitch": -0.10, "neck_pitch": -0.10}),
    "left arm up": {**_ARM_UP_L, "lumbar_roll": -0.05, "neck_yaw": 0.06},
    "right arm up": mirrored({**_ARM_UP_L, "lumbar_roll": -0.05, "neck_yaw": 0.06}),
    "guard": _GUARD,
    "left punch": _PUNCH_L,
    "right punch": mirrored(_PUNCH_L),
    "bow": _BOW,
    "squat": _SQUAT,
    "left kick": _KICK_L,
    "right kick": mirrored(_KICK_L),
    "left march": _MARCH_L,
    "right march": mirrored(_MARCH_L),
    "left twist": _TWIST_L,
    "right twist": mirrored(_TWIST_L),
    "arms at the sides": _SIDES,
    "right hand up": _WAVE_R,
    "right hand out": {**_WAVE_R, "shoulder_yaw_r": -1.25, "elbow_r": -0.95, "lumbar_roll": 0.04},
}

STAND: Mapping[str, float] = _STAND
POSTURES: Mapping[str, Mapping[str, float]] = {
    name: {**_STAND, **changes} for name, changes in {**_PAPER, **CHANGES}.items()
}

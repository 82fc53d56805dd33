"""The channels in which the demonstrator plans its motions.

The upper body is planned in joint angles [rad]. The pelvis and the feet are planned in space, so
that a foot which stands cannot slide: the leg joints follow from them (see `stance`). Lengths of
these are in leg lengths, so that a plan fits any body:

* ``pelvis_x``, ``pelvis_y``: how far the middle of the hips is ahead of, and left of, the middle
  of the ankles at rest; ``crouch``: by which share the legs are shorter than stretched;
* ``foot_x_*``, ``foot_y_*``, ``foot_z_*``: displacement of an ankle from its place at rest;
* ``foot_pitch_*``, ``foot_yaw_*``: orientation of a foot in space [rad].
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mplearn.recording import FloatArray

TRUNK = (
    "lumbar_pitch", "lumbar_roll", "lumbar_yaw", "thorax_pitch", "thorax_roll",
    "neck_pitch", "neck_roll", "neck_yaw",
)  # fmt: skip
ARM = (
    "clavicle_elevation", "clavicle_protraction", "shoulder_pitch", "shoulder_roll",
    "shoulder_yaw", "elbow", "forearm_yaw", "wrist_pitch", "wrist_roll",
)  # fmt: skip
PELVIS = ("pelvis_x", "pelvis_y", "crouch", "pelvis_roll", "pelvis_pitch", "pelvis_yaw")
FOOT = ("foot_x", "foot_y", "foot_z", "foot_pitch", "foot_yaw")

UPPER_JOINTS = TRUNK + tuple(f"{joint}_{side}" for side in "lr" for joint in ARM)
CHANNELS = UPPER_JOINTS + PELVIS + tuple(f"{name}_{side}" for side in "lr" for name in FOOT)
INDEX: Mapping[str, int] = {name: index for index, name in enumerate(CHANNELS)}

# quantities that change sign in a mirror: everything about x and z, and every y
_ODD = ("roll", "yaw", "elevation", "protraction", "pelvis_y", "foot_y")

# how far a typical marker that the channel moves travels for one unit of it [m]
_LEVERS = {
    "lumbar": 0.45, "thorax": 0.35, "neck": 0.12, "clavicle": 0.2, "shoulder_yaw": 0.2,
    "shoulder": 0.45, "elbow": 0.25, "forearm": 0.05, "wrist": 0.08,
    "pelvis_x": 0.85, "pelvis_y": 0.85, "pelvis_yaw": 0.15, "pelvis": 0.5, "crouch": 0.85,
    "foot_pitch": 0.12, "foot_yaw": 0.12, "foot": 0.6,
}  # fmt: skip


def _lever(channel: str) -> float:
    prefix = max((p for p in _LEVERS if channel.startswith(p)), key=len)
    return _LEVERS[prefix]


LEVERS: FloatArray = np.array([_lever(channel) for channel in CHANNELS])


def mirrored_name(channel: str) -> str:
    """Return the channel of the other side; one without a side is its own mirror image."""
    swap = {"_l": "_r", "_r": "_l"}
    return channel[:-2] + swap[channel[-2:]] if channel[-2:] in swap else channel


def mirrored(values: Mapping[str, float]) -> dict[str, float]:
    """Return a posture seen in a mirror: sides exchanged, sideways quantities negated."""
    return {
        mirrored_name(name): -value if any(part in name for part in _ODD) else value
        for name, value in values.items()
    }


def both_sides(values: Mapping[str, float]) -> dict[str, float]:
    """Complete values of the left side by their mirror image."""
    return {**values, **mirrored(values)}


def as_vector(values: Mapping[str, float]) -> FloatArray:
    """Return the values as a vector over `CHANNELS`, shape (C,), zero where none is given."""
    vector = np.zeros(len(CHANNELS))
    for name, value in values.items():
        vector[INDEX[name]] = value
    return vector

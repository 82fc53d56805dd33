"""Coordinates of OpenSim's full-body models, as inverse kinematics gives them, to a skeleton.

The coordinates are those of Rajagopal's model and of its kin, OpenCap's among them: x ahead, y up,
z to the right; each joint turns about z, then x, then y of its own, on the left with x and y the
other way round. What they do not say, how long the bones are, is that of a person of mean
proportions [Rajagopal2016] [Winter2009].
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...maths.rotations import axis_angle_to_matrix
from ...recording import FloatArray
from ..findings import Findings
from ..placing.space import Space
from .kinematics import joint_positions
from .skeletal import Limbs, SkeletalMotion
from .smpl import STATURE_M, mean_person

# each joint's turns about z, x and y
_MIDDLE = {
    "pelvis": ("pelvis_tilt", "pelvis_list", "pelvis_rotation"),
    "spine1": ("lumbar_extension", "lumbar_bending", "lumbar_rotation"),
    "neck": ("neck_extension", "neck_bending", "neck_rotation"),
}
_SIDED = {
    "hip": ("hip_flexion", "hip_adduction", "hip_rotation"),
    "knee": ("knee_angle", "knee_adduction", ""),
    "ankle": ("ankle_angle", "", ""),
    "foot": ("mtp_angle", "", ""),
    "shoulder": ("arm_flex", "arm_add", "arm_rot"),
    "elbow": ("elbow_flex", "", "pro_sup"),
}
_PLACE = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
_NEEDED = frozenset(
    ("pelvis_tilt", "hip_flexion_r", "hip_flexion_l", "knee_angle_r", "knee_angle_l")
)
_BACKWARD = frozenset(("knee_angle",))  # what bends a joint the other way than z turns it
_ORIGIN_M = np.array([0.071, 0.0, 0.066])  # of the pelvis, between its front spines, from the hips
_SOLE_M = 0.07  # below an ankle; the ball of the foot is lower
_SIZES = (0.6, 1.3)  # against a person of mean stature
_STANDS = 0.2  # of the frames, at least: then a foot is on the floor


def is_whole_body(channels: Sequence[str]) -> bool:
    """Whether channels are the coordinates of a model of a person, legs at least.

    Example:
        >>> is_whole_body(["pelvis_tilt", "knee_angle_r"])
        False
    """
    return {coordinate(channel) for channel in channels} >= _NEEDED


def coordinate(channel: str) -> str:
    """Return the coordinate that a column holds, ``hip_flexion_r``; empty for its speed.

    Example:
        >>> coordinate("/jointset/hip_r/hip_flexion_r/value")
        'hip_flexion_r'
    """
    path, _, what = channel.strip("/").rpartition("/")
    if what in ("value", "speed"):
        return path.rpartition("/")[2] if what == "value" else ""
    return what


def motion_of_coordinates(
    channels: Sequence[str], values: FloatArray, rate_hz: float, findings: Findings
) -> SkeletalMotion:
    """Return how a person of mean proportions moves.

    Args:
        channels: Names of the coordinates, length D.
        values: Angles [rad] and places [m], shape (T, D).
        rate_hz: Frames per second [1/s].
        findings: Where to tell what was found.
    """
    at = {name: values[:, k] for k, channel in enumerate(channels) if (name := coordinate(channel))}
    limbs = mean_person()
    index = {name: k for k, name in enumerate(limbs.names)}
    local = np.broadcast_to(np.eye(3), (len(values), len(limbs.names), 3, 3)).copy()
    used: set[str] = set()

    def turn(names: Sequence[str], side: float) -> FloatArray:
        """Return the turn about z, x and y, in our axes: y is theirs backward, z is theirs y."""
        used.update(name for name in names if name in at)
        about_z, about_x, about_y = (at.get(name, np.zeros(len(values))) for name in names)
        if re.sub("_[lr]$", "", names[0]) in _BACKWARD:
            about_z = -_bending(about_z)
        return np.asarray(
            axis_angle_to_matrix(np.array([0.0, -1.0, 0.0]), about_z)
            @ axis_angle_to_matrix(np.array([1.0, 0.0, 0.0]), side * about_x)
            @ axis_angle_to_matrix(np.array([0.0, 0.0, 1.0]), side * about_y)
        )

    for joint, names in _MIDDLE.items():
        local[:, index[joint]] = turn(names, 1.0)
    for side, letter, sign in (("left", "l", -1.0), ("right", "r", 1.0)):
        # the person's arms are stretched out to the sides, the model's hang
        hang = axis_angle_to_matrix(np.array([sign, 0.0, 0.0]), np.full(1, np.pi / 2))[0]
        for joint, parts in _SIDED.items():
            turned = turn([f"{part}_{letter}" if part else "" for part in parts], sign)
            if joint in ("shoulder", "elbow"):
                turned = turned @ hang if joint == "shoulder" else hang.T @ turned @ hang
            local[:, index[f"{side}_{joint}"]] = turned
    hips = limbs.offsets[index["left_hip"]] * (0.0, 0.0, 1.0)
    size, places = 1.0, np.zeros((len(values), 3))
    depths = _depths(limbs, local, rate_hz)
    places[:, 2] = np.median(depths)
    if all(name in at for name in _PLACE):
        used.update(_PLACE)
        x, y, z = (at[name] for name in _PLACE)
        from_root = (local[:, 0] @ (_ORIGIN_M + hips)[:, None])[..., 0]
        heights = (y - from_root[:, 2]) / np.maximum(depths, 0.1)
        known = heights[~np.isnan(heights)]
        standing = float(np.quantile(known, _STANDS)) if len(known) else 1.0
        size = standing if _SIZES[0] < standing < _SIZES[1] else 1.0
        places = np.stack([x, -z, y], axis=1) - size * from_root
    else:
        findings.warn("there is no place of the pelvis: it is taken to stay where it is")
    findings.note(
        f"coordinates of OpenSim's models, on the bones of a person of mean proportions and "
        f"{size * STATURE_M:.2f} m, whose feet reach the floor: the file holds none"
    )
    findings.leave_out(channel for channel in channels if coordinate(channel) not in used)
    scaled = replace(limbs, offsets=size * limbs.offsets)
    return scaled.motion(local, places, rate_hz, Space(1.0, "z", "x"))


def _depths(limbs: Limbs, local: FloatArray, rate_hz: float) -> FloatArray:
    """Return how far below the root the lower of the soles is, shape (T,) [m]."""
    motion = limbs.motion(local, np.zeros((len(local), 3)), rate_hz, Space(1.0))
    points = joint_positions(motion.joints, motion.values)
    ankles = [limbs.names.index(f"{side}_ankle") for side in ("left", "right")]
    return np.asarray(_SOLE_M - points[:, ankles, 2].min(axis=1))


def _bending(angles: FloatArray) -> FloatArray:
    """Return a knee's angles so that bending is positive: older models have it negative."""
    known = angles[~np.isnan(angles)]
    far = known[np.abs(known).argmax()] if len(known) else 0.0
    return -angles if far < 0.0 else angles

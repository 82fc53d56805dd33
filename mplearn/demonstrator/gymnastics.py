"""A large vocabulary, as data: gymnastics, in which each key posture leads to several others.

The arms go between places (front, side, up, hips, head, chest, curl, back), both alike, one alone
or each its own; from hands on hips the trunk leans and twists, and the knees bend. Each way from
one posture to another is a primitive of its own, and has its way back.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from .channels import both_sides, mirrored

_Posture = Mapping[str, float]

# where the left arm can be; a positive roll lifts it sideways, a negative pitch forward
PLACES: Mapping[str, _Posture] = {
    "front": {"shoulder_pitch_l": -1.50, "shoulder_roll_l": 0.06, "elbow_l": -0.12},
    "side": {"clavicle_elevation_l": 0.12, "shoulder_roll_l": 1.50, "elbow_l": -0.12},
    "up": {
        "clavicle_elevation_l": 0.30,
        "shoulder_pitch_l": -2.60,
        "shoulder_roll_l": 0.14,
        "shoulder_yaw_l": 0.0,
        "elbow_l": -0.20,
        "wrist_pitch_l": -0.10,
    },
    "hips": {
        "shoulder_pitch_l": 0.30,
        "shoulder_roll_l": 0.75,
        "shoulder_yaw_l": -0.75,
        "elbow_l": -1.70,
    },
    "head": {
        "clavicle_elevation_l": 0.15,
        "shoulder_pitch_l": -0.55,
        "shoulder_roll_l": 1.35,
        "shoulder_yaw_l": 1.25,
        "elbow_l": -2.10,
    },
    "chest": {
        "clavicle_protraction_l": -0.12,
        "shoulder_pitch_l": -1.15,
        "shoulder_roll_l": 0.25,
        "shoulder_yaw_l": -0.85,
        "elbow_l": -1.75,
    },
    "curl": {"shoulder_pitch_l": -0.15, "shoulder_roll_l": 0.15, "elbow_l": -2.15},
    "back": {"shoulder_pitch_l": 0.75, "shoulder_roll_l": 0.22, "elbow_l": -0.10},
}


def _arms(left: str | None = None, right: str | None = None) -> dict[str, float]:
    """Return a posture with each arm in its place; an arm without one hangs."""
    return {
        **(PLACES[left] if left else {}),
        **(mirrored(PLACES[right]) if right else {}),
    }


# the left knee is raised, the right leg carries
KNEE_L: _Posture = {
    "foot_x_l": 0.36,
    "foot_z_l": 0.30,
    "foot_pitch_l": 0.22,
    "pelvis_y": -0.116,
    "pelvis_roll": 0.03,
    "lumbar_roll": -0.04,
    "lumbar_yaw": 0.10,
    "crouch": 0.008,
}
_BEND = {
    "crouch": 0.13,
    "pelvis_x": -0.07,
    "pelvis_pitch": 0.24,
    "lumbar_pitch": 0.08,
    "neck_pitch": -0.14,
}
_LEAN_L = {"lumbar_roll": -0.34, "thorax_roll": -0.24, "neck_roll": -0.10}
_TURN_L = {"lumbar_yaw": 0.50, "pelvis_yaw": 0.18, "neck_yaw": 0.34}

CHANGES: Mapping[str, _Posture] = {
    **{
        f"both {place}": both_sides(PLACES[place])
        for place in PLACES
        if place not in ("up", "side")
    },
    **{f"left {place}": _arms(left=place) for place in ("front", "side", "curl", "head")},
    **{f"right {place}": _arms(right=place) for place in ("front", "side", "curl", "head")},
    "left up, right front": _arms("up", "front"),
    "right up, left front": _arms("front", "up"),
    "left up, right side": _arms("up", "side"),
    "right up, left side": _arms("side", "up"),
    "left front, right side": _arms("front", "side"),
    "right front, left side": _arms("side", "front"),
    "hips, lean left": {**_arms("hips", "hips"), **_LEAN_L},
    "hips, lean right": {**_arms("hips", "hips"), **mirrored(_LEAN_L)},
    "hips, turn left": {**_arms("hips", "hips"), **_TURN_L},
    "hips, turn right": {**_arms("hips", "hips"), **mirrored(_TURN_L)},
    "hips, knees bent": {**_arms("hips", "hips"), **_BEND},
    "front, knees bent": {**_arms("front", "front"), **_BEND},
    "side, knees bent": {**both_sides(PLACES["side"]), **_BEND},
    "side, left knee up": {**KNEE_L, **both_sides(PLACES["side"])},
    "side, right knee up": {**mirrored(KNEE_L), **both_sides(PLACES["side"])},
}
"""Key posture -> how it differs from upright standing."""

_WAYS: Mapping[str, tuple[str, ...]] = {
    "stand": (
        "both front", "both hips", "both head", "both chest", "both curl", "both back",
        "left front", "left side", "left curl", "left head",
        "right front", "right side", "right curl", "right head",
        "front, knees bent",
    ),
    "both front": (
        "arms at the sides", "both arms up", "both chest", "both back", "front, knees bent",
        "left up, right front", "right up, left front", "left front, right side",
        "right front, left side",
    ),
    "arms at the sides": (
        "both arms up", "both chest", "both curl", "both head", "side, knees bent",
        "left up, right side", "right up, left side", "side, left knee up", "side, right knee up",
    ),
    "both arms up": ("both head", "both curl"),
    "both hips": (
        "both chest", "hips, lean left", "hips, lean right", "hips, turn left", "hips, turn right",
        "hips, knees bent",
    ),
    "hips, lean left": ("hips, lean right",),
    "hips, turn left": ("hips, turn right",),
    "front, knees bent": ("side, knees bent",),
    "left up, right front": ("right up, left front",),
    "left up, right side": ("right up, left side",),
    "left front, right side": ("right front, left side",),
    "left front": ("left arm up", "left side"),
    "right front": ("right arm up", "right side"),
    "left side": ("left arm up",),
    "right side": ("right arm up",),
}  # fmt: skip


def ways() -> Iterator[tuple[str, str, bool]]:
    """Yield each way from a key posture to another, and whether a foot is lifted or put down."""
    for start, ends in _WAYS.items():
        for end in ends:
            lifted = "knee up" in end
            yield start, end, lifted
            yield end, start, lifted

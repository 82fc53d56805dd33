"""The human as MJCF: 40 hinges on a free pelvis, 1.75 m.

The paper's 40-DoF human model ([Kulic2012], 4.1) is not published; this one has anthropometric
proportions. Segment lengths and joint heights as fractions of stature follow [DrillisContini1966]
as reprinted by Winter, *Biomechanics and Motor Control of Human Movement* (4th ed., table
4.1 and figure 4.1); mass fractions follow Winter's table 4.1 (after Dempster). Hip centres lie
0.36 of the distance between the iliac spines from the middle (Bell et al. 1990). Stated otherwise
nowhere: the split of the spine into lumbar (three hinges) and thoracic (two), and the two
    clavicles.
"""

from __future__ import annotations

from typing import Any

from .mjcf import (
    Hinge,
    X,
    Y,
    Z,
    add_part,
    add_sole,
    box,
    capsule,
    ellipsoid,
    empty_model,
)

HEIGHT_M = 1.75
BODY_MASS_INDEX = 22.5  # kg / m^2, the middle of the normal range (WHO)

# heights above the sole and lengths, as fractions of stature
ANKLE, KNEE, HIP, LUMBAR, THORAX, SHOULDER, NECK = 0.039, 0.285, 0.530, 0.575, 0.660, 0.812, 0.860
HIP_HALF, SHOULDER_HALF, CLAVICLE_INNER = 0.050, 0.100, 0.014
UPPER_ARM, FOREARM, HAND, FOOT = 0.186, 0.146, 0.108, 0.152

MASS = {
    "pelvis": 0.142,
    "abdomen": 0.139,
    "chest": 0.206,
    "clavicle": 0.005,
    "head": 0.081,
    "upper_arm": 0.028,
    "forearm": 0.016,
    "hand": 0.006,
    "thigh": 0.100,
    "shank": 0.0465,
    "foot": 0.0125,
    "toes": 0.002,
}

_MATERIALS = {
    "shirt": {"rgba": [0.20, 0.42, 0.72, 1], "specular": 0.1, "shininess": 0.1},
    "trousers": {"rgba": [0.17, 0.20, 0.30, 1], "specular": 0.1, "shininess": 0.1},
    "skin": {"rgba": [0.87, 0.68, 0.55, 1], "specular": 0.2, "shininess": 0.2},
    "hair": {"rgba": [0.22, 0.15, 0.10, 1], "specular": 0.3, "shininess": 0.3},
    "shoe": {"rgba": [0.92, 0.45, 0.13, 1], "specular": 0.2, "shininess": 0.2},
}


def build_human() -> Any:
    """Draw the human of 1.75 m; returns a ``dm_control.mjcf`` model."""
    h = HEIGHT_M
    total = BODY_MASS_INDEX * h * h
    mass = {part: fraction * total for part, fraction in MASS.items()}
    root = empty_model("human", _MATERIALS)

    pelvis = add_part(
        root.worldbody,
        "pelvis",
        (0, 0, HIP * h),
        (),
        mass["pelvis"],
        (-0.01, 0, 0.04),
        (0.2, 0.3, 0.2),
    )
    pelvis.add("freejoint", name="base")
    ellipsoid(pelvis, (-0.005, 0, 0.03), (0.105, 0.165, 0.105), "trousers")
    abdomen = add_part(
        pelvis,
        "abdomen",
        (0, 0, (LUMBAR - HIP) * h),
        [
            Hinge("lumbar_pitch", Y, -30, 75),
            Hinge("lumbar_roll", X, -35, 35),
            Hinge("lumbar_yaw", Z, -40, 40),
        ],
        mass["abdomen"],
        (0.01, 0, 0.08),
        (0.2, 0.28, 0.18),
    )
    ellipsoid(abdomen, (0.005, 0, 0.06), (0.095, 0.145, 0.12), "shirt")
    chest = add_part(
        abdomen,
        "chest",
        (0, 0, (THORAX - LUMBAR) * h),
        [Hinge("thorax_pitch", Y, -25, 45), Hinge("thorax_roll", X, -25, 25)],
        mass["chest"],
        (0, 0, 0.14),
        (0.2, 0.3, 0.3),
    )
    ellipsoid(chest, (0, 0, 0.14), (0.11, 0.16, 0.19), "shirt")
    capsule(chest, (-0.01, -0.1, 0.26), (-0.01, 0.1, 0.26), 0.06, "shirt")
    capsule(chest, (-0.005, 0, 0.29), (-0.005, 0, 0.37), 0.052, "skin")
    _head(chest, mass)
    for side in "lr":
        _arm(chest, side, mass)
    for side in "lr":
        _leg(pelvis, side, mass)
    return root


def _head(chest: Any, mass: dict[str, float]) -> None:
    h = HEIGHT_M
    head = add_part(
        chest,
        "head",
        (-0.01, 0, (NECK - THORAX) * h),
        [
            Hinge("neck_pitch", Y, -60, 65),
            Hinge("neck_roll", X, -45, 45),
            Hinge("neck_yaw", Z, -80, 80),
        ],
        mass["head"],
        (0.02, 0, 0.11),
        (0.19, 0.15, 0.23),
    )
    ellipsoid(head, (0.02, 0, 0.125), (0.092, 0.076, 0.115), "skin")
    ellipsoid(head, (0.005, 0, 0.142), (0.095, 0.081, 0.103), "hair")
    ellipsoid(head, (0.11, 0, 0.10), (0.017, 0.013, 0.02), "skin")
    head.add("site", name="head_top", pos=[0.01, 0, (1 - NECK) * h])


def _arm(chest: Any, side: str, mass: dict[str, float]) -> None:
    h, out = HEIGHT_M, 1.0 if side == "l" else -1.0

    def span(low: float, high: float) -> tuple[float, float]:
        """Limits about x or z, given for the left: the right side's are their mirror image."""
        return (low, high) if side == "l" else (-high, -low)

    clavicle = add_part(
        chest,
        f"clavicle_{side}",
        (0, CLAVICLE_INNER * h * out, (SHOULDER + 0.008 - THORAX) * h),
        [
            Hinge(f"clavicle_elevation_{side}", X, *span(-12, 45)),
            Hinge(f"clavicle_protraction_{side}", Z, *span(-30, 30)),
        ],
        mass["clavicle"],
        (0, 0.07 * out, 0),
        (0.06, 0.15, 0.04),
    )
    width = (SHOULDER_HALF - CLAVICLE_INNER) * h * out
    capsule(clavicle, (-0.005, 0.3 * width, 0.0), (0, width, -0.008 * h), 0.056, "shirt")
    arm = add_part(
        clavicle,
        f"upper_arm_{side}",
        (0, width, -0.008 * h),
        [
            Hinge(f"shoulder_pitch_{side}", Y, -200, 90),
            Hinge(f"shoulder_roll_{side}", X, *span(-70, 190)),
            Hinge(f"shoulder_yaw_{side}", Z, -180, 180),
        ],
        mass["upper_arm"],
        (0, 0, -0.436 * UPPER_ARM * h),
        (0.09, 0.09, UPPER_ARM * h),
    )
    ellipsoid(arm, (0, 0.006 * out, -0.02), (0.06, 0.056, 0.075), "shirt")
    capsule(arm, (0, 0, -0.04), (0, 0, -0.16), 0.048, "shirt")
    capsule(arm, (0, 0, -0.16), (0, 0, -UPPER_ARM * h), 0.038, "skin")
    forearm = add_part(
        arm,
        f"forearm_{side}",
        (0, 0, -UPPER_ARM * h),
        [Hinge(f"elbow_{side}", Y, -155, 5), Hinge(f"forearm_yaw_{side}", Z, -110, 110)],
        mass["forearm"],
        (0, 0, -0.43 * FOREARM * h),
        (0.07, 0.07, FOREARM * h),
    )
    capsule(forearm, (0, 0, 0), (0, 0, -0.13), 0.037, "skin")
    capsule(forearm, (0, 0, -0.1), (0, 0, -FOREARM * h), 0.029, "skin")
    hand = add_part(
        forearm,
        f"hand_{side}",
        (0, 0, -FOREARM * h),
        [
            Hinge(f"wrist_pitch_{side}", Y, -40, 40),
            Hinge(f"wrist_roll_{side}", X, -80, 80),
        ],
        mass["hand"],
        (0, 0, -0.5 * HAND * h),
        (0.08, 0.03, HAND * h),
    )
    ellipsoid(hand, (0, 0, -0.05), (0.042, 0.019, 0.055), "skin")
    capsule(hand, (0.03, -0.004 * out, -0.03), (0.05, -0.012 * out, -0.085), 0.011, "skin")
    for x in (0.026, 0.009, -0.009, -0.025):
        length = HAND * h - 0.012 - 0.6 * abs(x - 0.005)
        capsule(hand, (x, 0, -0.085), (x, 0, -length), 0.0098, "skin")


def _leg(pelvis: Any, side: str, mass: dict[str, float]) -> None:
    h, out = HEIGHT_M, 1.0 if side == "l" else -1.0
    roll = (-35, 65) if side == "l" else (-65, 35)
    thigh = add_part(
        pelvis,
        f"thigh_{side}",
        (0, HIP_HALF * h * out, 0),
        [
            Hinge(f"hip_yaw_{side}", Z, -60, 60),
            Hinge(f"hip_roll_{side}", X, *roll),
            Hinge(f"hip_pitch_{side}", Y, -140, 45),
        ],
        mass["thigh"],
        (0, 0, -0.433 * (HIP - KNEE) * h),
        (0.15, 0.15, (HIP - KNEE) * h),
    )
    capsule(thigh, (0, 0.004 * out, -0.03), (0, 0, -0.20), 0.082, "trousers")
    capsule(thigh, (0, 0, -0.18), (0, 0, -(HIP - KNEE) * h), 0.062, "trousers")
    shank = add_part(
        thigh,
        f"shank_{side}",
        (0, 0, -(HIP - KNEE) * h),
        [Hinge(f"knee_{side}", Y, -5, 155)],
        mass["shank"],
        (0, 0, -0.433 * (KNEE - ANKLE) * h),
        (0.11, 0.11, (KNEE - ANKLE) * h),
    )
    capsule(shank, (0, 0, 0), (0, 0, -0.34), 0.051, "trousers")
    ellipsoid(shank, (-0.02, 0, -0.13), (0.058, 0.054, 0.11), "trousers")
    capsule(shank, (0, 0, -0.3), (0, 0, -(KNEE - ANKLE) * h), 0.041, "trousers")
    foot = add_part(
        shank,
        f"foot_{side}",
        (0, 0, -(KNEE - ANKLE) * h),
        [
            Hinge(f"ankle_pitch_{side}", Y, -45, 65),
            Hinge(f"ankle_roll_{side}", X, -40, 40),
        ],
        mass["foot"],
        (0.04, 0, -0.035),
        (0.2, 0.08, 0.07),
    )
    heel, ball, tip = -0.06, 0.125, FOOT * h - 0.06
    depth = ANKLE * h
    capsule(foot, (heel + 0.04, 0, 0.036 - depth), (ball - 0.02, 0, 0.03 - depth), 0.036, "shoe")
    ellipsoid(foot, (0.06, 0, 0.042 - depth), (0.075, 0.040, 0.038), "shoe")
    box(foot, (0.5 * (heel + ball), 0, 0.01 - depth), (0.5 * (ball - heel), 0.043, 0.01), "shoe")
    add_sole(
        foot,
        side,
        (0.5 * (heel + tip), 0, 0.01 - depth),
        (0.5 * (tip - heel), 0.045, 0.01),
    )
    toes = add_part(
        foot,
        f"toes_{side}",
        (ball, 0, 0.015 - depth),
        [Hinge(f"toe_{side}", Y, -70, 35)],
        mass["toes"],
        (0.035, 0, 0),
        (0.07, 0.09, 0.025),
    )
    length = tip - ball
    ellipsoid(toes, (0.3 * length, 0, 0.006), (0.7 * length, 0.045, 0.021), "shoe")

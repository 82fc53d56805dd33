"""The marker sets' tables: marker -> (body, offset in its frame on the human of 1.75 m) [m].

Frames: x forward, y left, z up; origins at the joints (pelvis: midway between the hip centres,
chest: the thoracic joint, head: base of the neck, foot: ankle). Palms face the body at rest,
thumbs forward. Landmark heights follow ANSUR (1988) means for men, depths and widths include the
skin and the marker.
"""

from __future__ import annotations

Offset = tuple[float, float, float]
Table = dict[str, tuple[str, Offset]]

# one side's markers are given for the left (name without its L); the right is the mirror image
_TRUNK: Table = {
    "C7": ("chest", (-0.065, 0.0, 0.345)),
    "T10": ("chest", (-0.125, 0.0, 0.120)),
    "CLAV": ("chest", (0.075, 0.0, 0.270)),
    "STRN": ("chest", (0.125, 0.0, 0.110)),
    "RBAK": ("chest", (-0.125, -0.085, 0.225)),
}
_HEAD: Table = {"FHD": ("head", (0.105, 0.075, 0.165)), "BHD": ("head", (-0.075, 0.070, 0.175))}
_ARM: Table = {
    "SHO": ("clavicle_l", (-0.010, 0.140, 0.030)),
    "UPA": ("upper_arm_l", (0.0, 0.060, -0.160)),
    "ELB": ("upper_arm_l", (-0.005, 0.048, -0.318)),
    "FRM": ("forearm_l", (0.0, 0.042, -0.120)),
    "WRA": ("forearm_l", (0.040, 0.012, -0.240)),
    "WRB": ("forearm_l", (-0.038, 0.012, -0.242)),
    "FIN": ("hand_l", (0.010, 0.026, -0.080)),
}
_HIP: Table = {"ASI": ("pelvis", (0.080, 0.125, 0.075)), "PSI": ("pelvis", (-0.110, 0.045, 0.095))}
_LEG: Table = {
    "THI": ("thigh_l", (0.010, 0.090, -0.250)),
    "KNE": ("thigh_l", (0.0, 0.060, -0.420)),
    "TIB": ("shank_l", (0.010, 0.062, -0.200)),
    "ANK": ("shank_l", (-0.005, 0.050, -0.425)),
    "HEE": ("foot_l", (-0.068, 0.0, -0.030)),
    "TOE": ("foot_l", (0.125, 0.010, -0.025)),
    "MT5": ("foot_l", (0.095, 0.050, -0.045)),
}


def _mirrored(entry: tuple[str, Offset]) -> tuple[str, Offset]:
    body, (x, y, z) = entry
    return (f"{body[:-2]}_r" if body.endswith("_l") else body), (x, -y, z)


def _sides(table: Table, left: str = "L{}", right: str = "R{}") -> Table:
    """Return both sides of a table of left markers, all left ones first."""
    return {left.format(name): entry for name, entry in table.items()} | {
        right.format(name): _mirrored(entry) for name, entry in table.items()
    }


def _pairs(table: Table) -> Table:
    """Return both sides, left and right in turn."""
    both = _sides(table)
    return {side + name: both[side + name] for name in table for side in "LR"}


def _only(table: Table, *names: str) -> Table:
    return {name: table[name] for name in names}


_LANDMARKS = _only(_TRUNK, "C7", "T10", "CLAV", "STRN")
_PAPER34 = (
    _pairs(_HEAD)
    | _LANDMARKS
    | _sides(_only(_ARM, "SHO", "UPA", "ELB", "WRA", "WRB", "FIN"))
    | _pairs(_HIP)
    | _sides(_only(_LEG, "KNE", "ANK", "HEE", "TOE", "MT5"))
)
_PLUG_IN_GAIT = (
    _pairs(_HEAD)
    | _TRUNK
    | _sides(_ARM)
    | _pairs(_HIP)
    | _sides(_only(_LEG, "THI", "KNE", "TIB", "ANK", "HEE", "TOE"))
)
_WAIST = {
    f"{side}{cmu}": _PLUG_IN_GAIT[f"{side}{name}"]
    for cmu, name in (("FWT", "ASI"), ("BWT", "PSI"))
    for side in "LR"
}
_CMU_LEG = {
    "THI": ("thigh_l", (0.030, 0.085, -0.250)),
    "KNE": _LEG["KNE"],
    "SHN": ("shank_l", (0.040, 0.045, -0.200)),
    **_only(_LEG, "ANK", "HEE", "MT5", "TOE"),
}
_CMU41 = (
    _WAIST
    | _sides(_CMU_LEG)
    | _only(_TRUNK, "CLAV", "STRN", "C7", "T10")
    | {"RBAC": _TRUNK["RBAK"]}
    | _pairs(_HEAD)
    | _sides(_ARM)
)

# what `mplearn.anatomy` makes of skeletons and of markers with any labels: joints, points that show
# how trunk, head, hands and feet are turned, and landmarks of the skin
_ORIGIN: Offset = (0.0, 0.0, 0.0)
_JOINT_SIDE: Table = {
    "hip": ("pelvis", (0.0, 0.0875, 0.0)),
    "knee": ("thigh_l", (0.0, 0.0, -0.42875)),
    "ankle": ("shank_l", (0.0, 0.0, -0.4305)),
    "heel": ("foot_l", (-0.060, 0.0, -0.055)),
    "ball": ("foot_l", (0.125, 0.0, -0.05325)),
    "shoulder": ("clavicle_l", (0.0, 0.1505, -0.014)),
    "elbow": ("upper_arm_l", (0.0, 0.0, -0.3255)),
    "wrist": ("forearm_l", (0.0, 0.0, -0.2555)),
    "hand": ("hand_l", (0.0, 0.0, -0.100)),
    "thumb_side": ("hand_l", (0.040, 0.0, -0.100)),
    "chest": ("chest", (0.0, 0.100, 0.200)),
    "ear": ("head", (0.0, 0.075, 0.120)),
}
_JOINTS = {
    "pelvis": ("pelvis", _ORIGIN),
    "pelvis_front": ("pelvis", (0.100, 0.0, 0.0)),
    "pelvis_back": ("pelvis", (-0.100, 0.0, 0.0)),
    "lumbar": ("pelvis", (0.0, 0.0, 0.07875)),
    "sternum": ("chest", (0.100, 0.0, 0.200)),
    "back": ("chest", (-0.100, 0.0, 0.200)),
    "neck": ("chest", (-0.010, 0.0, 0.350)),
    "skull": ("head", (0.0, 0.0, 0.090)),
    "face": ("head", (0.100, 0.0, 0.120)),
    "crown": ("head", (0.0, 0.0, 0.235)),
    **_sides(_JOINT_SIDE, "{}_l", "{}_r"),
}
_SKIN = {
    "head_top": ("head", (0.010, 0.0, 0.235)),
    "head_front": ("head", (0.110, 0.0, 0.165)),
    "head_rear": ("head", (-0.085, 0.0, 0.170)),
    "nose": ("head", (0.125, 0.0, 0.100)),
    "c7": _TRUNK["C7"],
    "t2": ("chest", (-0.085, 0.0, 0.290)),
    "t8": ("chest", (-0.130, 0.0, 0.170)),
    "t10": _TRUNK["T10"],
    "l1": ("abdomen", (-0.120, 0.0, 0.120)),
    "l3": ("abdomen", (-0.110, 0.0, 0.050)),
    "l5": ("pelvis", (-0.110, 0.0, 0.105)),
    "jugular_notch": _TRUNK["CLAV"],
    "xiphoid": _TRUNK["STRN"],
    "sacrum": ("pelvis", (-0.112, 0.0, 0.092)),
    **_sides(
        {
            "head_front": _HEAD["FHD"],
            "head_rear": _HEAD["BHD"],
            "head_side": ("head", (0.010, 0.085, 0.165)),
            "eye": ("head", (0.110, 0.032, 0.130)),
            "scapula": ("chest", (-0.125, 0.085, 0.225)),
            "acromion": _ARM["SHO"],
            "shoulder_back": ("clavicle_l", (-0.075, 0.115, 0.000)),
            "upper_arm": _ARM["UPA"],
            "elbow_outer": _ARM["ELB"],
            "elbow_inner": ("upper_arm_l", (-0.005, -0.046, -0.325)),
            "forearm": _ARM["FRM"],
            "wrist_thumb": _ARM["WRA"],
            "wrist_little": _ARM["WRB"],
            "wrist_back": ("forearm_l", (0.0, 0.032, -0.245)),
            "knuckle": _ARM["FIN"],
            "knuckle_index": ("hand_l", (0.035, 0.014, -0.085)),
            "knuckle_little": ("hand_l", (-0.035, 0.012, -0.080)),
            "iliac_front": _HIP["ASI"],
            "iliac_back": _HIP["PSI"],
            "iliac_crest": ("pelvis", (0.015, 0.155, 0.125)),
            "trochanter": ("pelvis", (0.0, 0.170, -0.010)),
            "thigh_outer": _LEG["THI"],
            "thigh_front": ("thigh_l", (0.095, 0.010, -0.250)),
            "knee_outer": _LEG["KNE"],
            "knee_inner": ("thigh_l", (0.0, -0.058, -0.420)),
            "fibula_head": ("shank_l", (-0.010, 0.058, -0.040)),
            "tibia_top": ("shank_l", (0.058, 0.0, -0.060)),
            "shank_outer": _LEG["TIB"],
            "shank_front": ("shank_l", (0.055, 0.0, -0.200)),
            "ankle_outer": _LEG["ANK"],
            "ankle_inner": ("shank_l", (0.005, -0.045, -0.418)),
            "heel_back": _LEG["HEE"],
            "metatarsal1": ("foot_l", (0.120, -0.038, -0.035)),
            "metatarsal2": _LEG["TOE"],
            "metatarsal5": _LEG["MT5"],
            "toe_tip": ("toes_l", (0.075, -0.012, 0.010)),
        },
        "{}_l",
        "{}_r",
    ),
}

TABLES: dict[str, Table] = {
    "paper34": _PAPER34,
    "plug_in_gait39": _PLUG_IN_GAIT,
    "cmu41": _CMU41,
    "landmarks": _JOINTS | _SKIN,
}

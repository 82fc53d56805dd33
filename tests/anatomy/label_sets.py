"""Marker sets as systems label them, and where each marker really is on a person.

Places are (body, offset on the human of 1.75 m), with centimetres of difference from the table that
is tested: nobody glues a marker where a table has it.
"""

from __future__ import annotations

import numpy as np

from mplearn.body import human_body, marker_set
from mplearn.body.models.body import Body
from mplearn.recording import Recording, marker_channels

_HELEN_HAYES = {
    "Top.Head": "head_top",
    "Front.Head": "head_front",
    "Rear.Head": "head_rear",
    "V.Sacral": "sacrum",
    "Sternum": "jugular_notch",
} | {
    f"{side}.{label}": f"{place}_{side.lower()}"
    for side in "LR"
    for label, place in {
        "Shoulder": "acromion",
        "Elbow": "elbow_outer",
        "Wrist": "wrist_back",
        "ASIS": "iliac_front",
        "Thigh": "thigh_outer",
        "Knee": "knee_outer",
        "Knee.Medial": "knee_inner",
        "Shank": "shank_outer",
        "Ankle": "ankle_outer",
        "Ankle.Medial": "ankle_inner",
        "Heel": "heel_back",
        "Toe": "metatarsal2",
    }.items()
}
_JOINT_CENTRES = {"C7": "c7"} | {
    f"{side}{label}": f"{place}_{side}"
    for side in "lr"
    for label, place in {
        "ASIS": "iliac_front",
        "PSIS": "iliac_back",
        "HJC": "hip",
        "KJC": "knee",
        "AJC": "ankle",
        "SJC": "shoulder",
        "EJC": "elbow",
        "WJC": "wrist",
        "HEEL": "heel_back",
        "MTP1": "metatarsal1",
        "MTP5": "metatarsal5",
    }.items()
}
_CAST = {"SJN": "jugular_notch", "SXS": "xiphoid", "CV7": "c7", "TV10": "t10"} | {
    f"{side}_{label}": f"{place}_{side.lower()}"
    for side in "LR"
    for label, place in {
        "IAS": "iliac_front",
        "IPS": "iliac_back",
        "FTC": "trochanter",
        "FLE": "knee_outer",
        "FME": "knee_inner",
        "FAX": "fibula_head",
        "TTC": "tibia_top",
        "FAL": "ankle_outer",
        "TAM": "ankle_inner",
        "FCC": "heel_back",
        "FM1": "metatarsal1",
        "FM2": "metatarsal2",
        "FM5": "metatarsal5",
        "SAE": "acromion",
        "HLE": "elbow_outer",
        "HME": "elbow_inner",
        "RSP": "wrist_thumb",
        "USP": "wrist_little",
        "HM2": "knuckle_index",
        "HM5": "knuckle_little",
        "HEAD": "head_side",
    }.items()
}
_SPORTS = {
    "HeadL": "head_side_l",
    "HeadR": "head_side_r",
    "HeadFront": "head_front",
    "Chest": "xiphoid",
    "SpineTop": "c7",
    "SpineThoracic2": "t2",
    "SpineThoracic12": "l1",
    "WaistBack": "sacrum",
} | {
    label.replace("#", side): f"{place}_{side.lower()}"
    for side in "LR"
    for label, place in {
        "#ShoulderTop": "acromion",
        "#Arm": "upper_arm",
        "#ElbowOut": "elbow_outer",
        "#ElbowIn": "elbow_inner",
        "#WristOut": "wrist_little",
        "#WristIn": "wrist_thumb",
        "#HandOut": "knuckle_little",
        "#HandIn": "knuckle_index",
        "Waist#Front": "iliac_front",
        "#Thigh": "thigh_outer",
        "#KneeOut": "knee_outer",
        "#KneeIn": "knee_inner",
        "#Shin": "shank_front",
        "#AnkleOut": "ankle_outer",
        "#HeelBack": "heel_back",
        "#Forefoot2": "metatarsal2",
        "#Forefoot5": "metatarsal5",
        "#ToeTip": "toe_tip",
    }.items()
}
# as OptiTrack's documentation of Motive's sets places them
_MOTIVE = {
    "HeadTop": "head_top",
    "HeadFront": "head_front",
    "BackTop": "c7",
    "Chest": "jugular_notch",
    "BackLeft": "scapula_l",
    "BackRight": "scapula_r",
} | {
    label.replace("#", side): f"{place}_{side.lower()}"
    for side in "LR"
    for label, place in {
        "#ShoulderTop": "acromion",
        "#ShoulderBack": "shoulder_back",
        "#UArmHigh": "upper_arm",
        "#ElbowOut": "elbow_outer",
        "#WristOut": "wrist_little",
        "#WristIn": "wrist_thumb",
        "#HandOut": "knuckle_little",
        "Waist#Front": "iliac_front",
        "Waist#Back": "iliac_back",
        "#Thigh": "thigh_outer",
        "#KneeOut": "knee_outer",
        "#Shin": "shank_front",
        "#AnkleOut": "ankle_outer",
        "#Heel": "heel_back",
        "#ToeIn": "metatarsal1",
        "#ToeOut": "metatarsal5",
        "#ToeTip": "toe_tip",
    }.items()
}
_OPENCAP = {"C7_study": "c7"} | {
    label.replace("#", side): f"{place}_{side.lower()}"
    for side in "rL"
    for label, place in {
        "#_shoulder_study": "acromion",
        "#_lelbow_study": "elbow_outer",
        "#_melbow_study": "elbow_inner",
        "#_lwrist_study": "wrist_little",
        "#_mwrist_study": "wrist_thumb",
        "#.ASIS_study": "iliac_front",
        "#.PSIS_study": "iliac_back",
        "#_knee_study": "knee_outer",
        "#_mknee_study": "knee_inner",
        "#_ankle_study": "ankle_outer",
        "#_mankle_study": "ankle_inner",
        "#_toe_study": "metatarsal2",
        "#_5meta_study": "metatarsal5",
        "#_calc_study": "heel_back",
    }.items()
}
_OPENPOSE = {"Nose": "nose", "Neck": "shoulders", "midHip": "pelvis"} | {
    f"{side}{label}": f"{place}_{side.lower()}"
    for side in "LR"
    for label, place in {
        "Shoulder": "shoulder",
        "Elbow": "elbow",
        "Wrist": "wrist",
        "Hip": "hip",
        "Knee": "knee",
        "Ankle": "ankle",
        "BigToe": "toe_tip",
        "SmallToe": "metatarsal5",
        "Heel": "heel_back",
    }.items()
}
_MEDIAPIPE = {"nose": "nose"} | {
    f"{word}_{label}": f"{place}_{word[0]}"
    for word in ("left", "right")
    for label, place in {
        "eye": "eye",
        "ear": "ear",
        "shoulder": "shoulder",
        "elbow": "elbow",
        "wrist": "wrist",
        "index": "knuckle_index",
        "pinky": "knuckle_little",
        "hip": "hip",
        "knee": "knee",
        "ankle": "ankle",
        "heel": "heel_back",
        "foot_index": "toe_tip",
    }.items()
}
_BOTH = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
KEY_POINTS = {
    "coco": {"nose": "nose"}
    | {
        f"{word}_{place}": f"{place}_{word[0]}"
        for word in ("left", "right")
        for place in ("eye", "ear", *_BOTH)
    },
    "human36m": {"Hip": "pelvis", "Thorax": "shoulders", "Nose": "nose", "Head": "head_top"}
    | {f"{s}{place.title()}": f"{place}_{s.lower()}" for s in "RL" for place in _BOTH},
    "halpe": {"Nose": "nose", "Head": "head_top", "Neck": "shoulders", "Hip": "pelvis"}
    | {
        f"{side}{label}": f"{place}_{side.lower()}"
        for side in "LR"
        for label, place in {
            **{place.title(): place for place in ("eye", "ear", *_BOTH)},
            "BigToe": "toe_tip",
            "SmallToe": "metatarsal5",
            "Heel": "heel_back",
        }.items()
    },
    "kinect": {"SpineBase": "pelvis", "SpineShoulder": "shoulders", "Neck": "c7", "Head": "skull"}
    | {
        f"{label}{word}": f"{place}_{word[0].lower()}"
        for word in ("Left", "Right")
        for label, place in {
            **{place.title(): place for place in _BOTH},
            "Hand": "hand",
            "Foot": "toe_tip",
        }.items()
    },
    "joints of SMPL": {"pelvis": "pelvis", "neck": "neck", "head": "skull"}
    | {
        f"{word}_{label}": f"{place}_{word[0]}"
        for word in ("left", "right")
        for label, place in {**{place: place for place in _BOTH}, "foot": "ball"}.items()
    },
    "bones": {"Hips": "pelvis", "Neck": "neck", "Head": "skull"}
    | {
        f"{word}{label}": f"{place}_{word[0].lower()}"
        for word in ("Left", "Right")
        for label, place in {
            "Arm": "shoulder",
            "ForeArm": "elbow",
            "Hand": "wrist",
            "UpLeg": "hip",
            "Leg": "knee",
            "Foot": "ankle",
            "ToeBase": "ball",
        }.items()
    },
}
"""Points that are joints or lie on the face, as pose estimators and skeletons name them."""
_PLUG_IN_GAIT = {
    {"RBAK": "RBAK"}.get(label, label): label for label in marker_set("plug_in_gait39").names
}
SETS = {
    "helen_hayes": _HELEN_HAYES,
    "cut": {label[:4]: place for label, place in _HELEN_HAYES.items() if "Medial" not in label},
    "cast": _CAST,
    "joint centres": _JOINT_CENTRES,
    "sports": _SPORTS,
    "motive": _MOTIVE,
    "opencap": _OPENCAP,
    "opencap, joints beside": _OPENPOSE | _OPENCAP,
    "openpose": _OPENPOSE,
    "mediapipe": _MEDIAPIPE,
    "plug_in_gait_virtual": {f"Anna:{label}": place for label, place in _PLUG_IN_GAIT.items()}
    | {f"Anna:{end}{k}": "pelvis" for end in ("PEL", "LFE", "LTI", "LFO") for k in "OALP"},
}


def labelled(
    name: str, body: Body, postures: np.ndarray, rate_hz: float, *, off_m: float = 0.01
) -> Recording:
    """Return what cameras see of markers of a set, each glued up to ``off_m`` from its place."""
    rng = np.random.default_rng(len(name))
    places = []
    labels = (SETS | KEY_POINTS)[name]
    for place in labels.values():
        table = marker_set("plug_in_gait39" if place in _PLUG_IN_GAIT else "landmarks")
        wanted = ("acromion_l", "acromion_r") if place == "shoulders" else (place,)
        if place == "shoulders":
            wanted = ("shoulder_l", "shoulder_r")
        bodies, offsets = table.select(wanted).attach(body.tree, human_body().tree)
        offsets = offsets + rng.uniform(-off_m, off_m, offsets.shape)
        track = np.array([body.tree.points(q, bodies, offsets) for q in postures])
        places.append(track.mean(axis=1))
    frames = np.stack(places, axis=1)
    frames = frames + rng.normal(0, 0.001, frames.shape)
    return Recording(frames.reshape(len(frames), -1), rate_hz, marker_channels(tuple(labels)), name)

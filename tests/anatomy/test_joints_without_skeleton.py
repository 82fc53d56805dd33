"""Joints of a table, of which nobody says what joins them: by the bones they are a person's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_person import RATE_HZ, Truth
from other_formats import limbs_of

from mplearn.anatomy import recognise
from mplearn.anatomy.bones import with_bones
from mplearn.errors import BodyError
from mplearn.recording import Recording, marker_channels

# fmt: off
JOINTS = (
    *("Hips", "Spine", "Spine1", "Neck", "Neck_end"),
    *(f"{s}{j}" for s in ("Left", "Right") for j in ("Shoulder", "Arm", "ForeArm", "Hand")),
    *(f"{s}{j}" for s in ("Left", "Right") for j in ("UpLeg", "Leg", "Foot", "Toe")),
)
_MIDDLE = {
    "LAFAN1": "Hips Spine Spine1 Neck Head",
    "Motive": "Hip Ab Chest Neck Head",
    "Xsens": "Pelvis L5 T8 Neck Head",
    "CMU": "root lowerback thorax lowerneck head",
    "Biped": "Pelvis Spine Spine1 Neck Head",
    "Theia": "pelvis abdomen torso neck head",
    "Chinese": "臀 腰 胸 颈 头",
}
_SIDED = {
    "LAFAN1": ("LeftShoulder LeftArm LeftForeArm LeftHand", "LeftUpLeg LeftLeg LeftFoot LeftToe"),
    "Motive": ("LShoulder LUArm LFArm LHand", "LThigh LShin LFoot LToe"),
    "Xsens": ("LeftShoulder LeftUpperArm LeftForeArm LeftHand",
              "LeftUpperLeg LeftLowerLeg LeftFoot LeftToe"),
    "CMU": ("lclavicle lhumerus lradius lhand", "lfemur ltibia lfoot ltoes"),
    "Biped": ("L_Clavicle L_UpperArm L_Forearm L_Hand", "L_Thigh L_Calf L_Foot L_Toe0"),
    "Theia": ("l_clav l_uarm l_larm l_hand", "l_thigh l_shank l_foot l_toes"),
    "Chinese": ("左肩 左上臂 左前臂 左手", "左大腿 左小腿 左脚 左趾"),
}
# fmt: on


def names_in(dialect: str) -> list[str]:
    middle = _MIDDLE[dialect].split()
    arms, legs = (part.split() for part in _SIDED[dialect])
    other = {"Left": "Right", "L": "R", "l": "r", "左": "右"}
    side = next(word for word in other if arms[0].startswith(word))

    def right(names: list[str]) -> list[str]:
        return [other[side] + name.removeprefix(side) for name in names]

    return [*middle, *arms, *right(arms), *legs, *right(legs)]


@pytest.fixture(scope="module")
def joints(truth: Truth) -> Recording:
    limbs = limbs_of(truth.body, truth.postures)
    points = limbs.places[:, [limbs.names.index(joint) for joint in JOINTS]]
    return Recording(points.reshape(len(points), -1), RATE_HZ, marker_channels(JOINTS), "table")


@pytest.mark.parametrize("noise_m", [0.0, 0.003, 0.005])
@pytest.mark.parametrize("dialect", _MIDDLE)
def test_joints_of_any_names_are_the_person(
    truth: Truth, joints: Recording, dialect: str, noise_m: float
) -> None:
    rng = np.random.default_rng(1)
    order = rng.permutation(len(JOINTS))
    names = [names_in(dialect)[i] for i in order]
    frames = joints.markers[:, order].reshape(len(joints), -1)
    frames = frames + noise_m * rng.normal(size=frames.shape)
    table = replace(joints, frames=np.round(frames, 4), channels=marker_channels(tuple(names)))
    body = recognise(table)
    angles, points_mm = truth.errors(body.apply(table))
    assert np.median(angles) < 3.0 and np.median(points_mm) < 15.0
    assert np.quantile(np.median(angles, axis=0), 0.9) < 6.0  # a thigh taken for a knee is 30 off


def test_bones_are_those_of_the_person(joints: Recording) -> None:
    hanging = with_bones(joints)
    assert hanging is not None and hanging.skeleton is not None
    names, parents = hanging.skeleton.names, hanging.skeleton.parents
    pairs = {frozenset((names[k], names[p])) for k, p in enumerate(parents) if p >= 0}
    for a, b in (("UpLeg", "Leg"), ("Leg", "Foot"), ("Foot", "Toe"), ("Arm", "ForeArm")):
        assert all(frozenset((f"{s}{a}", f"{s}{b}")) in pairs for s in ("Left", "Right"))


@pytest.mark.parametrize("noise_m", [0.001, 0.003])
def test_bones_are_found_in_noise(joints: Recording, noise_m: float) -> None:
    noise = noise_m * np.random.default_rng(0).normal(size=joints.frames.shape)
    hanging = with_bones(replace(joints, frames=joints.frames + noise))
    assert hanging is not None and len(hanging.marker_names) == len(JOINTS)


@pytest.mark.parametrize("noise_m", [0.0, 0.003])
def test_what_was_shuffled_has_no_bones(joints: Recording, noise_m: float) -> None:
    rng = np.random.default_rng(0)
    noisy = joints.markers + noise_m * rng.normal(size=joints.markers.shape)
    tracks = [noisy[:, k] for k in range(noisy.shape[1])]
    late = [np.roll(track, rng.integers(len(noisy)), axis=0) for track in tracks]
    mixed = [track[rng.permutation(len(noisy))] for track in tracks]
    columns = noisy.reshape(len(noisy), -1)[:, rng.permutation(3 * len(JOINTS))]
    for frames in (np.concatenate(late, axis=1), np.concatenate(mixed, axis=1), columns):
        assert with_bones(replace(joints, frames=frames)) is None


def test_without_head_and_neck_the_shoulders_tell(truth: Truth, joints: Recording) -> None:
    kept = [k for k, name in enumerate(JOINTS) if not name.startswith("Neck")]
    frames = joints.markers[:, kept].reshape(len(joints), -1)
    names = marker_channels(tuple(JOINTS[k] for k in kept))
    table = replace(joints, frames=frames, channels=names)
    body = recognise(table)
    assert any("there is no neck" in warning for warning in body.warnings)
    angles, points_mm = truth.errors(body.apply(table))
    assert np.median(angles) < 3.0 and np.median(points_mm) < 15.0


def test_a_joint_that_was_seldom_seen_costs_no_other(truth: Truth, joints: Recording) -> None:
    markers = joints.markers.copy()
    markers[10:, JOINTS.index("LeftToe")] = np.nan
    body = recognise(replace(joints, frames=markers.reshape(len(joints), -1)))
    assert "lumbar" in body.places  # by names alone it would be none
    assert "LeftToe" in body.left_out


def test_who_is_mirrored_is_refused(joints: Recording) -> None:
    mirrored = joints.markers * [1.0, -1.0, 1.0]
    with pytest.raises(BodyError, match="mirrored"):
        recognise(replace(joints, frames=mirrored.reshape(len(joints), -1)))


CALLED = {  # as Kinect's are, which are known by their names where they are noisy
    **dict(zip(("Hips", "Spine", "Neck_end"), ("HipCenter", "Spine", "Head"), strict=True)),
    **{
        f"{side}{joint}": f"{name}{side}"
        for side in ("Left", "Right")
        for joint, name in (
            *(("Arm", "Shoulder"), ("ForeArm", "Elbow"), ("Hand", "Wrist")),
            *(("UpLeg", "Hip"), ("Leg", "Knee"), ("Foot", "Ankle"), ("Toe", "Foot")),
        )
    },
}


@pytest.mark.parametrize("feet", [True, False], ids=["feet", "knees"])
def test_who_is_mirrored_and_noisy_is_refused(joints: Recording, feet: bool) -> None:
    kept = [joint for joint in CALLED if feet or not joint.endswith("Toe")]
    rng = np.random.default_rng(2)
    points = joints.markers[:, [JOINTS.index(joint) for joint in kept]]
    points = points + 0.01 * rng.normal(size=points.shape)
    channels = marker_channels(tuple(CALLED[joint] for joint in kept))
    right = replace(joints, frames=points.reshape(len(points), -1), channels=channels)
    assert "knee_l" in recognise(right).places
    mirrored = points * [1.0, -1.0, 1.0]
    with pytest.raises(BodyError, match=r"left-handed \(Hints\(mirrored="):
        recognise(replace(right, frames=mirrored.reshape(len(points), -1)))


def test_who_lies_prone_for_a_while_is_not_mirrored(joints: Recording) -> None:
    points = joints.markers[:, [JOINTS.index(joint) for joint in CALLED]]
    points[len(points) // 4 :] = points[len(points) // 4 :] @ np.array(
        [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]  # falls on the face
    )
    points += 0.01 * np.random.default_rng(2).normal(size=points.shape)
    channels = marker_channels(tuple(CALLED.values()))
    recognise(replace(joints, frames=points.reshape(len(points), -1), channels=channels))


def test_what_does_not_hang_together_has_no_bones(truth: Truth, joints: Recording) -> None:
    assert with_bones(truth.markers) is None  # on skin
    still = np.repeat(joints.frames[:1], 50, axis=0)
    assert with_bones(replace(joints, frames=still)) is None  # nobody moves
    noise = 0.02 * np.random.default_rng(0).normal(size=joints.frames.shape)
    assert with_bones(replace(joints, frames=joints.frames + noise)) is None
    assert with_bones(joints.sliced(0, 20)) is None


def test_markers_of_who_hardly_moves_are_on_skin(truth: Truth) -> None:
    """Who breathes and sways: what is near keeps its distance to 2 mm, and what is far does not."""
    t = np.arange(500)[:, None, None] / RATE_HZ
    strain = 1.0 + [0.006, 0.006, 0.004] * np.sin(2 * np.pi * t / [3.0, 4.0, 5.0])
    markers = truth.markers.markers[:1] * strain
    assert with_bones(replace(truth.markers, frames=markers.reshape(len(t), -1))) is None

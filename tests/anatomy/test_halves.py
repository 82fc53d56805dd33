"""Skeletons that have arms only, or legs only: what is there is followed, what is not is said."""

from dataclasses import replace

import numpy as np
import pytest
from known_person import SCRIPT, Truth
from rigs import Rig, write_rig

from mplearn.anatomy import recognise
from mplearn.body import MotionObserver, feature_channels, features_of, human_body
from mplearn.demonstrator import Person, demonstrate
from mplearn.errors import BodyError
from mplearn.mocap import Hints, open_recording
from mplearn.recording import Recording, Skeleton, marker_channels

RATE_HZ = 25.0
LEGS, ARMS = ("UpLeg", "Leg", "Foot", "Toe"), ("Shoulder", "Arm", "ForeArm", "Hand")


@pytest.fixture(scope="module")
def truth() -> Truth:
    shown = demonstrate(SCRIPT, seed=4, person=Person(), rate_hz=RATE_HZ)
    return Truth(human_body(), shown.posture.frames, shown.recording)


def without(recording: Recording, words: tuple[str, ...]) -> Recording:
    """Leave out the joints, and their ends, whose names hold one of some words."""
    old = recording.skeleton
    gone = [any(word in name for word in words) for name in old.names]
    for joint, parent in enumerate(old.parents):
        ends = "end" in old.names[joint].lower() and parent >= 0
        gone[joint] |= ends and gone[parent]
    kept = [joint for joint, each in enumerate(gone) if not each]
    skeleton = Skeleton(
        tuple(old.names[j] for j in kept),
        tuple(kept.index(old.parents[j]) if old.parents[j] in kept else -1 for j in kept),
        old.offsets[kept],
        tuple(old.ends[j] for j in kept),
    )
    frames = recording.markers[:, kept].reshape(len(recording), -1)
    return replace(
        recording, frames=frames, channels=marker_channels(skeleton.names), skeleton=skeleton
    )


def read(tmp_path, truth: Truth, rig: Rig) -> Recording:
    path = write_rig(tmp_path / "rig.bvh", truth.body, truth.postures, RATE_HZ, rig)
    return open_recording(path, positions=True, hints=Hints(joint_axes=True))


CASES = {
    "arms": (LEGS, "arms", ("shoulder", "elbow"), ("hip", "knee", "ankle")),
    "arms without a pelvis": ((*LEGS, "Hips"), "arms", ("shoulder", "elbow"), ("hip", "knee")),
    "legs": ((*ARMS, "Neck"), "legs", ("hip", "knee", "ankle"), ("shoulder", "elbow")),
    "legs on a pelvis": ((*ARMS, "Neck", "Spine"), "legs", ("hip", "knee"), ("shoulder", "elbow")),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(
    "rig",
    [Rig(), Rig(zero="A", fingers=True), Rig(zero="bones", order="XYZ", twists=True)],
    ids=str,
)
def test_what_is_there_is_followed(tmp_path, truth, case, rig):
    gone, said, moved, still = CASES[case]
    places = recognise(half := without(read(tmp_path, truth, rig), gone)).apply(half)
    body = recognise(half)
    assert any(f"only {said} are there" in warning for warning in body.warnings)
    assert body.stature_m == pytest.approx(1.75, abs=0.04)
    assert {part.rstrip("_lr") for part in body.unseen} >= (
        {"thigh", "shank", "foot"} if said == "arms" else {"upper_arm", "forearm", "hand", "head"}
    )
    human = human_body()
    found = MotionObserver(places.marker_names, RATE_HZ, human).observe(places.frames)
    wanted, channels = features_of(truth.postures, human), feature_channels(human)
    of = [k for k, name in enumerate(channels) if name.startswith(moved)]
    assert np.degrees(np.median(np.abs(found - wanted)[:, of], axis=0)).max() < 3.0
    held = [k for k, name in enumerate(channels) if name.startswith(still)]
    assert np.degrees(np.ptp(found[:, held], axis=0)).max() < 15.0


def test_two_branches_without_names_are_no_half_of_a_person(tmp_path, truth):
    half = without(read(tmp_path, truth, Rig()), LEGS)
    names = tuple(f"j{k}" for k in range(len(half.skeleton.names)))
    unnamed = replace(
        half, skeleton=replace(half.skeleton, names=names), channels=marker_channels(names)
    )
    with pytest.raises(BodyError, match="names="):
        recognise(unnamed)


@pytest.mark.parametrize("rig", [Rig(), Rig(spine=5, bends=True, zero="hang")], ids=str)
def test_without_a_neck_the_trunk_is_as_long_as_it_is(tmp_path, truth, rig):
    recording = without(read(tmp_path, truth, rig), ("Neck", "Head"))
    body = recognise(recording)
    assert any("there is no neck" in warning for warning in body.warnings)
    assert body.stature_m == pytest.approx(1.75, abs=0.06)
    angles, points = truth.errors(body.apply(recording))
    neck = [k for k, name in enumerate(feature_channels(human_body())[3:]) if "neck" in name]
    assert np.median(np.delete(angles, neck, axis=1)) < 3.0
    assert np.median(points, axis=0)[:-1].max() < 40.0

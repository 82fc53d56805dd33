"""Any skeleton of one person is the same body: written in many dialects, read, recognised."""

import re
from dataclasses import replace

import numpy as np
import pytest
from known_person import Truth
from rigs import NAMES, RIGS, Rig, write_rig

from mplearn.anatomy import recognise
from mplearn.anatomy.joint_tree import rest_positions
from mplearn.body import human_body
from mplearn.demonstrator import Person, demonstrate
from mplearn.errors import BodyError
from mplearn.mocap import Hints, open_recording
from mplearn.recording import Recording, Skeleton, marker_channels

SEGMENTS = {
    "knee": ("shank", "hip"),
    "ankle": ("foot", "knee"),
    "elbow": ("forearm", "shoulder"),
    "wrist": ("hand", "elbow"),
}


def opened(tmp_path, truth, rig):
    hints = {"unit_m": rig.unit_m, "up_axis": rig.up}
    path = write_rig(tmp_path / "rig.bvh", truth.body, truth.postures, 25.0, rig)
    return open_recording(path, positions=True, hints=Hints(joint_axes=True, **hints))


# the human body has no such spine, or no such shoulder, so its truth is not the file's
OTHER_BODY = [rig for rig in RIGS if rig.bends or rig.spine == 1 or "clavicle" in rig.without]


@pytest.mark.parametrize("rig", RIGS, ids=str)
def test_a_person_in_any_dialect_is_the_same_person(tmp_path, truth, rig, record_property):
    recording = opened(tmp_path, truth, rig)
    body = recognise(recording)
    places = body.apply(recording)
    # joints are where they are, sides included
    tree = truth.body.tree
    where = np.array([tree.forward(q)[0] for q in truth.postures[::20]])
    found = places.markers[::20]
    if rig not in OTHER_BODY and not rig.yaw:
        for name, (segment, _) in SEGMENTS.items():
            for side in "lr":
                at = found[:, body.places.index(f"{name}_{side}")]
                error = np.linalg.norm(at - where[:, tree.body(f"{segment}_{side}")], axis=1)
                assert error.max() < 1e-3
    angles, points = truth.errors(places)
    record_property("angles_deg", float(np.median(angles)))
    record_property("points_mm", float(np.median(points)))
    assert np.median(angles) < 1.5
    assert np.median(points, axis=0).max() < 15.0
    assert np.percentile(points, 95) < (40.0 if rig in OTHER_BODY else 15.0)
    assert body.stature_m == pytest.approx(truth.body.height_m, rel=0.05)


@pytest.mark.parametrize("axes", [True, False], ids=["turned", "points"])
@pytest.mark.parametrize("costume", ["staff", "high", "ears", "flag"])
def test_what_rises_above_an_unnamed_head_is_no_head(tmp_path, truth, costume, axes):
    """No name tells the head from what is carried; wings, ears and poles are not like one."""
    path = write_rig(
        tmp_path / "rig.bvh",
        truth.body,
        truth.postures[::3],
        25.0,
        Rig(names="numbers", costume=(costume,)),
    )
    hints = Hints(joint_axes=axes, unit_m=0.01, up_axis="y")
    body = recognise(open_recording(path, positions=True, hints=hints))
    used = {name for _, names in body.parts for name in names}
    assert not [name for name in used if name.startswith(costume)]
    assert body.stature_m == pytest.approx(truth.body.height_m, rel=0.02)


@pytest.mark.parametrize("costume", ["wings", "high"])
def test_what_never_moves_is_no_arm(tmp_path, truth, costume):
    """Wings are longer than arms, and here as like them as arms without hands."""
    rig = Rig(names="numbers", costume=(costume,), without=("ends",))
    path = write_rig(tmp_path / "rig.bvh", truth.body, truth.postures[::3], 25.0, rig)
    body = recognise(open_recording(path, positions=True, hints=Hints(unit_m=0.01, up_axis="y")))
    used = {name for _, names in body.parts for name in names}
    assert not [name for name in used if name.startswith(costume)]


def test_left_and_right_are_told_by_facing_not_by_names(tmp_path, truth):
    """The numbers of `numbers` say nothing; sides are those of the person."""
    body = recognise(opened(tmp_path, truth, Rig(names="numbers", reverse=True)))
    names = NAMES["numbers"]
    for place, part in (("knee", "shank"), ("wrist", "hand")):
        stem = names[part].split("{")[0]
        assert dict(body.parts)[f"{place}_l"] == (f"{stem}a",)
        assert dict(body.parts)[f"{place}_r"] == (f"{stem}b",)


def test_a_mirrored_recording_is_refused_with_the_option(tmp_path, truth):
    recording = opened(tmp_path, truth, Rig())
    flipped = recording.frames.reshape(len(recording), -1, 3) * (1, -1, 1)
    from dataclasses import replace

    mirrored = replace(
        recording,
        frames=flipped.reshape(len(recording), -1),
        skeleton=replace(recording.skeleton, offsets=recording.skeleton.offsets * (1, -1, 1)),
    )
    with pytest.raises(BodyError, match=r"mirrored.*names="):
        recognise(mirrored)


def test_what_is_no_body_is_refused(tmp_path, truth):
    path = tmp_path / "hand.bvh"
    path.write_text(
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n"
        "JOINT b\n{\nOFFSET 0 60 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n"
        "End Site\n{\nOFFSET 0 60 0\n}\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.04\n"
        "0 0 0 0 0 0\n1 0 0 0 0 0\n"
    )
    recording = open_recording(path, positions=True, hints=Hints(joint_axes=True))
    with pytest.raises(BodyError, match="no body in the skeleton"):
        recognise(recording)


@pytest.mark.parametrize("seed", range(3))
def test_people_of_other_proportions(tmp_path, seed):
    rng = np.random.default_rng(seed)
    person = Person.random(rng)
    shown = demonstrate(("BAR", "BAL", "SQD", "SQR"), seed=seed, person=person, rate_hz=25.0)
    longer = {name: float(rng.uniform(0.85, 1.18)) for name in person.proportions}
    body = human_body(float(rng.uniform(1.0, 2.0)), longer)
    path = write_rig(tmp_path / "rig.bvh", body, shown.posture.frames, 25.0, Rig(fingers=True))
    recording = open_recording(path, positions=True, hints=Hints(joint_axes=True))
    angles, points = Truth(body, shown.posture.frames, shown.recording).errors(
        recognise(recording).apply(recording)
    )
    assert np.median(angles) < 3.0 and np.median(points, axis=0).max() < 15.0


def without_joints(recording, word):
    """Leave out joints whose names hold a word."""
    old = recording.skeleton
    kept = [j for j, name in enumerate(old.names) if word not in name]
    skeleton = Skeleton(
        tuple(old.names[j] for j in kept),
        tuple(kept.index(old.parents[j]) if old.parents[j] >= 0 else -1 for j in kept),
        old.offsets[kept],
        tuple(old.ends[j] for j in kept),
    )
    frames = recording.markers[:, kept].reshape(len(recording), -1)
    return replace(
        recording, frames=frames, channels=marker_channels(skeleton.names), skeleton=skeleton
    )


def test_arms_without_wrists_are_not_taken_for_arms(tmp_path, truth):
    path = write_rig(tmp_path / "rig.bvh", truth.body, truth.postures[:100], 25.0, Rig())
    recording = open_recording(path, positions=True)
    with pytest.raises(BodyError, match="missing in its arms"):
        recognise(without_joints(recording, "Hand"))
    found = recognise(without_joints(recording, "Neck"))
    assert any("there is no neck" in warning for warning in found.warnings)


@pytest.mark.parametrize("place", [(0.5, 0.0), (6.0, -1.2), (-20.0, 5.0)], ids=str)
def test_whoever_hangs_on_a_root_where_all_is_counted_from_is_nothing_but_a_person(
    tmp_path, truth, place
):
    rig = Rig()
    path = write_rig(tmp_path / "rig.bvh", truth.body, truth.postures[:60], 25.0, rig)
    alone = open_recording(path, positions=True, hints=Hints(joint_axes=True))
    text, rows = path.read_text().split("Frame Time: ")
    tree, motion = text.replace("ROOT", "JOINT", 1).split("MOTION")
    root = "HIERARCHY\nROOT Reference\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition"
    sword = "JOINT Sword\n{\nOFFSET 300 100 700\nCHANNELS 0\n"
    sword += "End Site\n{\nOFFSET 0 0 80\n}\n}\n}\nMOTION"
    time, *rows = rows.strip().split("\n")
    frames = np.array([row.split() for row in rows], dtype=float)
    frames[:, [2, 0]] += np.array(place) / rig.unit_m  # z ahead, x aside
    rows = ["0 0 0 " + " ".join(f"{x:.6f}" for x in frame) for frame in frames]
    text = tree.replace("HIERARCHY", root) + sword + motion
    path.write_text(text + "\n".join(["Frame Time: " + time, *rows, ""]))
    recording = open_recording(path, positions=True, hints=Hints(joint_axes=True))
    assert (recording.report.up, recording.report.unit_m) == (rig.up, rig.unit_m)
    assert not recording.report.warnings
    ours, theirs = (recognise(r).apply(r).markers for r in (recording, alone))
    np.testing.assert_allclose(ours - theirs - [*place, 0.0], 0.0, atol=2e-3)


LOW_NECK = """Hips - 0 0 0|Chest Hips 0 36 0|Neck Chest 0 15 0|Head Neck 0 8 1|Crown Head 0 15 0
LArm Chest 18 12 0|LElbow LArm 27 0 0|LHand LElbow 25 0 0|LThumb LHand 9 0 0
RArm Chest -18 12 0|RElbow RArm -27 0 0|RHand RElbow -25 0 0|RThumb RHand -9 0 0
LLeg Hips 9 -3 0|LKnee LLeg 0 -42 0|LFoot LKnee 0 -41 0|LToe LFoot 0 -6 13
RLeg Hips -9 -3 0|RKnee RLeg 0 -42 0|RFoot RKnee 0 -41 0|RToe RFoot 0 -6 13"""


@pytest.mark.parametrize(("called", "found"), [("Neck", "Neck"), ("C7", "Head")])
def test_of_two_joints_that_may_be_the_neck_it_is_the_one_that_alone_is_called_so(called, found):
    rows = [row.split() for row in re.split(r"[|\n]", LOW_NECK.replace("Neck", called))]
    names = tuple(name for name, *_ in rows)
    parents = tuple(names.index(parent) if parent in names else -1 for _, parent, *_ in rows)
    offsets = np.array([row[2:] for row in rows], dtype=float)[:, [2, 0, 1]] / 100
    ends = tuple(name in ("Crown", "LThumb", "RThumb", "LToe", "RToe") for name in names)
    skeleton = Skeleton(names, parents, offsets, ends)
    places = rest_positions(skeleton) + np.array((0.0, 0.0, 0.92))
    frames = np.tile(places.ravel(), (30, 1))
    recording = Recording(frames, 30.0, marker_channels(names), "low neck", skeleton=skeleton)
    assert dict(recognise(recording).parts)["neck"] == (found,)

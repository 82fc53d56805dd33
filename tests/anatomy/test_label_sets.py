"""Markers with the labels of other systems are the same person."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from label_sets import KEY_POINTS, SETS, labelled

from mplearn.anatomy import as_bodies, recognise
from mplearn.anatomy.labels import landmarks_of
from mplearn.body.marker_sets.marker_set import WATCHED_SHARE
from mplearn.errors import BodyError
from mplearn.learner import FramesLost, LearnerConfig, MotionLearner, SegmentClosed
from mplearn.mocap import command_line
from mplearn.recording import marker_channels


@pytest.mark.parametrize("name", SETS)
def test_labels_of_any_system_are_the_same_person(truth, name):
    recording = labelled(name, truth.body, truth.postures, 25.0)
    body = recognise(recording)
    for place, (label,) in body.parts:
        if name != "plug_in_gait_virtual":
            assert SETS[name][label] == place
    assert len(body.places) >= 20
    angles, points = truth.errors(body.apply(recording))
    assert np.median(angles) < 3.0
    assert np.median(points) < 15.0


@pytest.mark.parametrize("noise_m", [0.0, 0.003])
@pytest.mark.parametrize("name", KEY_POINTS)
def test_key_points_are_the_same_person(truth, name, noise_m):
    """A head may be its top or its middle, a foot the ankle or the toes, a hand the wrist."""
    recording = labelled(name, truth.body, truth.postures, 25.0, off_m=0.0)
    noise = noise_m * np.random.default_rng(0).normal(size=recording.frames.shape)
    noisy = replace(recording, frames=recording.frames + noise)
    body = recognise(noisy)
    assert not {"thigh_l", "shank_r", "upper_arm_r", "forearm_l"} & set(body.unseen)
    for place, (label, *_) in body.parts:
        assert KEY_POINTS[name][label] in (place, "c7" if place == "neck" else "head_top")
    angles, points = truth.errors(body.apply(noisy))
    assert np.median(angles) < 3.0
    assert np.median(points) < 15.0


@pytest.mark.parametrize("rise", [0.6, 1.0])
def test_the_middle_of_a_neck_is_not_its_base(truth, rise):
    """Depth cameras have a point there; it bent the trunk by 20 deg."""
    recording = labelled("kinect", truth.body, truth.postures, 25.0, off_m=0.0)
    at = recording.marker_names.index
    markers = recording.markers.copy()
    shoulders = markers[:, [at("ShoulderLeft"), at("ShoulderRight")]].mean(axis=1)
    base = shoulders + 0.5 * (markers[:, at("Head")] - shoulders)
    markers[:, at("Neck")] = base + rise * (markers[:, at("Head")] - base)
    high = replace(recording, frames=markers.reshape(len(markers), -1))
    body = recognise(high)
    assert "Neck" in body.left_out
    angles, points = truth.errors(body.apply(high))
    assert np.median(angles) < 3.0 and np.median(points) < 15.0


def test_points_that_lie_on_each_other_end_nothing(truth):
    recording = labelled("joints of SMPL", truth.body, truth.postures[:5], 25.0, off_m=0.0)
    one = np.repeat(recording.markers[:, :1], len(recording.marker_names), axis=1)
    with suppress(BodyError):
        recognise(replace(recording, frames=one.reshape(5, -1)))
    names = recording.marker_names
    for pair in (("left_ankle", "left_knee"), ("left_foot", "left_ankle"), ("head", "neck")):
        markers = recording.markers.copy()
        markers[:, names.index(pair[0])] = markers[:, names.index(pair[1])]
        recognise(replace(recording, frames=markers.reshape(5, -1)))


def test_joints_that_keep_their_distances_by_chance_are_known_by_their_names(truth):
    """Who does not bend the trunk: key points hang together as a skeleton that is none."""
    recording = labelled("halpe", truth.body, truth.postures, 25.0, off_m=0.0)
    chance = replace(recording, frames=recording.frames[:120])
    angles, points = replace(truth, postures=truth.postures[:120]).errors(
        recognise(chance).apply(chance)
    )
    assert np.median(angles) < 3.0
    assert np.median(points) < 15.0


@pytest.mark.parametrize("prefix", ["Skeleton_001_", "Anna.", "Anna ", "subject1-"])
@pytest.mark.parametrize("name", ["cast", "helen_hayes", "opencap"])
def test_what_all_labels_begin_with_says_nothing(truth, name, prefix):
    recording = labelled(name, truth.body, truth.postures, 25.0)
    labels = tuple(f"{prefix}{label}" for label in recording.marker_names)
    found = recognise(replace(recording, channels=marker_channels(labels)))
    assert found.places == recognise(recording).places
    assert set(found.points) <= set(labels)


@pytest.mark.parametrize("suffix", ["_walk01", ".Trial 3", " (m)"])
@pytest.mark.parametrize("name", ["cast", "opencap"])
def test_what_all_labels_end_with_says_nothing(truth, name, suffix):
    recording = labelled(name, truth.body, truth.postures, 25.0)
    labels = tuple(f"{label}{suffix}" for label in recording.marker_names)
    found = recognise(replace(recording, channels=marker_channels(labels)))
    assert found.places == recognise(recording).places
    assert set(found.points) <= set(labels)


def test_of_two_people_one_is_used_and_said(truth):
    recording = labelled("cast", truth.body, truth.postures, 25.0)
    names = recording.marker_names
    both = np.concatenate(
        [recording.markers, recording.markers + np.array((1.0, 0.5, 0.0))], axis=1
    )
    labels = (*(f"Anna:{name}" for name in names), *(f"Ben:{name}" for name in names))
    found = recognise(
        replace(recording, frames=both.reshape(len(both), -1), channels=marker_channels(labels))
    )
    assert {point.split(":")[0] for point in found.points} == {"Anna"}
    assert any("'Anna' is used, and not 'Ben'" in warning for warning in found.warnings)


@pytest.mark.parametrize("name", ["helen_hayes", "cast", "sports", "opencap", "mediapipe"])
def test_a_label_on_the_wrong_segment_is_left_out_and_said(truth, name):
    recording = labelled(name, truth.body, truth.postures, 25.0)
    names = list(recording.marker_names)
    knee = next(label for label, place in SETS[name].items() if place.startswith("knee"))
    head = next(label for label, place in SETS[name].items() if place in HEAD)
    i, j = names.index(knee), names.index(head)
    markers = recording.markers.copy()
    markers[:, i] = markers[:, j] + 0.02
    body = recognise(replace(recording, frames=markers.reshape(len(markers), -1)))
    assert knee not in dict(body.parts).values()
    assert knee in body.left_out and any(knee in warning for warning in body.warnings)


HEAD = ("head_top", "head_side_l", "nose", "c7", "head_side_r", "jugular_notch")


def test_labels_that_nobody_knows_are_refused_with_the_option(truth):
    recording = labelled("cast", truth.body, truth.postures, 25.0)
    unknown = replace(
        recording, channels=marker_channels(tuple(f"M{i:03d}" for i in range(len(SETS["cast"]))))
    )
    with pytest.raises(BodyError, match="names="):
        recognise(unknown)
    with command_line(), pytest.raises(BodyError, match="--map"):
        recognise(unknown)
    told = dict(zip(unknown.marker_names, SETS["cast"].values(), strict=True))
    body = recognise(unknown, names=told)
    assert body.places == tuple(SETS["cast"].values())


@pytest.mark.parametrize("name", [name for name in SETS if name != "plug_in_gait_virtual"])
def test_nobody_is_mirrored(truth, name):
    recording = labelled(name, truth.body, truth.postures, 25.0)
    mirrored = recording.markers * (1, -1, 1)
    with pytest.raises(BodyError, match="mirrored"):
        recognise(replace(recording, frames=mirrored.reshape(len(mirrored), -1)))


def test_takes_of_quite_different_systems_are_learned_together(truth):
    names = ("cast", "human36m", "sports", "openpose", "opencap", "motive", "bones")
    takes = [
        labelled(name, truth.body, truth.postures[:150], truth.markers.rate_hz) for name in names
    ]
    without = takes[0].marker_names[1:]  # of which one marker was lost throughout
    lacking = replace(
        takes[0],
        frames=takes[0].frames[:, 3:],
        channels=marker_channels(without),
        name="cast without",
    )
    bodies = as_bodies([*takes, lacking])
    assert not bodies.refused
    channels = {each.name: each.channels for each in bodies.recordings}
    assert channels["cast"] == channels["cast without"]
    learner = MotionLearner(LearnerConfig(bodies.recordings[0].channels, truth.markers.rate_hz))
    for recording in bodies.recordings:
        seen = [not np.isnan(each).all() for each in recording.markers.swapaxes(0, 1)]
        assert np.mean(seen) >= WATCHED_SHARE
        events = [event for part in learner.learn_recording(recording, 50) for event in part]
        assert not [event for event in events if isinstance(event, FramesLost)]
        assert [event for event in events if isinstance(event, SegmentClosed)]


def test_a_last_letter_that_says_lateral_is_no_side():
    labels = ("ARMl", "ARMm", "LELBl", "LELBm", "ASISl", "ASISr", "KNEl", "KNEm", "KNEr")
    found = landmarks_of(labels, "skin")
    assert "ARMl" not in found  # of either arm
    assert found["LELBl"] == ("elbow_outer_l",) and found["LELBm"] == ("elbow_inner_l",)
    assert found["ASISl"] == ("iliac_front_l",) and found["KNEl"] == ("knee_outer_l",)

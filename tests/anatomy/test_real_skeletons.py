"""Recorded skeletons become a body: upright, of the person's size, on the right side."""

from dataclasses import replace

import numpy as np
import pytest
from data_folder import DATA, needs_data
from rigs import Rig, write_rig

from mplearn.anatomy import as_bodies, recognise
from mplearn.body import MotionObserver
from mplearn.mocap import Hints, open_recording

AXES = Hints(joint_axes=True)


@needs_data
@pytest.mark.parametrize("take", ["01_01", "02_05", "13_29", "86_01"])
def test_cmu_skeletons_stand_upright_with_the_left_on_the_left(take):
    recording = open_recording(DATA / "cmu" / f"{take}.amc.gz", positions=True, hints=AXES)
    body = recognise(recording)
    assert set(body.places) >= {"lumbar", "sternum", "neck", "skull", "face", "hand_l", "heel_r"}
    named = dict(body.parts)
    assert named["knee_l"] == ("ltibia",) and named["elbow_r"] == ("rradius",)
    assert named["hip_r"] == ("rfemur",) and named["ankle_l"] == ("lfoot",)
    assert named["shoulder_l"] == ("lhumerus",)
    assert 1.5 < body.stature_m < 1.95 and not body.warnings
    places = body.apply(recording).sliced(0, 240)
    features = MotionObserver(places.marker_names, places.rate_hz).observe(places.frames)
    assert features.shape == (240, 33) and np.isfinite(features).all()
    assert np.abs(features[:, 1:3]).max() < np.radians(45)


@needs_data
def test_takes_join_by_the_places_of_the_body():
    folder = DATA / "cmu"
    takes = [
        open_recording(folder / f"{take}.amc.gz", positions=True, hints=AXES)
        for take in ("13_29", "86_01")
    ]
    bodies = as_bodies(takes)
    assert bodies.recordings[0].channels == bodies.recordings[1].channels
    assert not bodies.refused


def test_legs_that_begin_at_one_point_are_legs(tmp_path, truth):
    """A matchstick man: thighs start in the middle of the pelvis, as some ASF files have them."""
    path = write_rig(tmp_path / "rig.bvh", truth.body, truth.postures[:100], 25.0, Rig())
    recording = open_recording(path, positions=True, hints=AXES)
    points, names = recording.markers.copy(), recording.marker_names
    offsets = recording.skeleton.offsets.copy()
    for hip, knee in (("LeftUpLeg", "LeftLeg"), ("RightUpLeg", "RightLeg")):
        i, j = names.index(hip), names.index(knee)
        offsets[j] += offsets[i]
        offsets[i] = 0.0
        points[:, i] = points[:, 0]
    one = replace(
        recording,
        frames=points.reshape(len(points), -1),
        skeleton=replace(recording.skeleton, offsets=offsets),
    )
    body = recognise(one)
    assert dict(body.parts)["knee_l"] == ("LeftLeg",) and "pelvis" in body.places
    assert "hip_l" not in body.places

"""Recorded skeletons become a body: upright, of the person's size, on the right side."""

import numpy as np
import pytest
from data_folder import DATA, needs_data

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

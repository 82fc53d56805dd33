"""A skeleton's unit and vertical axis are found, whatever joints are called and bones look like."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from known_person import Truth
from rigs import RIGS, Rig, write_rig

from mplearn.body import human_body
from mplearn.errors import RecordingWarning
from mplearn.mocap import open_recording
from mplearn.mocap.skeletons.stature import unit_of_skeleton

PLAIN = [rig for rig in RIGS if not rig.costume]  # who wears wings is as large as in another unit
UNITS_M = (0.01, 1.0, 0.001, 0.0254, 0.0254 / 0.45, 0.1, 0.3048)


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(rig=st.sampled_from(PLAIN), unit_m=st.sampled_from(UNITS_M), up=st.sampled_from("xyz"))
def test_unit_and_axis_of_any_rig(
    tmp_path: Path, truth: Truth, rig: Rig, unit_m: float, up: str
) -> None:
    rig = replace(rig, unit_m=unit_m, up=up)
    path = write_rig(tmp_path / "rig.bvh", truth.body, truth.postures[::8], 25.0, rig)
    # hardly any file has x up: where no name tells who is upright, that is said; else warnings are
    # errors here
    doubt = pytest.warns(RecordingWarning, match="whether x points up is in doubt")
    with doubt if up == "x" and rig.names in ("numbers", "german") else nullcontext():
        report = open_recording(path, positions=True).report
    assert report is not None
    assert report.unit_m == pytest.approx(unit_m)
    assert report.up == up


@pytest.mark.parametrize("unit_m", [0.01, 1.0, 0.001])
@pytest.mark.parametrize("rig", [rig for rig in RIGS if rig.costume])
def test_who_wears_a_costume_is_as_large_as_without(
    tmp_path: Path, truth: Truth, rig: Rig, unit_m: float
) -> None:
    rig = replace(rig, unit_m=unit_m)
    path = write_rig(tmp_path / "rig.bvh", truth.body, truth.postures[::8], 25.0, rig)
    wings = pytest.warns(RecordingWarning, match="nobody is as large")
    with wings if "wings" in rig.costume else nullcontext():
        report = open_recording(path, positions=True).report
    assert report is not None
    assert report.unit_m == unit_m


@pytest.mark.parametrize("stature_m", [0.9, 1.2, 1.5, 1.8, 2.1])
@pytest.mark.parametrize("unit_m", [0.01, 1.0, 0.001])
def test_children_and_giants_keep_the_usual_units(
    tmp_path: Path, truth: Truth, stature_m: float, unit_m: float
) -> None:
    body = human_body(stature_m)
    postures = truth.postures[::20].copy()
    postures[:, 2] *= stature_m / truth.body.height_m
    path = write_rig(tmp_path / "rig.bvh", body, postures, 25.0, Rig(unit_m=unit_m))
    report = open_recording(path, positions=True).report
    assert report is not None
    assert report.unit_m == unit_m


def test_a_hand_an_arm_and_a_cross_have_no_size_of_a_person() -> None:
    finger = [0.0, 9.0, 13.0, 15.5, 17.5]
    names, parents, points = ["wrist"], [-1], [[0.0, 0.0, 0.0]]
    for k in range(5):
        for joint, along in enumerate(finger[1:]):
            parents.append(0 if joint == 0 else len(points) - 1)
            points.append([along, 2.0 * (k - 2), 0.0])
            names.append(f"{k}{joint}")
    hand = np.array([points] * 3)
    assert unit_of_skeleton(hand, parents, 0.01) is None
    assert unit_of_skeleton(hand[:, :5], parents[:5], 0.01) is None
    cross = np.array([[[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]]], dtype=float)
    assert unit_of_skeleton(cross, [-1, 0, 0, 0], 0.01) is None
    assert unit_of_skeleton(np.full((2, 4, 3), np.nan), [-1, 0, 0, 0], 0.01) is None

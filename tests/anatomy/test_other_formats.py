"""The same person in AMC, MVNX and SMPL's poses is the same body as in BVH."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from known_person import RATE_HZ, Truth
from other_formats import limbs_of, write_amc_of, write_mvnx_of, write_smpl_of
from rigs import Rig, write_rig

from mplearn.anatomy import recognise
from mplearn.mocap import Hints, open_recording
from mplearn.recording import Recording

FORMATS = ("BVH", "AMC", "MVNX", "SMPL")


@pytest.fixture(scope="module")
def files(truth: Truth, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("formats")
    limbs = limbs_of(truth.body, truth.postures)
    return {
        "BVH": write_rig(folder / "a.bvh", truth.body, truth.postures, RATE_HZ, Rig()),
        "AMC": write_amc_of(folder / "b.amc", limbs),
        "MVNX": write_mvnx_of(folder / "c.mvnx", limbs, RATE_HZ),
        "SMPL": write_smpl_of(folder / "d.npz", limbs, RATE_HZ),
    }


def opened(path: Path) -> Recording:
    rate_hz = RATE_HZ if path.suffix == ".amc" else None  # which the format cannot say
    return open_recording(path, positions=True, hints=Hints(joint_axes=True, rate_hz=rate_hz))


@pytest.mark.parametrize("format", FORMATS[:-1])  # SMPL's poses have no lengths of bones
def test_joints_are_where_they_are(truth: Truth, files: dict[str, Path], format: str) -> None:
    recording = opened(files[format])
    limbs = limbs_of(truth.body, truth.postures)
    at = dict(zip(recording.marker_names, np.moveaxis(recording.markers, 1, 0), strict=True))
    for joint in (name for name, end in zip(limbs.names, limbs.ends, strict=True) if not end):
        name = "root" if format == "AMC" and joint == "Hips" else joint
        wanted = limbs.places[:, limbs.names.index(joint)]
        assert at[name] == pytest.approx(wanted, abs=2e-5), joint


@pytest.mark.parametrize("format", FORMATS)
def test_it_is_the_same_body(truth: Truth, files: dict[str, Path], format: str) -> None:
    recording = opened(files[format])
    assert recording.report is not None
    assert not recording.report.warnings
    body = recognise(recording)
    angles, points = truth.errors(body.apply(recording))
    assert np.median(angles) < 3.0
    if format != "SMPL":
        assert np.median(points, axis=0).max() < 15.0

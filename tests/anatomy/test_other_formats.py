"""The same person in AMC, MVNX, SMPL's poses and Theia's is the same body as in BVH."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from c3d_poses import write_c3d_poses
from known_person import RATE_HZ, Truth
from other_formats import (
    THEIA_PARTS,
    limbs_of,
    theia_poses,
    write_amc_of,
    write_mot_of,
    write_mvnx_of,
    write_smpl_of,
    write_theia_of,
)
from rigs import Rig, write_rig

from mplearn.anatomy import recognise
from mplearn.errors import RecordingError
from mplearn.mocap import Hints, open_recording
from mplearn.recording import Recording

FORMATS = ("BVH", "AMC", "MVNX", "SMPL", "Theia", "OpenSim")


@pytest.fixture(scope="module")
def files(truth: Truth, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("formats")
    limbs = limbs_of(truth.body, truth.postures)
    return {
        "BVH": write_rig(folder / "a.bvh", truth.body, truth.postures, RATE_HZ, Rig()),
        "AMC": write_amc_of(folder / "b.amc", limbs),
        "MVNX": write_mvnx_of(folder / "c.mvnx", limbs, RATE_HZ),
        "SMPL": write_smpl_of(folder / "d.npz", limbs, RATE_HZ),
        "OpenSim": write_mot_of(folder / "f.mot", limbs, RATE_HZ),
        "Theia": write_theia_of(folder / "e.c3d", limbs, RATE_HZ),
    }


def opened(path: Path) -> Recording:
    rate_hz = RATE_HZ if path.suffix == ".amc" else None  # which the format cannot say
    return open_recording(path, positions=True, hints=Hints(joint_axes=True, rate_hz=rate_hz))


@pytest.mark.parametrize("format", FORMATS[:3])  # SMPL's poses have no lengths of bones
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
    if format not in ("SMPL", "OpenSim"):
        assert np.median(points, axis=0).max() < 15.0


def test_poses_in_a_c3d_file_are_those_that_ezc3d_reads(
    truth: Truth, files: dict[str, Path]
) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    poses = theia_poses(limbs_of(truth.body, truth.postures))
    theirs = ezc3d.c3d(str(files["Theia"]))["data"]["rotations"].transpose(3, 2, 0, 1)
    assert theirs == pytest.approx(poses, abs=1e-3)
    recording = open_recording(files["Theia"])
    at = dict(zip(recording.marker_names, np.moveaxis(recording.markers, 1, 0), strict=True))
    for k, segment in enumerate(THEIA_PARTS):
        if segment in at:
            assert at[segment] == pytest.approx(poses[:, k, :3, 3] / 1000.0, abs=1e-5)
    assert len(at) == len(THEIA_PARTS) - 2  # neither the world, nor the pelvis again
    assert recording.report is not None and recording.report.left_out


def test_older_models_bend_knees_the_other_way(tmp_path: Path, truth: Truth) -> None:
    limbs = limbs_of(truth.body, truth.postures)
    path = write_mot_of(tmp_path / "a.mot", limbs, RATE_HZ)
    plain = open_recording(path, positions=True)
    head, names, *rows = path.read_text().partition("endheader\n")
    heads, *frames = rows[0].splitlines()
    knees = [k for k, name in enumerate(heads.split()) if name.startswith("knee")]
    lines = [heads.replace("hip_flexion_r", "/jointset/hip_r/hip_flexion_r/value")]
    for frame in frames:
        cells = frame.split("\t")
        for k in knees:
            cells[k] = f"{-float(cells[k]):.7f}"
        lines.append("\t".join(cells))
    path.write_text(head + names + "\n".join(lines) + "\n")
    other = open_recording(path, positions=True)
    assert other.frames == pytest.approx(plain.frames)
    angles = open_recording(path)
    assert not angles.is_markers and len(angles.channels) == len(heads.split()) - 1


def test_segments_that_were_not_seen(tmp_path: Path, truth: Truth) -> None:
    limbs = limbs_of(truth.body, truth.postures[:20])
    poses = theia_poses(limbs)
    poses[3:7, 1] = np.nan
    poses[:, 2] = 0.0  # never
    labels = [f"{segment}_4X4" for segment in THEIA_PARTS]
    take = open_recording(
        write_c3d_poses(tmp_path / "a.c3d", poses, labels, rate_hz=100.0, ratio=2)
    )
    assert (take.rate_hz, len(take)) == (100.0, 20)
    assert "torso" not in take.marker_names
    head = take.markers[:, take.marker_names.index("head")]
    assert np.flatnonzero(np.isnan(head).any(axis=1)).tolist() == [3, 4, 5, 6]


def test_shoulders_drawn_aside_one_by_one_from_a_trunk_that_begins_between_them(
    tmp_path: Path, truth: Truth
) -> None:
    limbs = limbs_of(truth.body, truth.postures[:100])
    poses, labels = theia_poses(limbs), list(THEIA_PARTS)
    torso, *shoulders = (labels.index(name) for name in ("torso", "l_uarm", "r_uarm"))
    aside = poses[:, shoulders[0], :3, 3] - poses[:, torso, :3, 3]
    swing = 1.5 * np.sin(np.arange(100) / 8.0)[:, None]
    for side, sign in zip(shoulders, (1.0, -1.0), strict=True):
        poses[:, side, :3, 3] += aside * sign * np.maximum(sign * swing, 0.0)
    poses[:, torso, :3, 3] = sum(poses[:, side, :3, 3] for side in shoulders) / 2
    names = [f"{segment}_4X4" for segment in labels]
    body = recognise(opened(write_c3d_poses(tmp_path / "a.c3d", poses, names, rate_hz=RATE_HZ)))
    assert not body.warnings
    for side in "lr":
        assert dict(body.parts)[f"shoulder_{side}"] == (f"{side}_uarm",)


@pytest.mark.parametrize("labels", [["a", "b"], ["pelvis_4X4", "box_4X4"], []])
def test_poses_of_no_person_are_refused(tmp_path: Path, labels: list[str]) -> None:
    poses = np.tile(np.eye(4), (5, 2, 1, 1))
    path = write_c3d_poses(tmp_path / "a.c3d", poses, labels, rate_hz=100.0)
    with pytest.raises(RecordingError, match="poses of pelvis_4X4"):
        open_recording(path)

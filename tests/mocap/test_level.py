"""Who was seen by a tilted camera is told to lean, and set upright where that is asked for."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from mocap_writers import write_bvh, write_ui_prmd
from scipy.spatial.transform import Rotation

from mplearn.demonstrator import demonstrate
from mplearn.errors import RecordingError, RecordingWarning
from mplearn.mocap import Hints, open_recording
from mplearn.mocap.markers.ui_prmd import PLUG_IN_GAIT_MARKERS
from mplearn.mocap.skeletons.joint_arrays import LAYOUTS
from mplearn.recording import Recording, marker_channels

SAID = r"leans by 2\d deg.*Hints\(level=True\)"


@pytest.fixture(scope="module")
def moving() -> Recording:
    return demonstrate(["SQD", "SQR", "BAR", "BAL"], 4, rate_hz=25.0).recording


def table(path: Path, recording: Recording, turn: Rotation) -> Path:
    points = recording.markers @ turn.as_matrix().T
    head = ",".join(["time", *marker_channels(recording.marker_names)])
    rows = np.column_stack([np.arange(len(points)) / 25.0, points.reshape(len(points), -1)])
    np.savetxt(path, rows, delimiter=",", fmt="%.6f", header=head, comments="")
    path.write_text(path.read_text().replace("nan", ""))
    return path


@pytest.mark.parametrize("axis", "xy")
@pytest.mark.parametrize("by", [-22.0, 22.0])
def test_a_tilted_camera_is_told_and_taken_back(
    tmp_path: Path, moving: Recording, axis: str, by: float
) -> None:
    path = table(tmp_path / "a.csv", moving, Rotation.from_euler(axis, by, degrees=True))
    with pytest.warns(RecordingWarning, match=SAID):
        open_recording(path)
    level = open_recording(path, hints=Hints(level=True, unit_m=1.0, up_axis="z"))
    assert level.report is not None and "turned by 2" in level.report.notes[-1]
    found, wanted = level.markers, moving.markers
    known = ~np.isnan(wanted).any(axis=2)
    away = Rotation.align_vectors(
        (found - np.nanmean(found, axis=1, keepdims=True))[known],
        (wanted - np.nanmean(wanted, axis=1, keepdims=True))[known],
    )[0]
    assert np.degrees(np.arccos(away.as_matrix()[2, 2])) < 4.0  # people stand so straight
    apart = np.linalg.norm(found[:, 1:] - found[:, :1], axis=2)
    assert apart == pytest.approx(
        np.linalg.norm(wanted[:, 1:] - wanted[:, :1], axis=2), abs=1e-5, nan_ok=True
    )


def test_who_stands_on_a_floor_or_bends_is_not_told_to_lean(
    tmp_path: Path, moving: Recording
) -> None:
    path = table(tmp_path / "a.csv", moving, Rotation.identity())
    with warnings.catch_warnings():
        warnings.simplefilter("error", RecordingWarning)
        take = open_recording(path)
    level = open_recording(path, hints=Hints(level=True))
    away = np.linalg.norm(level.markers - take.markers, axis=2)
    assert np.nanmax(away) < 0.15


def test_where_nobody_stands_there_is_nothing_to_go_by(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="nobody is seen to stand straight"):
        open_recording(write_bvh(tmp_path / "a.bvh"), positions=True, hints=Hints(level=True))
    with pytest.raises(RecordingError, match="nobody is seen to stand straight"):
        open_recording(write_bvh(tmp_path / "a.bvh"), hints=Hints(level=True))  # angles


def test_parts_of_a_take_are_turned_as_a_whole(tmp_path: Path, moving: Recording) -> None:
    points = np.zeros((len(moving), len(PLUG_IN_GAIT_MARKERS), 3))
    for k, name in enumerate(PLUG_IN_GAIT_MARKERS):
        if name in moving.marker_names:  # others were never seen
            points[:, k] = np.nan_to_num(moving.markers[:, moving.marker_names.index(name)])
    tilt = Rotation.from_euler("x", 20.0, degrees=True).as_matrix()
    for part, frames in enumerate((slice(0, 60), slice(60, 120)), start=1):
        write_ui_prmd(tmp_path / f"m01_s01_e0{part}_positions.txt", points[frames] @ tilt.T)
    take = open_recording(tmp_path, hints=Hints(level=True))
    with pytest.warns(RecordingWarning, match=SAID):
        plain = open_recording(tmp_path)
    known = ~np.isnan(plain.markers).any(axis=2)
    turn, off = Rotation.align_vectors(take.markers[known], plain.markers[known])
    assert off < 1e-4
    assert np.degrees(turn.magnitude()) == pytest.approx(20.0, abs=6.0)


def test_an_array_seen_from_above(tmp_path: Path) -> None:
    names = LAYOUTS["COCO"].split()
    heights = {"nose": 1.6, "eye": 1.65, "ear": 1.62, "shoulder": 1.4, "elbow": 1.1, "wrist": 0.9}
    heights |= {"hip": 0.9, "knee": 0.48, "ankle": 0.08}
    sides = {"left": 0.1, "right": -0.1}
    stand = np.array(
        [[0.0, sides.get(n.split("_")[0], 0.0), heights[n.split("_")[-1]]] for n in names]
    )
    stand[[7, 8, 9, 10], 1] *= 2.5
    sway = 0.01 * np.sin(np.arange(40) / 5.0)[:, None, None] * stand[:, 2:]
    points = (stand + sway) @ Rotation.from_euler("y", 25.0, degrees=True).as_matrix().T
    np.save(tmp_path / "a.npy", points)
    with pytest.warns(RecordingWarning, match=SAID):
        open_recording(tmp_path / "a.npy", hints=Hints(rate_hz=25.0))

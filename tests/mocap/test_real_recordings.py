"""The real recordings: what their descriptions promise, checked on geometry, not on names."""

from __future__ import annotations

import gzip
import tempfile
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from data_folder import DATA, needs_data
from scipy.spatial.transform import Rotation

from mplearn.errors import RecordingError
from mplearn.mocap import Hints, open_recording, resample, take_names
from mplearn.mocap.skeletons.cmu_humanoid import CMU_COLUMNS
from mplearn.recording import Recording

pytestmark = needs_data
FOLDER = DATA or Path()
SIDED = ["SHO", "UPA", "ELB", "FRM", "WRA", "WRB", "FIN", "ASI", "PSI"]
SIDED += ["THI", "KNE", "TIB", "ANK", "HEE", "TOE"]


def by_name(recording: Recording) -> dict[str, np.ndarray]:
    return dict(zip(recording.marker_names, np.moveaxis(recording.markers, 1, 0), strict=True))


def distance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.linalg.norm(a - b, axis=1)


@pytest.fixture(scope="module")
def ui_prmd() -> tuple[Recording, ...]:
    takes = [f"m{m:02d}_s{s:02d}" for m, s in [(1, 1), (2, 5), (5, 3), (7, 4), (8, 2), (10, 5)]]
    return tuple(open_recording(FOLDER / "ui_prmd", take=take) for take in takes)


def test_takes_are_complete() -> None:
    names = take_names(FOLDER / "ui_prmd")
    assert len(names) == 49
    assert "m03_s03" not in names
    assert len(take_names(FOLDER / "ui_prmd_incorrect")) == 20


def test_a_take_is_read_whole() -> None:
    take = open_recording(FOLDER / "ui_prmd", take="m04_s03")
    assert len(take) == 3608


def test_repetitions_are_one_continuous_take(ui_prmd: tuple[Recording, ...]) -> None:
    for take in ui_prmd:
        assert len(take.labels) == 10
        ends = np.array([label.end for label in take.labels])
        assert ends[-1] == len(take)
        steps = np.nanmedian(np.linalg.norm(np.diff(take.markers, axis=0), axis=2), axis=1)
        assert steps[ends[:-1] - 1].max() < 0.003  # [m] a frame


def test_markers_stand_as_plug_in_gait_names_them(ui_prmd: tuple[Recording, ...]) -> None:
    for take in ui_prmd:
        at = by_name(take)
        whole = ~np.isnan(take.frames).any(axis=1)
        mid = {key: np.median(at[key][whole][:30], axis=0) for key in at}
        left = mid["LASI"] + mid["LPSI"] - mid["RASI"] - mid["RPSI"]
        left /= np.linalg.norm(left)
        front = mid["LASI"] + mid["RASI"] - mid["LPSI"] - mid["RPSI"]
        front /= np.linalg.norm(front)
        assert np.cross(front, left)[2] > 0.8  # so z is up, and left is not right
        for name in SIDED:
            assert (mid[f"L{name}"] - mid[f"R{name}"]) @ left > 0.05
        for side in "LR":
            assert (mid[f"{side}FHD"] - mid[f"{side}BHD"]) @ front > 0.08
            assert (mid[f"{side}TOE"] - mid[f"{side}HEE"])[2] < 0.1
            assert mid[f"{side}TOE"][2] < mid[f"{side}ANK"][2] < mid[f"{side}TIB"][2]
            assert mid[f"{side}TIB"][2] < mid[f"{side}KNE"][2] < mid[f"{side}ASI"][2] + 0.1
            assert mid["C7"][2] < mid[f"{side}FHD"][2]
        assert (mid["CLAV"] - mid["C7"]) @ front > 0.05
        assert (mid["STRN"] - mid["T10"]) @ front > 0.1
        assert mid["T10"][2] < mid["C7"][2]
        assert mid["STRN"][2] < mid["CLAV"][2]
        assert (mid["RBAK"] - mid["T10"]) @ left < 0.0  # on the right shoulder blade
        assert 1.0 < mid["LFHD"][2] < 2.0  # metres


def test_distances_within_a_segment_stay(ui_prmd: tuple[Recording, ...]) -> None:
    rigid = [("LFHD", "RFHD"), ("LFHD", "LBHD"), ("RFHD", "RBHD"), ("LPSI", "RPSI")]
    rigid += [(f"{s}{a}", f"{s}{b}") for s in "LR" for a, b in [("HEE", "TOE"), ("TIB", "ANK")]]
    for take in ui_prmd:
        at = by_name(take)
        for a, b in rigid:
            assert np.nanstd(distance(at[a], at[b])) < 0.012, (take.name, a, b)
        for name_a, name_b in [("HEE", "TOE"), ("TIB", "ANK"), ("FHD", "BHD")]:  # left as right
            left, right = (np.nanmean(distance(at[s + name_a], at[s + name_b])) for s in "LR")
            assert abs(left - right) < 0.05


def test_wrong_performances_are_read_too() -> None:
    take = open_recording(FOLDER / "ui_prmd_incorrect", take="m06_s02", rate_hz=50.0)
    assert [label.label for label in take.labels] == ["m06"] * 10
    assert (take.rate_hz, take.person) == (50.0, "s02")
    assert take.labels[-1].end == len(take)


def test_c3d_markers_are_a_persons() -> None:
    import ezc3d

    recording = open_recording(FOLDER / "c3d")
    theirs = ezc3d.c3d(str(FOLDER / "c3d" / "85_12.c3d"))["data"]["points"][:3]
    assert recording.markers == pytest.approx(theirs.transpose(2, 1, 0) / 1000.0, abs=1e-9)
    assert (recording.name, recording.rate_hz) == ("85_12", 120.0)
    assert recording.frames.shape == (4499, 123)
    assert not any(":" in name for name in recording.marker_names)
    at = by_name(recording)
    assert np.std(distance(at["LFHD"], at["RFHD"])) < 0.01
    assert 1.2 < np.median(at["LFHD"][:, 2]) < 1.9
    assert np.median(at["LTOE"][:, 2]) < 0.2


@pytest.mark.parametrize(("name", "n_frames"), [("86_01", 4579), ("01_01", 2751), ("02_05", 1854)])
def test_cmu_bones_keep_their_length_and_feet_stay_above_ground(name: str, n_frames: int) -> None:
    recording = open_recording(FOLDER / "cmu", take=name, positions=True)
    assert (len(recording), recording.rate_hz, recording.person) == (n_frames, 120.0, name[:2])
    at = by_name(recording)
    for side in "lr":
        for a, b in [("femur", "tibia"), ("tibia", "foot"), ("humerus", "radius")]:
            length = distance(at[side + a], at[side + b])
            assert np.ptp(length) < 1e-9
            assert 0.2 < length[0] < 0.55
    lowest = recording.markers[..., 2].min(axis=1)
    assert np.percentile(lowest, 5) > -0.15
    assert np.median(lowest) < 0.15
    assert 1.3 < np.median(at["head"][:, 2]) < 1.9


def test_cmu_labels() -> None:
    labels = open_recording(FOLDER / "cmu", take="86_01").labels
    assert [s.label for s in labels] == [
        "walk",
        "jump",
        "walk",
        "punch",
        "walk",
        "leg_kick",
        "punch",
    ]
    assert (labels[0].start, labels[-1].end) == (0, 4579)
    exercises = open_recording(FOLDER / "cmu", take="13_29").labels
    assert (exercises[0].start, exercises[0].end) == (0, 468)
    assert exercises[-1].end == 4592
    assert all(a.end == b.start for a, b in pairwise(exercises))


def test_exercises_look_like_their_names() -> None:
    recording = open_recording(FOLDER / "cmu", take="13_29", positions=True)
    at = by_name(recording)
    for label in recording.labels:
        part = slice(label.start + 60, label.end - 60)
        wrists = np.maximum(at["lwrist"][part, 2], at["rwrist"][part, 2])
        if label.label == "JumpJack":  # hands overhead, feet leave the ground
            assert wrists.max() > at["head"][part, 2].max()
        if label.label == "ToeTouchOneHand":
            lowest = np.minimum(at["lhand"][part, 2], at["rhand"][part, 2]).min()
            assert lowest < at["ltibia"][part, 2].max()


@pytest.fixture(scope="module")
def dm_control_qpos() -> tuple[np.ndarray, object]:
    """86_01 as dm_control itself converts it."""
    text = gzip.decompress((FOLDER / "cmu" / "86_01.amc.gz").read_bytes()).decode()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no screen, a file left open
        from dm_control import mujoco
        from dm_control.suite import humanoid_CMU
        from dm_control.suite.utils import parse_amc

        plain = Path(folder) / "86_01.amc"
        plain.write_text(text.replace("\r", "").split("\n1001\n")[0])
        physics = mujoco.Physics.from_xml_string(*humanoid_CMU.get_model_and_assets())
        qpos = parse_amc.convert(str(plain), physics, 1 / 120).qpos.T
    return qpos, physics


def test_angles_are_those_of_dm_control(dm_control_qpos: tuple[np.ndarray, object]) -> None:
    qpos, physics = dm_control_qpos
    recording = open_recording(FOLDER / "cmu", take="86_01")
    rows = physics.named.data.qpos.axes.row  # type: ignore[attr-defined]
    for i, name in enumerate(recording.channels):
        if not name.startswith("root"):
            theirs = np.ravel(qpos[:, rows.convert_key_item(name.replace(".", ""))])
            assert np.cos(recording.frames[:1000, i] - theirs) == pytest.approx(1.0, abs=1e-9)
    root = [recording.channels.index(f"root.t{axis}") for axis in "xyz"]
    ours = recording.frames[:1000, root]
    assert ours == pytest.approx(qpos[:, [1, 0, 2]] * [-1, 1, 1], abs=2e-4)  # 0.056444 rounded


def test_positions_without_asf_are_mujocos(
    dm_control_qpos: tuple[np.ndarray, object], tmp_path: Path
) -> None:
    qpos, physics = dm_control_qpos
    (tmp_path / "86_01.amc.gz").symlink_to((FOLDER / "cmu" / "86_01.amc.gz").resolve())
    recording = open_recording(tmp_path, positions=True)
    to_ours = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for t in range(0, 1000, 97):
        with physics.reset_context():  # type: ignore[attr-defined]
            physics.data.qpos[:] = qpos[t]  # type: ignore[attr-defined]
        for i, name in enumerate(recording.marker_names):
            theirs = to_ours @ physics.named.data.xpos[name]  # type: ignore[attr-defined]
            assert recording.markers[t, i] == pytest.approx(theirs, abs=3e-4)


def test_positions_with_and_without_asf_are_the_same_motion(tmp_path: Path) -> None:
    """The bodies differ in their proportions, the directions of their limbs hardly."""
    (tmp_path / "86_01.amc.gz").symlink_to((FOLDER / "cmu" / "86_01.amc.gz").resolve())
    own = by_name(open_recording(FOLDER / "cmu", take="86_01", positions=True))
    other = by_name(open_recording(tmp_path, positions=True))
    for side in "lr":
        for a, b in [("femur", "tibia"), ("tibia", "foot"), ("humerus", "radius")]:
            u, v = (at[side + b] - at[side + a] for at in (own, other))
            cosine = (u * v).sum(1) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1)
            assert np.median(cosine) > np.cos(np.deg2rad(12.0))


def test_asf_at_rest_equals_the_raw_skeleton() -> None:
    """With all angles zero a bone points where its line in the file says."""
    recording = open_recording(FOLDER / "cmu", take="01_01")
    assert len(recording.channels) == len(CMU_COLUMNS) == 62
    names = {f"{c.joint}.r{'xyz'[c.axis]}" for c in CMU_COLUMNS if c.rotates and not c.of_root}
    assert names == {n for n in recording.channels if not n.startswith("root")}


def test_root_turns_by_the_same_angles_about_the_new_axes() -> None:
    angles = open_recording(FOLDER / "cmu", take="01_01")
    positions = by_name(open_recording(FOLDER / "cmu", take="01_01", positions=True))
    column = {name: angles.frames[:, i] for i, name in enumerate(angles.channels)}
    # the file turns about its x, y, z in turn: our y, z, x
    turn = Rotation.from_euler(
        "yzx", np.stack([column["root.ry"], column["root.rz"], column["root.rx"]], axis=1)
    )
    hips = positions["lfemur"] - positions["rfemur"]
    in_pelvis = turn.inv().apply(hips)
    assert np.ptp(in_pelvis, axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
    assert in_pelvis[0, 1] > 0.1  # the left hip is on the left


def test_a_wrong_unit_is_noticed() -> None:
    with pytest.raises(RecordingError, match="unit_m"):
        open_recording(FOLDER / "ui_prmd", take="m01_s01", hints=Hints(unit_m=1.0))


def test_resampled_markers_follow_the_same_path(ui_prmd: tuple[Recording, ...]) -> None:
    take = ui_prmd[0]
    half, back = resample(take, 50.0), resample(resample(take, 50.0), 100.0)
    assert np.abs(half.frames - take.frames[::2][: len(half)]).max() < 0.004
    assert np.abs(back.frames - take.frames[: len(back)]).max() < 0.004

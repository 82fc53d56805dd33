"""MVNX, SMPL and G1 tables: where the joints are, against scipy's rotations and MuJoCo."""

from __future__ import annotations

import io
import re
import warnings
import zipfile
from pathlib import Path

import mujoco
import numpy as np
import pytest
from data_folder import CASES, needs_cases
from mocap_writers import (
    MVNX_ENDS,
    MVNX_SEGMENTS,
    g1_values,
    mvnx_motion,
    smpl_poses,
    write_g1_csv,
    write_mvnx,
    write_smpl,
)
from scipy.spatial.transform import Rotation

from mplearn.errors import RecordingError, RecordingWarning
from mplearn.mocap import Hints, open_recording
from mplearn.mocap.skeletons.g1 import BASE, G1_JOINTS
from mplearn.recording import Recording


def by_name(recording: Recording) -> dict[str, np.ndarray]:
    return dict(zip(recording.marker_names, np.moveaxis(recording.markers, 1, 0), strict=True))


def turn(recording: Recording, joint: str, order: str) -> Rotation:
    columns = [recording.channels.index(f"{joint}.r{axis}") for axis in order.lower()]
    return Rotation.from_euler(order, recording.frames[:, columns])


# --- MVNX


@pytest.mark.parametrize("version", ["3", "4"])
def test_mvnx_positions_are_the_files_and_ends_hang_on_the_segments(
    tmp_path: Path, version: str
) -> None:
    positions, orientations = mvnx_motion(40, seed=3)
    path = write_mvnx(tmp_path / "walk.mvnx", (positions, orientations), version=version)
    recording = open_recording(path, positions=True)
    assert (recording.person, recording.rate_hz, len(recording)) == ("Anna", 100.0, 40)
    at = by_name(recording)
    assert set(at) == {*MVNX_SEGMENTS, *(f"{name}_end" for name in MVNX_ENDS)}
    for index, name in enumerate(MVNX_SEGMENTS):
        assert at[name] == pytest.approx(positions[:, index], abs=1e-6)
    for name, place in MVNX_ENDS.items():
        index = MVNX_SEGMENTS.index(name)
        world = Rotation.from_quat(orientations[:, index], scalar_first=True)
        assert at[f"{name}_end"] == pytest.approx(
            positions[:, index] + world.apply(place), abs=1e-6
        )
    skeleton = recording.skeleton
    assert skeleton is not None
    hand = skeleton.names.index("LeftHand")
    assert skeleton.names[skeleton.parents[hand]] == "LeftForeArm"
    assert skeleton.offsets[hand] == pytest.approx([0.0, 0.24, 0.0], abs=1e-6)


def test_mvnx_angles_are_the_segments_against_each_other(tmp_path: Path) -> None:
    positions, orientations = mvnx_motion(40, seed=3)
    recording = open_recording(write_mvnx(tmp_path / "a.mvnx", (positions, orientations)))
    world = {
        name: Rotation.from_quat(orientations[:, i], scalar_first=True)
        for i, name in enumerate(MVNX_SEGMENTS)
    }
    for joint, parent, order in [
        ("LeftForeArm", "LeftUpperArm", "XYZ"),
        ("RightLowerLeg", "RightUpperLeg", "YXZ"),
    ]:
        wanted = world[parent].inv() * world[joint]
        assert (turn(recording, joint, order) * wanted.inv()).magnitude().max() < 1e-6
    assert (turn(recording, "Pelvis", "ZXY") * world["Pelvis"].inv()).magnitude().max() < 1e-6
    columns = [recording.channels.index(f"Pelvis.t{axis}") for axis in "xyz"]
    assert recording.frames[:, columns] == pytest.approx(positions[:, 0], abs=1e-6)


def test_mvnx_with_a_part_of_the_streams(tmp_path: Path) -> None:
    positions, orientations = mvnx_motion(20)
    whole = by_name(open_recording(write_mvnx(tmp_path / "a.mvnx"), positions=True))
    turned = write_mvnx(tmp_path / "b.mvnx", holds=("orientation",))
    with pytest.warns(RecordingWarning, match="pelvis is taken to stay"):
        fixed = by_name(open_recording(turned, positions=True))
    for name in ("LeftHand", "Head_end"):  # bones are as long as the file says
        assert fixed[name] - fixed["Pelvis"] == pytest.approx(whole[name] - whole["Pelvis"])
    assert 0.8 < fixed["Pelvis"][0, 2] < 1.0
    placed = write_mvnx(tmp_path / "c.mvnx", (positions, orientations), holds=("position",))
    points = by_name(open_recording(placed, positions=True))
    foot = MVNX_SEGMENTS.index("RightFoot")
    assert points["RightFoot"] == pytest.approx(positions[:, foot], abs=1e-6)
    with pytest.raises(RecordingError, match="no orientations or joint angles"):
        open_recording(placed)
    angles = open_recording(write_mvnx(tmp_path / "d.mvnx", holds=("jointAngle",)))
    assert angles.channels[:3] == ("jL5.rx", "jL5.ry", "jL5.rz")
    assert angles.frames[3] == pytest.approx(np.radians(13.0))
    with pytest.raises(RecordingError, match="no positions or orientations"):
        open_recording(tmp_path / "d.mvnx", positions=True)


def test_mvnx_with_fingers(tmp_path: Path) -> None:
    """Fingers come in lists and streams of their own, whose elements have the same names."""
    path = write_mvnx(tmp_path / "a.mvnx")
    plain = open_recording(path, positions=True)
    finger = '<segment label="LeftCarpus" id="1"><points><point label="p"><pos_b>0 0 0</pos_b>'
    finger += "</point></points></segment>"
    joint = '<joint label="j"><connector1>LeftCarpus/p</connector1><connector2>LeftThumb/p'
    joint += "</connector2></joint>"
    text = path.read_text().replace(
        "<frames>",
        f"<fingerTrackingSegmentsLeft>{finger}</fingerTrackingSegmentsLeft>"
        f"<fingerTrackingJointsLeft>{joint}</fingerTrackingJointsLeft><frames>",
    )
    text = text.replace("</frame>", "<positionFingersLeft>1 2 3</positionFingersLeft></frame>")
    path.write_text(text)
    assert np.array_equal(open_recording(path, positions=True).frames, plain.frames)


@pytest.mark.parametrize("index", ["9" * 5000, "-1", "one"])
def test_mvnx_indices_that_make_no_sense(tmp_path: Path, index: str) -> None:
    path = write_mvnx(tmp_path / "a.mvnx")
    plain = open_recording(path, positions=True)
    path.write_text(path.read_text().replace('index="5"', f'index="{index}"'))
    with pytest.warns(RecordingWarning, match="taken one by one"):
        assert np.array_equal(open_recording(path, positions=True).frames, plain.frames)


def test_mvnx_frames_that_were_dropped_are_missing(tmp_path: Path) -> None:
    path = write_mvnx(tmp_path / "a.mvnx")
    path.write_text(re.sub(r'<frame time="\d+" index="[45]".*\n', "", path.read_text()))
    with pytest.warns(RecordingWarning, match="2 frames are missing"):
        recording = open_recording(path, positions=True)
    assert len(recording) == 12
    assert np.flatnonzero(np.isnan(recording.frames).any(axis=1)).tolist() == [4, 5]


def test_mvnx_takes_the_rate_from_the_times_where_it_must(tmp_path: Path) -> None:
    path = write_mvnx(tmp_path / "a.mvnx", subject='label="Anna"')
    assert open_recording(path).rate_hz == pytest.approx(100.0)


def spaced(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name)


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")
@pytest.mark.parametrize(
    "kind", ["names without joints", "w last", "an empty frame", "every second", "other times"]
)
def test_mvnx_spelled_otherwise(tmp_path: Path, kind: str) -> None:
    positions, orientations = mvnx_motion(40)
    expected, names, rate_hz, said = positions.copy(), list(MVNX_SEGMENTS), 100.0, ""
    if kind == "w last":
        orientations, said = orientations[..., [1, 2, 3, 0]], "x, y, z, w"
    path = write_mvnx(tmp_path / "a.mvnx", (positions, orientations))
    text = path.read_text()
    if kind == "names without joints":
        text = re.sub(r"<joints>.*?</joints>", "", text, flags=re.S)
        text = re.sub(r'(segment label=)"(\w+)"', lambda m: f'{m[1]}"{spaced(m[2])}"', text)
        names = [spaced(name) for name in names]
    elif kind == "an empty frame":
        text = re.sub(r'(index="7" type="normal">).*?(</frame>)', r"\1\2", text)
        expected[7], said = np.nan, "1 of 40 frames have no position"
    elif kind == "every second":
        text = re.sub(
            r'time="(\d+)" index="(\d+)"',
            lambda m: f'time="{2 * int(m[1])}" index="{2 * int(m[2])}"',
            text,
        )
        rate_hz, said = 50.0, "the times say 50 Hz"
    elif kind == "other times":
        text = re.sub(r'time="(\d+)" index', lambda m: f'time="{4 * int(m[1])}" index', text)
        rate_hz, said = 25.0, "the times say 25 Hz"
    path.write_text(text)
    recording = open_recording(path, positions=True)
    assert recording.rate_hz == rate_hz
    assert any(said in warning for warning in (*recording.report.warnings, ""))
    found = by_name(recording)
    at = np.stack([found[name] for name in names], axis=1)
    np.testing.assert_allclose(at, expected, atol=1e-6)


BOMB = """<!DOCTYPE mvnx [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;"><!ENTITY d "&c;&c;&c;&c;&c;&c;&c;&c;&c;&c;">]>"""


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("<mvnx", f"{BOMB}\n<mvnx", "a document type"),
        ("<mvnx", '<!DOCTYPE mvnx SYSTEM "file:///etc/passwd">\n<mvnx', "a document type"),
        ("</subject>", "", "damaged XML"),
        ("<segments>", "<segment>", "damaged XML|0 segments"),
        ('type="normal"', 'type="other"', "0 frames"),
        ("<position>", "<position>1 ", "position has 70 numbers"),
        ("<orientation>", "<orientation>one ", "no number"),
        ("<orientation>", "<orientation>1e999 ", "infinite"),
        ('frameRate="100"', 'frameRate="0"', None),
    ],
)
def test_broken_mvnx(tmp_path: Path, old: str, new: str, found: str | None) -> None:
    path = write_mvnx(tmp_path / "broken.mvnx")
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    if found is None:
        assert open_recording(path).rate_hz == pytest.approx(100.0)
        return
    with pytest.raises(RecordingError, match=rf"broken\.mvnx.*({found})"):
        open_recording(path)


# --- SMPL

SMPL_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
"""Of the 22 joints of the body, in the order of the models' rotations [SMPL]."""


def smpl_world(poses: np.ndarray) -> list[Rotation]:
    vectors = poses.reshape(len(poses), -1, 3)
    world: list[Rotation] = []
    for joint, parent in enumerate(SMPL_PARENTS):
        own = Rotation.from_rotvec(vectors[:, joint])
        world.append(own if parent < 0 else world[parent] * own)
    return world


@pytest.mark.parametrize("n_joints", [22, 24, 52, 55])
def test_smpl_joints_turn_as_the_models_do(tmp_path: Path, n_joints: int) -> None:
    poses = smpl_poses(30, n_joints, seed=4)
    trans = np.linspace([0.0, 0.0, 0.9], [1.0, 0.2, 1.0], 30)
    path = write_smpl(tmp_path / "a.npz", poses=poses, trans=trans)
    recording = open_recording(path, positions=True)
    assert (recording.rate_hz, len(recording)) == (100.0, 30)
    assert recording.report is not None
    assert any("1.70 m" in note for note in recording.report.notes)
    assert bool(recording.report.left_out) == (n_joints > 22)
    at, skeleton = by_name(recording), recording.skeleton
    assert skeleton is not None
    assert at["pelvis"] == pytest.approx(trans, abs=1e-9)
    theirs = smpl_world(poses)
    for joint in range(1, 22):
        name, parent = skeleton.names[joint], SMPL_PARENTS[joint]
        assert skeleton.parents[joint] == parent
        # a bone of ours (x forward, y left, z up) in the model's frame: x left, y up, z forward
        bone = skeleton.offsets[joint][[1, 2, 0]]
        wanted = at[skeleton.names[parent]] + theirs[parent].apply(bone)
        assert at[name] == pytest.approx(wanted, abs=1e-9)
    assert at["left_ankle"][:, 2].max() < 0.5
    assert (at["head"][:, 2] - at["pelvis"][:, 2]).min() > 0.3
    left = at["left_hip"] - at["right_hip"]
    ahead = at["left_foot"] - at["left_ankle"]
    assert (np.cross(ahead, left)[:, 2] > 0).all()  # left is left of ahead


@pytest.mark.parametrize(
    ("length_s", "rate_hz"),
    [(2.0, 120.0), (1.9917, 120.0), (4.0, 60.0), (8.008, 29.97), (7.0, 34.286)],
)
def test_smpl_of_a_length_instead_of_a_rate(
    tmp_path: Path, length_s: float, rate_hz: float
) -> None:
    """Frames counted from the first to the last, or to the end of the last."""
    arrays = {"poses": smpl_poses(240), "trans": np.zeros((240, 3)), "mocap_framerate": None}
    path = write_smpl(tmp_path / "a.npz", **arrays, mocap_time_length=np.array(length_s))
    recording = open_recording(path)
    assert recording.rate_hz == pytest.approx(rate_hz, rel=1e-4)


def test_smpl_angles_are_the_poses(tmp_path: Path) -> None:
    poses = smpl_poses(30, 52, seed=4)
    trans = np.tile([0.0, 0.0, 0.9], (30, 1))
    recording = open_recording(write_smpl(tmp_path / "a.npz", poses=poses, trans=trans))
    theirs = poses.reshape(30, -1, 3)
    to_ours = Rotation.from_matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    for joint, index, order in [("left_knee", 4, "YXZ"), ("right_elbow", 19, "XYZ")]:
        wanted = to_ours * Rotation.from_rotvec(theirs[:, index]) * to_ours.inv()
        assert (turn(recording, joint, order) * wanted.inv()).magnitude().max() < 1e-9


@pytest.mark.parametrize(
    "arrays",
    [
        {"poses": None, "root_orient": smpl_poses()[:, :3], "pose_body": smpl_poses()[:, 3:66]},
        {"poses": None, "global_orient": smpl_poses()[:, :3], "body_pose":
         smpl_poses()[:, 3:66].reshape(12, 21, 3), "trans": None,
         "transl": np.tile([0.4, -0.1, 0.95], (12, 1))},
        {"poses": None, "smpl_poses": smpl_poses()[:, :72]},
        {"poses": None, "fullpose": smpl_poses()},
        {"mocap_framerate": None, "mocap_frame_rate": 100},
        {"mocap_framerate": None, "fps": np.array([100], dtype=np.int32)},
        {"poses": smpl_poses().astype(np.float32)},
        {"gender": np.array([None, {"a": 1}], dtype=object)},
    ],
)  # fmt: skip
def test_smpl_under_other_names(tmp_path: Path, arrays: dict[str, object]) -> None:
    usual = open_recording(write_smpl(tmp_path / "a.npz"), positions=True)
    other = open_recording(write_smpl(tmp_path / "b.npz", **arrays), positions=True)
    assert other.markers == pytest.approx(usual.markers, abs=1e-6)
    assert other.rate_hz == usual.rate_hz


def test_all_of_motion_x_in_one_array(tmp_path: Path) -> None:
    usual = open_recording(write_smpl(tmp_path / "a.npz"), positions=True)
    array = np.random.default_rng(0).normal(size=(12, 322))  # hands, jaw, face and betas, too
    array[:, :66] = smpl_poses()[:, :66]
    array[:, 309:312] = [0.4, -0.1, 0.95]
    np.save(tmp_path / "b.npy", array)
    other = open_recording(tmp_path / "b.npy", positions=True)
    assert other.markers == pytest.approx(usual.markers, abs=1e-6)
    assert other.rate_hz == 30.0


def test_places_of_aist_are_as_much_larger_as_its_person(tmp_path: Path) -> None:
    usual = open_recording(write_smpl(tmp_path / "a.npz"), positions=True)
    places = 93.7 * np.tile([0.4, -0.1, 0.95], (12, 1))
    scaled = {"poses": None, "smpl_poses": smpl_poses()[:, :72], "smpl_scaling": np.array([93.7])}
    path = write_smpl(tmp_path / "b.npz", trans=None, smpl_trans=places, **scaled)
    assert open_recording(path, positions=True).markers == pytest.approx(usual.markers, abs=1e-6)


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")
@pytest.mark.parametrize("unit", [1.0, 100.0, 1000.0])
@pytest.mark.parametrize("said", [False, True])
def test_smpl_whose_places_are_in_another_unit(tmp_path: Path, unit: float, said: bool) -> None:
    plain = open_recording(write_smpl(tmp_path / "a.npz"), positions=True)
    places = np.tile([0.4, -0.1, 0.95], (12, 1))
    path = write_smpl(tmp_path / "b.npz", trans=unit * places[:, None])  # an axis too many
    hints = Hints(unit_m=1.0 / unit) if said else None
    recording = open_recording(path, positions=True, hints=hints)
    np.testing.assert_allclose(recording.frames, plain.frames, atol=1e-9)
    assert recording.report.unit_m == pytest.approx(1.0 / unit)
    assert any("by the height" in w for w in recording.report.warnings) == (unit > 1.0 and not said)


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")
def test_smpl_in_degrees_or_in_a_batch_of_one(tmp_path: Path) -> None:
    poses = np.array(smpl_poses())
    poses.reshape(12, -1, 3)[:, 18] = [0.0, 1.3, 0.4]
    plain = open_recording(write_smpl(tmp_path / "a.npz", poses=poses), positions=True)
    batch = open_recording(write_smpl(tmp_path / "b.npz", poses=poses[None]), positions=True)
    assert np.array_equal(batch.frames, plain.frames)
    degrees = open_recording(
        write_smpl(tmp_path / "c.npz", poses=np.degrees(poses)), positions=True
    )
    np.testing.assert_allclose(degrees.frames, plain.frames, atol=1e-9)
    assert any("degrees" in warning for warning in degrees.report.warnings)


def test_smpl_in_a_world_that_is_y_up(tmp_path: Path) -> None:
    vectors = smpl_poses(40).reshape(40, -1, 3)
    upward = open_recording(
        write_smpl(tmp_path / "a.npz", poses=vectors.reshape(40, -1), trans=np.zeros((40, 3))),
        positions=True,
    )
    vectors[:, 0] = 0.0
    path = write_smpl(tmp_path / "b.npz", poses=vectors.reshape(40, -1), trans=np.zeros((40, 3)))
    recording = open_recording(path, positions=True)
    assert recording.report is not None
    assert recording.report.up == "y"
    assert recording.markers[..., 2] == pytest.approx(upward.markers[..., 2], abs=1e-9)
    apart = [
        np.linalg.norm(r.markers[:, 4] - r.markers[:, 21], axis=1) for r in (recording, upward)
    ]
    assert apart[0] == pytest.approx(apart[1])
    turned = np.linalg.det(recording.markers[0, 1:4] - recording.markers[0, 0])
    assert turned == pytest.approx(np.linalg.det(upward.markers[0, 1:4] - upward.markers[0, 0]))


def test_smpl_without_places_or_rate(tmp_path: Path) -> None:
    path = write_smpl(tmp_path / "a.npz", trans=None, mocap_framerate=None)
    with pytest.raises(RecordingError, match=r"mocap_framerate.*Hints\(rate_hz"):
        open_recording(path)
    with pytest.warns(RecordingWarning, match="no 'trans'"):
        recording = open_recording(path, positions=True, hints=Hints(rate_hz=60.0))
    assert recording.rate_hz == 60.0
    assert -0.1 < recording.markers[..., 2].min() < 0.2


@pytest.mark.parametrize(
    ("arrays", "found"),
    [
        ({"poses": None, "frames": np.zeros(3)}, "'poses', or 'root_orient'"),
        ({"poses": np.zeros((12, 60))}, r"poses of shape \(12, 60\)"),
        ({"poses": np.zeros(72)}, r"poses of shape \(72,\)"),
        ({"poses": np.zeros((0, 72))}, r"poses of shape \(0, 72\)"),
        ({"poses": np.full((12, 72), "a")}, "poses of <U1"),
        ({"poses": np.full((12, 72), np.inf)}, "infinite"),
        ({"poses": np.array([[{}] * 72], dtype=object)}, "'poses' cannot be read"),
        ({"trans": np.zeros((11, 3))}, r"trans of shape \(11, 3\)"),
        ({"mocap_framerate": -1.0}, "mocap_framerate is -1.0"),
    ],
)
def test_broken_smpl(tmp_path: Path, arrays: dict[str, object], found: str) -> None:
    path = write_smpl(tmp_path / "broken.npz", **arrays)
    with pytest.raises(RecordingError, match=rf"broken\.npz.*{found}"):
        open_recording(path)


def archive(path: Path, header: bytes, data: bytes = b"", *, squeeze: bool = False) -> Path:
    stream = io.BytesIO()
    kind = zipfile.ZIP_DEFLATED if squeeze else zipfile.ZIP_STORED
    with zipfile.ZipFile(stream, "w", kind) as file:
        file.writestr("poses.npy", header + data)
    path.write_bytes(stream.getvalue())
    return path


def npy_header(text: str) -> bytes:
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()


@pytest.mark.parametrize(
    ("header", "found"),
    [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (100000000000, 72), }\n", "shape"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (1, 72), }\n", "cannot be read"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1, -72), }\n", "cannot be read"),
        ("__import__('os').abort()\n", "cannot be read"),
        ("(" * 9000 + "\n", "cannot be read"),
    ],
)
def test_smpl_headers_that_lie(tmp_path: Path, header: str, found: str) -> None:
    path = archive(tmp_path / "bomb.npz", npy_header(header))
    with pytest.raises(RecordingError, match=rf"bomb\.npz.*{found}"):
        open_recording(path)


def test_smpl_archive_that_expands_without_end(tmp_path: Path) -> None:
    header = npy_header("{'descr': '|u1', 'fortran_order': False, 'shape': (1000000, 72), }\n")
    path = archive(tmp_path / "bomb.npz", header, bytes(72_000_000), squeeze=True)
    with pytest.raises(RecordingError, match="expands to 72"):
        open_recording(path)


@pytest.mark.parametrize("root", ["subject", "frames"])
def test_mvnx_without_a_list_of_segments(tmp_path: Path, root: str) -> None:
    path = write_mvnx(tmp_path / "a.mvnx", holds=("orientation", "position"))
    whole = open_recording(path, positions=True)
    text = re.sub(r"<(segments|joints)>.*?</\1>", "", path.read_text(), flags=re.DOTALL)
    if root == "frames":
        (text,) = re.findall("<frames.*</frames>", text, flags=re.DOTALL)
    path.write_text(text)
    with pytest.warns(RecordingWarning, match="the 23 of MVN"):
        recording = open_recording(path, positions=True)
    assert recording.rate_hz == pytest.approx(whole.rate_hz, rel=0.01)
    for name in recording.marker_names:
        at, place = (r.markers[:, r.marker_names.index(name)] for r in (recording, whole))
        np.testing.assert_allclose(at, place, atol=2e-3)
    path.write_text(text.replace("</position>", " 1</position>"))
    with pytest.raises(RecordingError, match="0 segments"):
        open_recording(path)


# --- G1

SIDE = {"left": 1.0, "right": -1.0}


def g1_model() -> mujoco.MjModel:
    """The maker's numbers once more, as MuJoCo has them: quaternions, nested bodies."""

    def body(name: str, pos: str, axis: str, inside: str, quat: str = "1 0 0 0") -> str:
        return (
            f'<body name="{name}" pos="{pos}" quat="{quat}"><joint name="{name}" axis="{axis}"/>'
            f'<geom size="0.01"/>{inside}</body>'
        )

    x, y, z = "1 0 0", "0 1 0", "0 0 1"
    limbs = {}
    for side, s in SIDE.items():
        ankle = body(f"{side}_ankle_roll_joint", "0 0 -0.017558", x, "")
        ankle = body(f"{side}_ankle_pitch_joint", f"0 {-s * 9.4445e-05} -0.30001", y, ankle)
        knee = body(
            f"{side}_knee_joint", f"-0.078273 {s * 0.0021489} -0.17734", y, ankle,
            "0.996179 0 0.0873386 0",
        )  # fmt: skip
        hip = body(f"{side}_hip_yaw_joint", "0.025001 0 -0.12412", z, knee)
        hip = body(
            f"{side}_hip_roll_joint", f"0 {s * 0.052} -0.030465", x, hip, "0.996179 0 -0.0873386 0"
        )
        limbs[f"leg_{side}"] = body(f"{side}_hip_pitch_joint", f"0 {s * 0.064452} -0.1027", y, hip)
        hand = body(f"{side}_wrist_yaw_joint", "0.046 0 0", z, "")
        hand = body(f"{side}_wrist_pitch_joint", "0.038 0 0", y, hand)
        hand = body(f"{side}_wrist_roll_joint", f"0.1 {s * 0.00188791} -0.01", x, hand)
        elbow = body(f"{side}_elbow_joint", "0.015783 0 -0.080518", y, hand)
        arm = body(f"{side}_shoulder_yaw_joint", f"0 {s * 0.00624} -0.1032", z, elbow)
        arm = body(
            f"{side}_shoulder_roll_joint", f"0 {s * 0.038} -0.013831", x, arm,
            f"0.990268 {-s * 0.139172} 0 0",
        )  # fmt: skip
        limbs[f"arm_{side}"] = body(
            f"{side}_shoulder_pitch_joint", f"0.0039563 {s * 0.10022} 0.24778", y, arm,
            f"0.990264 {s * 0.139201} 0 0",
        )  # fmt: skip
    torso = body("waist_pitch_joint", "0 0 0", y, limbs["arm_left"] + limbs["arm_right"])
    waist = body("waist_roll_joint", "-0.0039635 0 0.044", x, torso)
    waist = body("waist_yaw_joint", "0 0 0", z, waist)
    return mujoco.MjModel.from_xml_string(
        '<mujoco><compiler angle="radian"/><worldbody><body name="pelvis"><freejoint/>'
        f'<geom size="0.01"/>{limbs["leg_left"]}{limbs["leg_right"]}{waist}'
        "</body></worldbody></mujoco>"
    )


def test_g1_joints_are_where_mujoco_has_them(tmp_path: Path) -> None:
    values = g1_values(25, seed=2)
    recording = open_recording(write_g1_csv(tmp_path / "a.csv", values), positions=True)
    at = by_name(recording)
    model = g1_model()
    names = [model.joint(i).name for i in range(1, model.njnt)]
    assert names == list(G1_JOINTS)
    data = mujoco.MjData(model)
    for frame, row in enumerate(values):
        data.qpos[:3], data.qpos[3:7], data.qpos[7:] = row[:3], row[[6, 3, 4, 5]], row[7:]
        mujoco.mj_kinematics(model, data)
        assert at["pelvis"][frame] == pytest.approx(data.body("pelvis").xpos, abs=1e-9)
        for name in G1_JOINTS:
            assert at[name][frame] == pytest.approx(data.body(name).xpos, abs=2e-5), name
    assert 0.0 < at["left_toes_end"][:, 2].min() < 0.2
    assert 1.1 < at["head_end"][:, 2].max() < 1.4


def test_g1_channels_are_the_robots(tmp_path: Path) -> None:
    values = g1_values()
    recording = open_recording(write_g1_csv(tmp_path / "a.csv", values))
    assert recording.channels == (*BASE, *G1_JOINTS)
    assert recording.rate_hz == 30.0
    assert recording.frames[:, :3] == pytest.approx(values[:, :3])
    assert recording.frames[:, 6:] == pytest.approx(values[:, 7:])
    turned = Rotation.from_euler("ZXY", recording.frames[:, 3:6])
    assert (turned * Rotation.from_quat(values[:, 3:7]).inv()).magnitude().max() < 1e-8


def seed_table(values: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """The same motion as SEED's tables have it."""
    turns = Rotation.from_quat(values[:, 3:7]).as_euler("xyz", degrees=True)
    number = np.arange(len(values))[:, None]
    table = np.concatenate([number, 100 * values[:, :3], turns, np.degrees(values[:, 7:])], axis=1)
    header = ["Frame", *(f"root_translate{c}" for c in "XYZ"), *(f"root_rotate{c}" for c in "XYZ")]
    return table, [*header, *(f"{name}_dof" for name in G1_JOINTS)]


def test_g1_dialects_are_the_same_motion(tmp_path: Path) -> None:
    values = g1_values()
    plain = open_recording(write_g1_csv(tmp_path / "a.csv", values))
    headers = [
        ["root_x", "root_y", "root_z", "root_qx", "root_qy", "root_qz", "root_qw", *G1_JOINTS],
        ["base_pos_x", "base_pos_y", "base_pos_z", *(f"base_quat_{c}" for c in "xyzw"),
         *(f"{name}_pos" for name in G1_JOINTS)],
        ["x", "y", "z", "qx", "qy", "qz", "qw", *(n.removesuffix("_joint") for n in G1_JOINTS)],
    ]  # fmt: skip
    for header in headers:
        other = open_recording(write_g1_csv(tmp_path / "b.csv", values, header))
        assert other.frames == pytest.approx(plain.frames, abs=1e-9)
        assert other.rate_hz == 30.0
    order = np.random.default_rng(0).permutation(36)
    shuffled = [headers[0][i] for i in order]
    other = open_recording(write_g1_csv(tmp_path / "b.csv", values[:, order], shuffled))
    assert other.frames == pytest.approx(plain.frames, abs=1e-9)
    of_seed = open_recording(write_g1_csv(tmp_path / "c.csv", *seed_table(values)))
    assert of_seed.rate_hz == 120.0
    assert of_seed.frames == pytest.approx(plain.frames, abs=1e-7)
    assert of_seed.report is not None
    assert of_seed.report.unit_m == 0.01
    semicolons = (tmp_path / "a.csv").read_text().replace(",", ";")
    (tmp_path / "d.csv").write_text(semicolons)
    assert open_recording(tmp_path / "d.csv").frames == pytest.approx(plain.frames)


@pytest.mark.parametrize("form", ["{}_deg", "{} (deg)", "{} [degrees]"])
def test_g1_in_the_unit_that_names_say(tmp_path: Path, form: str) -> None:
    """Less than seven degrees could be radians."""
    values = g1_values()
    values[:, 7:] *= 0.1
    plain = open_recording(write_g1_csv(tmp_path / "a.csv", values))
    values[:, 7:] = np.degrees(values[:, 7:])
    header = ["x", "y", "z", "qx", "qy", "qz", "qw", *map(form.format, G1_JOINTS)]
    other = open_recording(write_g1_csv(tmp_path / "b.csv", values, header))
    assert other.frames == pytest.approx(plain.frames, abs=1e-9)
    said = write_g1_csv(tmp_path / "c.csv", values)
    other = open_recording(said, hints=Hints(angle_unit="degrees"))
    assert other.frames == pytest.approx(plain.frames, abs=1e-9)


def test_g1_in_degrees_without_names(tmp_path: Path) -> None:
    values = g1_values()
    plain = open_recording(write_g1_csv(tmp_path / "a.csv", values))
    values[:, 7:] = np.degrees(values[:, 7:])
    with pytest.warns(RecordingWarning, match="taken for degrees"):
        other = open_recording(write_g1_csv(tmp_path / "b.csv", values))
    assert other.frames == pytest.approx(plain.frames, abs=1e-8)


def test_g1_without_some_joints_or_in_another_unit(tmp_path: Path) -> None:
    values = g1_values()
    header = ["x", "y", "z", "qx", "qy", "qz", "qw", *G1_JOINTS]
    keep = [
        i for i, name in enumerate(header) if not name.startswith(("waist_roll", "waist_pitch"))
    ]
    path = write_g1_csv(tmp_path / "a.csv", values[:, keep], [header[i] for i in keep])
    with pytest.warns(RecordingWarning, match="waist_roll_joint, waist_pitch_joint"):
        recording = open_recording(path)
    assert (recording.frames[:, recording.channels.index("waist_roll_joint")] == 0).all()
    values[:, :3] *= 100
    with pytest.warns(RecordingWarning, match=r"unit of 0\.01 m"):
        recording = open_recording(write_g1_csv(tmp_path / "b.csv", values))
    assert recording.frames[:, 2] == pytest.approx(values[:, 2] / 100)
    values[:, :3] /= 100
    values[:, 7:] = np.degrees(values[:, 7:])
    with pytest.warns(RecordingWarning, match="taken for degrees"):
        recording = open_recording(write_g1_csv(tmp_path / "c.csv", values, header))
    assert recording.frames[:, 6:] == pytest.approx(np.radians(values[:, 7:]))


def test_g1_joints_spelled_otherwise(tmp_path: Path) -> None:
    plain = open_recording(write_g1_csv(tmp_path / "a.csv"))
    base = ["# x", "y", "z", "qx", "qy", "qz", "qw"]  # as numpy writes a header
    camel = ["".join(map(str.title, name.split("_")[:-1])) for name in G1_JOINTS]
    recording = open_recording(write_g1_csv(tmp_path / "b.csv", header=[*base, *camel]))
    assert np.array_equal(recording.frames, plain.frames)
    base = ["base_pos_x", "base_pos_y", "base_pos_z", *(f"base_rot_{c}" for c in "xyzw")]
    header = [*base, *(f"joint_{name.removesuffix('_joint')}" for name in G1_JOINTS)]
    recording = open_recording(write_g1_csv(tmp_path / "c.csv", header=header))
    assert np.array_equal(recording.frames, plain.frames)


@pytest.mark.parametrize(("name", "mark"), [("a.tsv", "\t"), ("a.txt", " "), ("a.txt", "\t")])
def test_g1_between_tabs_and_blanks(tmp_path: Path, name: str, mark: str) -> None:
    path = write_g1_csv(tmp_path / "a.csv")
    (tmp_path / name).write_text(path.read_text().replace(",", mark))
    assert np.array_equal(open_recording(tmp_path / name).frames, open_recording(path).frames)


def test_g1_as_arrays(tmp_path: Path) -> None:
    values = g1_values()
    plain = open_recording(write_g1_csv(tmp_path / "a.csv", values))
    np.save(tmp_path / "b_50hz.npy", values)
    parts = {"root_pos": values[:, :3], "root_rot": values[:, 3:7], "dof_pos": values[:, 7:]}
    np.savez(tmp_path / "c.npz", fps=50, **parts, link_body_list=np.array(["pelvis"]))
    for name in ("b_50hz.npy", "c.npz"):
        recording = open_recording(tmp_path / name)
        assert (recording.channels, recording.rate_hz) == (plain.channels, 50.0)
        assert recording.frames == pytest.approx(plain.frames, abs=1e-7)
    np.savez(tmp_path / "d.npz", **parts | {"dof_pos": values[:, 7:29]})
    with pytest.raises(RecordingError, match=r"\(12, 22\)"):
        open_recording(tmp_path / "d.npz")


def test_g1_that_cannot_bend_waist_and_wrists(tmp_path: Path) -> None:
    values = g1_values()
    stiff = [7 + i for i in (13, 14, 20, 21, 27, 28)]  # as the maker counts: waist, wrists
    values[:, stiff] = 0.0
    plain = open_recording(write_g1_csv(tmp_path / "a.csv", values))
    rows = np.delete(values, stiff, axis=1)
    assert rows.shape[1] == 30
    numbered = np.column_stack([np.arange(len(rows)), rows])
    np.save(tmp_path / "b.npy", rows)
    parts = {"root_pos": rows[:, :3], "root_rot": rows[:, 3:7], "dof_pos": rows[:, 7:]}
    np.savez(tmp_path / "c.npz", fps=30, **parts)
    paths = [tmp_path / "b.npy", tmp_path / "c.npz"]
    paths += [write_g1_csv(tmp_path / f"d{i}.csv", each) for i, each in enumerate((rows, numbered))]
    for path in paths:
        with pytest.warns(RecordingWarning, match="waist_roll_joint, waist_pitch_joint"):
            recording = open_recording(path)
        assert recording.frames == pytest.approx(plain.frames, abs=1e-6)


@pytest.mark.parametrize("form", ["npy", "nan", "blank"])
@pytest.mark.parametrize("missing", ["first quaternion", "a joint's column", "all but the place"])
def test_g1_with_numbers_that_are_missing(tmp_path: Path, form: str, missing: str) -> None:
    values = g1_values()
    plain = open_recording(write_g1_csv(tmp_path / "a.csv", values), positions=False)
    at = {
        "all but the place": np.s_[0, 3:35],
        "first quaternion": np.s_[0, 3:7],
        "a joint's column": np.s_[:, 12],
    }
    values[at[missing]] = np.nan
    path = tmp_path / ("b_30hz.npy" if form == "npy" else "b_30hz.csv")
    if form == "npy":
        np.save(path, values)
    else:
        text = write_g1_csv(path, values).read_text()
        path.write_text(text.replace("nan", "NaN" if form == "nan" else " "))
    found = open_recording(path, positions=False)
    assert found.channels == plain.channels
    gone = np.isnan(found.frames)
    assert gone.any() and not gone[1:, :11].any()
    assert found.frames[~gone] == pytest.approx(plain.frames[~gone], abs=1e-7)


def test_g1_with_quaternions_w_first(tmp_path: Path) -> None:
    values = g1_values()
    plain = open_recording(write_g1_csv(tmp_path / "a.csv", values))
    values[:, 3:7] = values[:, [6, 3, 4, 5]]
    with pytest.warns(RecordingWarning, match="w, x, y, z"):
        other = open_recording(write_g1_csv(tmp_path / "b.csv", values))
    assert other.frames == pytest.approx(plain.frames, abs=1e-9)


def test_g1_with_times(tmp_path: Path) -> None:
    values = g1_values()
    times = np.arange(12)[:, None] / 50.0
    header = ["time", "x", "y", "z", "qx", "qy", "qz", "qw", *G1_JOINTS]
    table = np.concatenate([times, values], axis=1)
    assert open_recording(write_g1_csv(tmp_path / "a.csv", table, header)).rate_hz == 50.0


@pytest.mark.parametrize(
    ("header", "found"),
    [
        (["x", "y", "z", "qx", "qy", "qz", "w", *G1_JOINTS], "expected the pelvis"),
        (["x", "y", "y", "qx", "qy", "qz", "qw", *G1_JOINTS], "columns 'y' and 'y'"),
    ],
)
def test_broken_g1_csv(tmp_path: Path, header: list[str], found: str) -> None:
    path = write_g1_csv(tmp_path / "broken.csv", header=header)
    with pytest.raises(RecordingError, match=rf"broken\.csv.*{found}"):
        open_recording(path)


def test_other_tables_of_36_numbers_are_not_the_g1s(tmp_path: Path) -> None:
    values = g1_values()
    values[:, 3:7] = 0.3
    with pytest.raises(RecordingError):
        open_recording(write_g1_csv(tmp_path / "a.csv", values))


@needs_cases
def test_case_g1() -> None:
    path = (CASES or Path()) / "csv_g1_headerless.csv"
    recording = open_recording(path)
    assert (len(recording), recording.rate_hz, recording.frames.shape[1]) == (60, 30.0, 35)
    rows = np.loadtxt(path, delimiter=",")
    assert recording.frames[:, 6:] == pytest.approx(rows[:, 7:])
    at = by_name(open_recording(path, positions=True))
    assert at["pelvis"] == pytest.approx(rows[:, :3])
    assert at["head_end"][:, 2].min() > at["left_toes_end"][:, 2].max() + 0.8


@needs_cases
def test_case_hdm() -> None:
    folder = (CASES or Path()) / "amc_hdm_names"
    recording = open_recording(folder, positions=True)
    assert (len(recording), recording.rate_hz) == (10, 120.0)
    assert by_name(recording)["root"][:, 2] == pytest.approx(38 * 0.0254)
    angles = open_recording(folder)
    assert angles.frames[:, angles.channels.index("root.tz")] == pytest.approx(0.9652)


def test_names_of_asf_files(tmp_path: Path) -> None:
    from mocap_writers import ASF, amc_values, write_amc, write_asf

    def skeleton_of(name: str) -> str:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            recording = open_recording(write_amc(tmp_path / name, amc_values()), positions=True)
        assert recording.skeleton is not None
        shank = recording.skeleton.names.index("shank_end")
        length = np.linalg.norm(recording.skeleton.offsets[shank]) / (0.0254 / 0.45)
        return {8.0: "HDM_bd", 7.0: "HDM_bd_02", 6.0: "other"}[round(float(length), 6)]

    write_asf(tmp_path / "HDM_bd.asf")
    assert skeleton_of("wave.amc") == "HDM_bd"  # the only one
    write_asf(tmp_path / "HDM_bd_02.asf", ASF.replace("length 8\n", "length 7\n"))
    write_asf(tmp_path / "other.ASF", ASF.replace("length 8\n", "length 6\n"))
    assert skeleton_of("HDM_bd_01-01_01_120.amc") == "HDM_bd"
    assert skeleton_of("HDM_bd_02-01_01_120.amc") == "HDM_bd_02"
    assert skeleton_of("Other.amc") == "other"
    with pytest.raises(RecordingError, match="CMU's skeleton"):
        open_recording(write_amc(tmp_path / "HDM_bdx_01.amc"))


def test_amc_says_what_it_left_out(tmp_path: Path) -> None:
    from mocap_writers import AMC_BONES, amc_values, write_amc, write_asf

    write_asf(tmp_path / "take.asf")
    values = amc_values()
    usual = open_recording(write_amc(tmp_path / "take.amc", values), positions=True)
    path = write_amc(tmp_path / "take.amc", np.repeat(values, 2, axis=0))
    text = re.sub(r"(?m)^(\d+)$", lambda m: str((int(m[1]) + 1) // 2), path.read_text())
    path.write_text(text)
    with pytest.warns(RecordingWarning, match="12 frames that stand twice"):
        assert np.array_equal(open_recording(path, positions=True).frames, usual.frames)
    path.write_text(text.replace("larm", "wing").replace("wing", "larm", 23))
    with pytest.raises(RecordingError, match="'wing' in frame 12"):
        open_recording(path)
    path = write_amc(tmp_path / "take.amc", values)
    path.write_text(path.read_text().rpartition("\ntrunk")[0])
    with pytest.warns(RecordingWarning, match="the last frame, 12, is cut off"):
        cut = open_recording(path, positions=True)
    assert np.array_equal(cut.frames, usual.frames[:-1])
    bones = {name: count for name, count in AMC_BONES.items() if name != "larm"}
    path = write_amc(tmp_path / "take.amc", values[:, :-2], bones)
    with pytest.warns(RecordingWarning, match="bones larm have no numbers"):
        recording = open_recording(path)
    assert (recording.frames[:, recording.channels.index("larm.rz")] == 0.0).all()
    radians = values.copy()
    radians[:, 3:] = np.radians(values[:, 3:])
    path = write_amc(tmp_path / "take.amc", radians)
    path.write_text(path.read_text().replace(":DEGREES", ":RADIANS"))
    assert open_recording(path, positions=True).markers == pytest.approx(usual.markers, abs=1e-9)


@pytest.mark.parametrize("before", ["time", "frame", "both"])
def test_g1_without_header_behind_a_frame_number_or_time(tmp_path, before):
    values = g1_values(30)
    path = write_g1_csv(tmp_path / "a.csv", values)
    plain = open_recording(path)
    rows = np.loadtxt(path, delimiter=",")
    n, times = np.arange(len(rows)), 3.0 + np.arange(len(rows)) / 50.0
    first = {"time": [times], "frame": [n], "both": [n, times]}[before]
    np.savetxt(path, np.column_stack([*first, rows]), delimiter=",", fmt="%.9f")
    found = open_recording(path)
    assert found.rate_hz == pytest.approx(30.0 if before == "frame" else 50.0)
    assert found.channels == plain.channels
    assert np.allclose(found.frames, plain.frames, atol=1e-6)

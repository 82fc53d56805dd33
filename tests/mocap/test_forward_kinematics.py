"""AMC and BVH: forward kinematics against recursions written another way, frame by frame."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from mocap_writers import (
    AMC_BONES,
    ASF,
    BVH_HIERARCHY,
    amc_values,
    bvh_values,
    write_amc,
    write_asf,
    write_bvh,
)
from scipy.spatial.transform import Rotation

from mplearn.errors import RecordingError
from mplearn.mocap import Hints, open_recording

UNIT_M = 0.0254 / 0.45


def to_ours(points: np.ndarray) -> np.ndarray:
    """From y up, z forward to z up, x forward."""
    return points[..., [2, 0, 1]]


def amc_frame(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Ends of the bones of the writers' ASF, in its axes and units, by recursion over bones."""

    def local(name: str, axis: tuple[str, list[float]], dofs: str) -> Rotation:
        # an extrinsic order as named: what stands first turns first, about fixed axes
        c = Rotation.from_euler(axis[0].lower(), axis[1], degrees=True)
        m = Rotation.from_euler(dofs, values[name], degrees=True)
        return c * m * c.inv()

    root_turn = Rotation.from_euler("xyz", values["root"][3:], degrees=True)
    place = {"root": values["root"][:3]}
    trunk = root_turn * local("trunk", ("XYZ", [0, 0, 0]), "xyz")
    place["trunk"] = place["root"] + trunk.apply([0, 9.0, 0])
    arm = trunk * local("larm", ("XYZ", [10, 20, -30]), "zx")
    place["larm"] = place["trunk"] + arm.apply([8.0, -6.0, 0])
    thigh = root_turn * local("thigh", ("XYZ", [0, 0, 20]), "xyz")
    place["thigh"] = place["root"] + thigh.apply(np.array([0.34202, -0.939693, 0]) * 7.95556)
    shank = thigh * local("shank", ("ZXY", [-90, 5, 20]), "x")
    place["shank"] = place["thigh"] + shank.apply([0, -8.0, 0])
    return place


def test_amc_positions_equal_a_recursion_per_frame(tmp_path: Path) -> None:
    write_asf(tmp_path / "86.asf")
    values = amc_values(40)
    recording = open_recording(write_amc(tmp_path / "86_01.amc", values), positions=True)
    assert recording.person == "86"
    at = {name: i for i, name in enumerate(recording.marker_names)}
    splits = np.cumsum(list(AMC_BONES.values()))[:-1]
    for frame, points in zip(values, recording.markers, strict=True):
        ends = amc_frame(dict(zip(AMC_BONES, np.split(frame, splits), strict=True)))
        expected = {
            "root": ends["root"],
            "trunk": ends["root"],
            "larm": ends["trunk"],
            "larm_end": ends["larm"],
            "thigh": ends["root"],
            "shank": ends["thigh"],
            "shank_end": ends["shank"],
        }
        assert set(expected) == set(at)
        for name, point in expected.items():
            assert points[at[name]] == pytest.approx(to_ours(point) * UNIT_M, abs=1e-12)


def test_amc_angles_are_the_files_in_radians(tmp_path: Path) -> None:
    write_asf(tmp_path / "86.asf")
    values = amc_values(20)
    recording = open_recording(write_amc(tmp_path / "86_01.amc", values))
    column = {name: recording.frames[:, i] for i, name in enumerate(recording.channels)}
    assert column["root.tx"] == pytest.approx(values[:, 2] * UNIT_M)  # forward is the file's z
    assert column["root.ty"] == pytest.approx(values[:, 0] * UNIT_M)
    assert column["root.tz"] == pytest.approx(values[:, 1] * UNIT_M)  # up is the file's y
    assert column["root.rz"] == pytest.approx(np.unwrap(np.deg2rad(values[:, 4])))  # heading
    assert column["shank.rx"] == pytest.approx(np.deg2rad(values[:, 9]))
    assert column["larm.rz"] == pytest.approx(np.deg2rad(values[:, 13]))
    assert recording.channels.index("larm.rz") < recording.channels.index("larm.rx")


def test_amc_bones_may_stand_in_any_order(tmp_path: Path) -> None:
    write_asf(tmp_path / "take.asf")
    values = amc_values()
    usual = open_recording(write_amc(tmp_path / "take.amc", values), positions=True)
    splits = np.split(np.arange(15), np.cumsum(list(AMC_BONES.values()))[:-1])
    columns = dict(zip(AMC_BONES, splits, strict=True))
    order = sorted(AMC_BONES)
    shuffled = values[:, np.concatenate([columns[name] for name in order])]
    other = write_amc(tmp_path / "take.amc", shuffled, {name: AMC_BONES[name] for name in order})
    assert np.array_equal(open_recording(other, positions=True).frames, usual.frames)


def test_angles_do_not_jump_by_a_turn(tmp_path: Path) -> None:
    write_asf(tmp_path / "take.asf")
    values = amc_values(100)
    turning = np.linspace(0.0, 700.0, 100)
    values[:, 4] = (turning + 180.0) % 360.0 - 180.0
    recording = open_recording(write_amc(tmp_path / "take.amc", values))
    heading = recording.frames[:, recording.channels.index("root.rz")]
    assert heading == pytest.approx(np.deg2rad(turning), abs=1e-9)


def bvh_frame(values: np.ndarray) -> dict[str, np.ndarray]:
    """Joint centres of the writers' BVH in its axes and units, by homogeneous matrices."""

    def matrix(offset: object, order: str, angles: object) -> np.ndarray:
        m = np.eye(4)
        if order:  # intrinsic, in the order of the channels
            m[:3, :3] = Rotation.from_euler(order, angles, degrees=True).as_matrix()
        m[:3, 3] = offset
        return m

    hips = matrix(values[:3], "ZXY", values[3:6])
    spine = hips @ matrix([0, 25, 1], "XYZ", values[6:9])
    arm = spine @ matrix([18, 30, -2], "YZX", values[9:12])
    head = spine @ matrix(values[12:15], "ZYX", values[15:18])
    leg = hips @ matrix([9, -2, 0], "X", values[18:19])
    frames = {
        "Hips": hips,
        "Spine": spine,
        "Arm": arm,
        "Arm_end": arm @ matrix([55, 0, 0], "", None),
        "Head": head,
        "Head_end": head @ matrix([0, 20, 0], "", None),
        "Leg": leg,
        "Leg_end": leg @ matrix([0, -85, 3], "", None),
    }
    return {name: m[:3, 3] for name, m in frames.items()}


def test_bvh_positions_equal_homogeneous_matrices(tmp_path: Path) -> None:
    values = bvh_values(40)
    recording = open_recording(write_bvh(tmp_path / "dance.bvh", values), positions=True)
    assert recording.rate_hz == pytest.approx(100.0)
    for frame, points in zip(values, recording.markers, strict=True):
        expected = bvh_frame(frame)
        assert tuple(expected) == recording.marker_names
        ours = to_ours(np.array(list(expected.values()))) * 0.01
        assert points == pytest.approx(ours, abs=1e-12)


def test_bvh_angles_keep_each_joints_channel_order(tmp_path: Path) -> None:
    values = bvh_values(20)
    recording = open_recording(write_bvh(tmp_path / "dance.bvh", values))
    assert recording.channels[:6] == (
        "Hips.ty",
        "Hips.tz",
        "Hips.tx",
        "Hips.rx",
        "Hips.ry",
        "Hips.rz",
    )
    assert recording.channels[6:12] == (
        "Spine.rx",
        "Spine.ry",
        "Spine.rz",
        "Arm.ry",
        "Arm.rz",
        "Arm.rx",
    )
    assert recording.frames[:, 1] == pytest.approx(values[:, 1] * 0.01)
    assert recording.frames[:, 9] == pytest.approx(np.unwrap(np.deg2rad(values[:, 9])))


def test_bvh_with_z_up_and_metres(tmp_path: Path) -> None:
    values = bvh_values()
    usual = write_bvh(tmp_path / "usual.bvh", values)

    def metres(text: str) -> str:
        return re.sub(
            r"OFFSET (\S+) (\S+) (\S+)",
            lambda m: "OFFSET " + " ".join(repr(float(x) / 100) for x in m.groups()),
            text,
        )

    values[:, [0, 1, 2, 12, 13, 14]] /= 100
    other = write_bvh(tmp_path / "metres.bvh", values, metres(BVH_HIERARCHY))
    found = open_recording(other, positions=True)  # by the size of a person
    assert found.report is not None
    assert found.report.unit_m == 1.0
    ours = open_recording(other, hints=Hints(unit_m=1.0), positions=True).markers
    assert found.markers == pytest.approx(ours, abs=1e-12)
    assert ours == pytest.approx(open_recording(usual, positions=True).markers, abs=1e-9)
    as_z_up = open_recording(other, hints=Hints(unit_m=1.0, up_axis="z"), positions=True).markers
    assert as_z_up == pytest.approx(ours[..., [1, 2, 0]], abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("ROOT Hips", "ROOT", "expected '{'"),
        ("HIERARCHY", "HIERARCHIE", "HIERARCHY"),
        ("    OFFSET 0 25 1", "    OFFSET 0 25", "OFFSET of Spine"),
        ("CHANNELS 1 Xrotation", "CHANNELS 1 Wrotation", "Wrotation"),
        ("CHANNELS 1 Xrotation", "CHANNELS 99 Xrotation", "99 channels"),
        ("CHANNELS 1 Xrotation", "CHANNELS 2 Xrotation Xrotation", "twice"),
        ("CHANNELS 1 Xrotation", "CHANNELS 0", "columns"),
        ("CHANNELS 1 Xrotation", "CHANNELS 2 Xrotation Yrotation", "columns"),
        ("End Site", "JOINT Spine", "CHANNELS|named"),
        ("}\nMOTION", "}\nROOT Other\n{\nMOTION", "ends inside 'Other'"),
        ("}\nMOTION", "MOTION", "hierarchy"),
        ("}\nMOTION", "}\n}\nMOTION", "after the root"),
        ("MOTION", "", "MOTION"),
        ("Frame Time: 0.01", "Frame Time: 1e-9", "Frame Time.*rate_hz"),
        ("Frame Time: 0.01\n", "", "Frame Time.*rate_hz"),
        ("Frame Time: 0.01", "Frame Time: 6.5", "Frame Time.*rate_hz=153.8"),
        ("Frame Time: 0.01", "Frame Time: 0", "Frame Time"),
        ("Frame Time: 0.01", "Frame Time: nan", "Frame Time"),
    ],
)
def test_broken_bvh(tmp_path: Path, old: str, new: str, found: str) -> None:
    path = write_bvh(tmp_path / "broken.bvh")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(RecordingError, match=rf"broken\.bvh.*({found})"):
        open_recording(path)


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("root trunk thigh", "root trunk", "do not hang on 'root'"),
        ("thigh shank", "thigh shank\n    shank thigh", "two parents"),
        ("    trunk larm", "    larm trunk\n    trunk larm", "two parents"),
        ("trunk larm", "trunk larm wing", "'wing'"),
        ("trunk larm", "trunk root", "two parents"),
        ("name larm", "name trunk", "named 'trunk'"),
        ("dof rz rx", "dof rz ry", None),
        ("dof rz rx", "dof rz", "'larm' has 2 numbers"),
        ("dof rz rx", "dof rz rx ry", "'larm' has 2 numbers"),
        ("dof rz rx", "dof rz l", "dof"),
        ("length 8\n", "length eight\n", "eight"),
        ("length 0.45", "length 0", "length"),
        ("length 0.45", "length 45", "lie within 11.2 mm"),
        (":bonedata", ":bones", ":bonedata"),
        ("axis 10 20 -30 XYZ", "axis 10 20 -30", "axis of bone 'larm'"),
        ("order TX TY TZ RX RY RZ", "order TX TX TZ RX RY RZ", "root order"),
        ("direction 0 1 0", "direction 0 1", "direction of bone 'trunk' has 2"),
        ("name thigh", "name femur", "'thigh'"),
    ],
)
def test_bones_that_do_not_fit(tmp_path: Path, old: str, new: str, found: str | None) -> None:
    assert old in ASF
    write_asf(tmp_path / "take.asf", ASF.replace(old, new))
    path = write_amc(tmp_path / "take.amc")
    if found is None:
        open_recording(path)
        return
    with pytest.raises(RecordingError, match=rf"take.*{found}.*expected"):
        open_recording(path)


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("\n3\n", "\n4\n", "frame 4 follows frame 2"),
        ("thigh", "femur", "femur"),
        (":DEGREES\n1\n", ":DEGREES\n", "starts with"),
        ("root ", "root nan ", "line 11 has 6 columns"),
        ("\nshank ", "\nshank nan\nshank ", "another number of bones"),
        ("\nlarm ", "\nlarm nan ", "2 numbers|columns"),
    ],
)
def test_broken_amc(tmp_path: Path, old: str, new: str, found: str) -> None:
    write_asf(tmp_path / "take.asf")
    path = write_amc(tmp_path / "take.amc")
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(RecordingError, match=rf"take\.amc.*{found}"):
        open_recording(path)


def test_amc_without_a_skeleton_must_be_cmus(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="CMU's skeleton"):
        open_recording(write_amc(tmp_path / "take.amc"))


def test_skeleton_may_be_passed(tmp_path: Path) -> None:
    (tmp_path / "bones").mkdir()
    skeleton = write_asf(tmp_path / "bones" / "anna.asf")
    path = write_amc(tmp_path / "take.amc")
    assert len(open_recording(path, hints=Hints(skeleton=skeleton))) == 12
    with pytest.raises(RecordingError, match=r"nobody\.asf"):
        open_recording(path, hints=Hints(skeleton=tmp_path / "nobody.asf"))

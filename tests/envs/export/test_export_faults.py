"""One thing is wrong with a file; the check says what, and by how much."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from export_world import OF_MOTIONS, alone, change_arrays, kept, of_arrays, written

from mplearn.errors import RecordingError
from mplearn_envs.export import RobotModel, RobotMotion, check, formats
from mplearn_envs.export.formats.glb import numbers, read_glb
from mplearn_envs.robot import humanoid

BODIES_ALONE = {"bvh", "gltf"}
OF_HINGES = {  # of which these hold no angles
    "degrees", "centimetres", "quaternion order", "joints breadth first", "two joints swapped",
    "one joint backward", "inches", "one joint in degrees",
}  # fmt: skip
OF_ONE = {
    "one joint in degrees",
    "zero of one joint",
    "x and y exchanged",
    "begun late",
}  # in three formats
ALONE = {"degrees", "centimetres", "quaternion order", "too high", "y up"}  # by the file alone
FORMATS = list(formats())
OF_ARRAYS = list(of_arrays(RobotModel.of(humanoid())))
CASES = [
    (name, fault)
    for name in FORMATS
    for fault in OF_MOTIONS
    if not (name in BODIES_ALONE and fault in OF_HINGES)
    and (name in {"unitree", "mjlab", "bvh"} or fault not in OF_ONE)
]


@pytest.mark.parametrize(("name", "fault"), CASES)
def test_a_fault_of_the_motion_is_found_in_any_format(
    name: str, fault: str, model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    if model.name != "robot" and name != "unitree":
        pytest.skip("one robot is enough")
    corrupt, kind = OF_MOTIONS[fault]
    path = written(tmp_path, motion, model, name, corrupt)
    (verdict,) = check(path, model)
    assert [found.kind for found in verdict.faults] == [kind]
    assert not verdict.in_order and not verdict.problems
    assert verdict.misfit.position_m > 0.03
    assert verdict.left.position_m < 2e-5
    if fault == "one joint backward":
        assert verdict.faults[0].problem.endswith(" turns the other way")
    if fault in ALONE:
        (verdict,) = check(alone(path), model)
        assert [found.kind for found in verdict.faults] == [kind]
        assert not verdict.problems


@pytest.mark.parametrize("fault", OF_ARRAYS)
def test_a_fault_of_the_arrays_is_found_without_anything_beside(
    fault: str, model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    corrupt, kind = of_arrays(model)[fault]
    path = alone(written(tmp_path, motion, model, "mjlab"))
    change_arrays(path, corrupt)
    (verdict,) = check(path, model)
    assert [found.kind for found in verdict.faults] == [kind]
    assert not verdict.problems
    assert verdict.left.position_m < 1e-5


@pytest.mark.parametrize("name", FORMATS)
def test_a_right_file_is_in_order_with_and_without_what_was_meant(
    name: str, model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    path = written(tmp_path, motion, model, name)
    for file in (path, None):
        (verdict,) = check(path if file else alone(path), model)
        assert verdict.in_order
        assert verdict.misfit.position_m < 1e-5 and verdict.misfit.angle_rad < 1e-5
    if name != "mjlab":
        assert verdict.notes  # what could not be told by the file alone


def test_frames_that_are_missing_are_counted_and_placed(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    def shorter(motion: RobotMotion, model: RobotModel) -> RobotMotion:
        return kept(motion, np.delete(np.arange(len(motion)), slice(10, 13)))

    (verdict,) = check(written(tmp_path, motion, model, "unitree", shorter), model)
    assert [fault.kind for fault in verdict.faults] == ["frames"]
    assert verdict.faults[0].problem.startswith("3 frames are missing after frame 9, ")
    assert verdict.left.position_m < verdict.misfit.position_m / 5


@pytest.mark.parametrize("n", [1, 2])
def test_a_frame_or_two_that_are_missing_at_the_end_or_too_many_are_told(
    model: RobotModel, motion: RobotMotion, tmp_path: Path, n: int
) -> None:
    def shorter(motion: RobotMotion, model: RobotModel) -> RobotMotion:
        return kept(motion, slice(None, -n))

    def longer(motion: RobotMotion, model: RobotModel) -> RobotMotion:
        ends = {
            name: np.concatenate([values := getattr(motion, name), values[-1:].repeat(n, axis=0)])
            for name in ("root_pos", "root_quat", "joint_pos")
        }
        return replace(motion, **ends)

    (verdict,) = check(written(tmp_path, motion, model, "unitree", shorter), model)
    frames = f"{n} frames are" if n > 1 else "1 frame is"
    assert [fault.problem for fault in verdict.faults] == [
        f"{frames} missing at the end, {n / 30:.4g} s"
    ]
    (verdict,) = check(written(tmp_path, motion, model, "unitree", longer), model)
    assert not verdict.faults
    assert verdict.problems == (f"there are {n} frames more than were meant",)


def test_two_faults_at_once_are_both_found(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    degrees, rolled = (OF_MOTIONS[fault][0] for fault in ("degrees", "quaternion order"))
    path = written(tmp_path, motion, model, "unitree", lambda m, r: degrees(rolled(m, r), r))
    (verdict,) = check(path, model)
    assert {fault.kind for fault in verdict.faults} == {"degrees", "quaternion order"}
    assert verdict.left.position_m < 1e-5


def test_a_bvh_in_radians_or_metres_or_with_exchanged_names_is_found(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    path = written(tmp_path, motion, model, "bvh")
    right = path.read_text("utf-8")
    head, numbers = right.split("Frame Time: 0.02\n")
    rows = np.loadtxt(numbers.splitlines())
    metres = rows.copy()
    metres[:, :3] /= 100.0
    offsets = re.sub(
        r"OFFSET (\S+) (\S+) (\S+)",
        lambda found: "OFFSET " + " ".join(str(float(part) / 100.0) for part in found.groups()),
        head,
    )
    text = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in metres)
    path.write_text(f"{offsets}Frame Time: 0.02\n{text}\n", "utf-8")
    (verdict,) = check(path, model)
    assert "metres taken for centimetres" in verdict.faults[0].problem

    rows[:, 3:] = np.radians(rows[:, 3:])
    text = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in rows)
    path.write_text(f"{head}Frame Time: 0.02\n{text}\n", "utf-8")
    (verdict,) = check(path, model)
    assert "radians" in verdict.faults[0].problem and verdict.left.position_m < 1e-5

    one, other = model.body_names[-1], model.body_names[2]
    swapped = right.replace(f" {one}\n", " ?\n").replace(f" {other}\n", f" {one}\n")
    path.write_text(swapped.replace(" ?\n", f" {other}\n"), "utf-8")
    (verdict,) = check(path, model)
    assert "names" in verdict.faults[0].problem and verdict.left.position_m < 1e-5


def test_a_gltf_with_quaternions_of_another_order_or_z_up_is_found(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    path = written(tmp_path, motion, model, "gltf")
    content, buffer = read_glb(path)
    right = path.read_bytes()
    data = bytearray(buffer)
    for channel in content["animations"][0]["channels"]:
        if channel["target"]["path"] == "rotation":
            output = content["animations"][0]["samplers"][channel["sampler"]]["output"]
            rolled = np.roll(numbers(content, buffer, output), 1, axis=1).astype("<f4")
            start = content["bufferViews"][content["accessors"][output]["bufferView"]]["byteOffset"]
            data[start : start + rolled.nbytes] = rolled.tobytes()
    path.write_bytes(right.replace(buffer, bytes(data)))
    (verdict,) = check(path, model)
    assert [fault.kind for fault in verdict.faults] == ["quaternion order"]
    assert verdict.left.position_m < 1e-5

    world = re.search(rb'"name":"[^"]*","rotation":\[0\.5[^]]*\],"children"', right)
    assert world is not None
    still = re.sub(rb"\[.*\]", b"[0,0,0,1]", world[0])
    path.write_bytes(right.replace(world[0], still + b" " * (len(world[0]) - len(still))))
    (verdict,) = check(path, model)
    assert [fault.kind for fault in verdict.faults] == ["axes"]
    assert verdict.left.position_m < 1e-5


def test_what_nothing_explains_is_said_with_where_and_how_much(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    path = written(tmp_path, motion, model, "mjlab")

    def jump(arrays: dict[str, np.ndarray]) -> None:
        arrays["body_pos_w"][:, 4] += 0.07 * np.sin(np.arange(len(arrays["joint_pos"])))[:, None]

    change_arrays(path, jump)
    (verdict,) = check(path, model)
    assert not verdict.in_order
    assert any(model.body_names[4] in problem for problem in verdict.problems)
    assert verdict.plain()["in_order"] is False


@pytest.mark.parametrize("name", FORMATS)
def test_files_of_nothing_are_refused_in_a_line(
    name: str, model: RobotModel, tmp_path: Path
) -> None:
    format = formats()[name]
    path = tmp_path / f"nothing{format.suffix}"
    if not format.suffix:
        path.mkdir()
    for content in (b"", b"1,2\n3,4\n", b"PK\x03\x04 broken", b"{}\n", b"HIERARCHY\nMOTION\n"):
        if format.suffix:
            path.write_bytes(content)
        with pytest.raises(RecordingError, match="nothing"):
            check(path, model, format)
    with pytest.raises(RecordingError, match="no such file"):
        check(tmp_path / "not there.csv", model)


def test_a_file_of_another_robot_is_refused(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    from mplearn.body import human_body
    from mplearn_envs.robot import ROLES, Robot

    person = Robot.from_mjcf(human_body(1.6).xml, "person", {role: role for role in ROLES})
    path = written(tmp_path, motion, model, "unitree")
    with pytest.raises(RecordingError, match="person"):
        check(path, RobotModel.of(person))
    with pytest.raises(RecordingError, match="person"):
        check(alone(path), RobotModel.of(person))


def test_not_a_number_is_named_with_its_frame(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    path = written(tmp_path, motion, model, "mjlab")
    change_arrays(path, lambda arrays: arrays["joint_pos"].__setitem__((7, 3), np.nan))
    with pytest.raises(RecordingError, match="frame 7"):
        check(path, model)

"""GLB files: against the rules of glTF 2.0, MuJoCo and what a viewer does with them."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from export_world import written
from scipy.spatial.transform import Rotation

from mplearn.errors import RecordingError
from mplearn_envs.export import RobotModel, RobotMotion, check, export, format_of

KINDS = {5126: ("<f4", 4), 5125: ("<u4", 4)}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


def parts(path: Path) -> tuple[dict, bytes]:
    """The chunks of a GLB file, by the rules: lengths, alignment, order."""
    data = path.read_bytes()
    magic, version, length, n_text, kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    n_binary, kind = struct.unpack_from("<I4s", data, 20 + n_text)
    assert kind == b"BIN\0" and n_text % 4 == n_binary % 4 == 0
    assert 28 + n_text + n_binary == len(data)
    return json.loads(data[20 : 20 + n_text]), data[28 + n_text :]


def table(document: dict, buffer: bytes, index: int) -> np.ndarray:
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    form, size = KINDS[accessor["componentType"]]
    width = WIDTHS[accessor["type"]]
    assert view["byteOffset"] % size == 0
    assert view["byteLength"] == accessor["count"] * width * size > 0
    assert view["byteOffset"] + view["byteLength"] <= document["buffers"][0]["byteLength"]
    raw = buffer[view["byteOffset"] :][: view["byteLength"]]
    values = np.frombuffer(raw, form).reshape(-1, width)
    assert np.array_equal(values.min(axis=0), np.array(accessor["min"], form))
    assert np.array_equal(values.max(axis=0), np.array(accessor["max"], form))
    return values


def test_it_keeps_the_rules_and_shows_the_robot_as_mujoco_has_it(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    path = written(tmp_path, motion, model, "gltf")
    document, buffer = parts(path)
    nodes, (animation,) = document["nodes"], document["animations"]
    assert document["asset"]["version"] == "2.0"
    played: dict[tuple[int, str], np.ndarray] = {}
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        times = table(document, buffer, sampler["input"])[:, 0]
        assert times[0] == 0.0 and (np.diff(times) > 0).all()
        target = channel["target"]
        assert (target["node"], target["path"]) not in played and "matrix" not in nodes[
            target["node"]
        ]
        played[target["node"], target["path"]] = table(document, buffer, sampler["output"])
        assert len(played[target["node"], target["path"]]) == len(times) == len(motion)
    for (_, kind), values in played.items():
        if kind == "rotation":
            np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-6)
            assert ((values[1:] * values[:-1]).sum(axis=1) > 0).all()  # the short way round
    # what a viewer does: local poses down the tree; y is up and z ahead
    bodies = model.forward(motion.root_pos, motion.root_quat, motion.joint_pos)
    (top,) = document["scenes"][0]["nodes"]
    ahead = [(top, np.zeros(3), Rotation.identity())]
    shown = {}
    frame = len(motion) // 2
    while ahead:
        node, pos, turn = ahead.pop()
        said = nodes[node]
        place = played.get((node, "translation"), [said.get("translation", np.zeros(3))] * 999)
        own = played.get((node, "rotation"), [said.get("rotation", [0, 0, 0, 1])] * 999)
        pos = pos + turn.apply(np.array(place[frame], float))
        turn = turn * Rotation.from_quat(np.array(own[frame], float))
        shown[said["name"]] = pos[[2, 0, 1]]
        ahead += [(child, pos, turn) for child in said.get("children", [])]
    found = np.array([shown[name] for name in model.body_names])
    np.testing.assert_allclose(found, bodies.pos[frame], atol=1e-5)
    names = [span["name"] for span in animation["extras"]["primitives"]]
    assert names == [span.name for span in motion.spans]


def test_meshes_are_closed_and_seen_from_outside(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    document, buffer = parts(written(tmp_path, motion, model, "gltf"))
    assert {node["mesh"] for node in document["nodes"] if "mesh" in node} == set(
        range(len(document["meshes"]))
    )
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            corners = table(document, buffer, primitive["attributes"]["POSITION"])
            faces = table(document, buffer, primitive["indices"])[:, 0].reshape(-1, 3)
            assert faces.max() < len(corners)
            a, b, c = (corners[faces[:, k]].astype(float) for k in range(3))
            assert (a * np.cross(b, c)).sum() > 0  # six times the volume
            colour = document["materials"][primitive["material"]]["pbrMetallicRoughness"]
            assert all(0 <= x <= 1 for x in colour["baseColorFactor"])


MESHED = """<mujoco><asset><mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1  1 1 0"/></asset>
<worldbody><body name="base"><freejoint/><geom type="mesh" mesh="wedge" rgba="1 0.5 0 1"/>
<body name="arm" pos="0 0 1"><joint name="hinge" axis="0 1 0" pos="0.1 0 0"/>
<geom type="box" size="0.1 0.2 0.3"/></body></body></worldbody></mujoco>"""


def test_a_mesh_stays_as_it_is_and_a_hinge_off_the_origin_moves_it(tmp_path: Path) -> None:
    (tmp_path / "robot.xml").write_text(MESHED)
    model = RobotModel.from_mjcf(tmp_path / "robot.xml")
    still = np.tile([1.0, 0.0, 0.0, 0.0], (50, 1))
    swing = np.sin(np.linspace(0.0, 6.0, 50))[:, None]
    motion = RobotMotion("swing", ("hinge",), 50.0, np.zeros((50, 3)), still, swing)
    (path,) = export([motion], model, format_of("gltf"), tmp_path / "swing.glb")
    (verdict,) = check(path, model)
    assert verdict.misfit.position_m < 1e-6 and verdict.misfit.angle_rad < 1e-6
    document, buffer = parts(path)
    wedge = document["meshes"][0]["primitives"][0]
    corners = table(document, buffer, wedge["attributes"]["POSITION"])
    wanted = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]], float)
    np.testing.assert_allclose(
        sorted(map(tuple, corners.round(5))), sorted(map(tuple, wanted)), atol=1e-5
    )
    moved = {
        (c["target"]["node"], c["target"]["path"]) for c in document["animations"][0]["channels"]
    }
    assert moved == {(0, "translation"), (0, "rotation"), (1, "translation"), (1, "rotation")}


def test_damaged_files_are_refused_in_a_line(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    path = written(tmp_path, motion, model, "gltf")
    right = path.read_bytes()
    rng = np.random.default_rng(0)
    refused = 0
    for k in range(150):
        data = bytearray(right)
        if k % 3 == 0:
            data = data[: rng.integers(len(data))]
        elif k % 3 == 1:  # in the document
            for _ in range(3):
                data[rng.integers(20, 20 + struct.unpack_from("<I", right, 12)[0])] = rng.integers(
                    256
                )
        else:
            for _ in range(3):
                data[rng.integers(len(data))] = rng.integers(256)
        path.write_bytes(data)
        try:
            format_of("gltf").read(path, model)
        except RecordingError as error:
            refused += 1
            assert "\n" not in str(error) and path.name in str(error)
    assert refused >= 60
    with pytest.raises(RecordingError, match="no GLB file"):
        path.write_bytes(b"glTF")
        format_of("gltf").read(path, model)

"""glTF 2.0 in one binary file (GLB): the robot as it looks, and its motion as an animation [glTF].

Each body is a node with its meshes, hung on the body that carries it; the animation moves the nodes
at the frames' times, linear in between. Metres, y up, z ahead, as the format has it. Viewers of
operating systems, browsers and game engines, and Blender, open it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mplearn.errors import RecordingError
from mplearn.maths.rotations import (
    matrix_to_quaternion,
    quaternion_to_matrix,
)
from mplearn.recording import FloatArray

from ..format import LARGEST, Dialect, Format, Reading, in_order
from ..motion import RobotMotion, continuous_quaternions
from ..robot_model import RobotModel
from .glb import CORNERS, VERTICES, Document, numbers, read_glb
from .shapes import surfaces

_UPRIGHT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # x, y, z: y is up
_ROUNDED = 1e-6  # by which share a rate is off for times that have seven digits
_STILL = 1e-9  # what moves less does not
_TO_XYZW = [1, 2, 3, 0]


class GLTF(Format):
    """See the module's docstring."""

    name = "gltf"
    about = "glTF 2.0 (.glb): the robot and its animation, for viewers, browsers, Blender, engines"
    suffix = ".glb"

    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write one motion."""
        (motion,) = motions
        document = Document()
        pos, quat = _local(motion, model)
        nodes = [
            {"name": name, "translation": pos[0, b].tolist(), "rotation": quat[0, b].tolist()}
            for b, name in enumerate(model.body_names)
        ]
        for b, parent in enumerate(model.parents.tolist()):
            if parent >= 0:
                nodes[parent].setdefault("children", []).append(b)
        meshes, materials = _meshes(document, model)
        for body, mesh in meshes.items():
            nodes[body]["mesh"] = list(meshes).index(body)
            mesh["name"] = model.body_names[body]
        roots = np.flatnonzero(model.parents < 0).tolist()
        nodes.append({"name": model.name, "rotation": _turned().tolist(), "children": roots})
        document.content |= {
            "scene": 0,
            "scenes": [{"name": model.name, "nodes": [len(nodes) - 1]}],
            "nodes": nodes,
            "meshes": list(meshes.values()),
            "materials": materials,
            "animations": [_animation(document, motion, pos, quat)],
        }
        document.write(path)

    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return where the animation puts the bodies, by the names of their nodes."""
        return (_reading(path, model),)

    def dialects(self, path: Path, model: RobotModel) -> tuple[Dialect, ...]:
        """Return what it says if its quaternions are in the other order, or its axes others."""
        order = "the nodes' quaternions are w, x, y, z, not x, y, z, w"
        axes = "z is up and x ahead in it, not y and z"
        return (
            Dialect("quaternion order", order, (_reading(path, model, order="wxyz"),)),
            Dialect("axes", axes, (_reading(path, model, upright=np.eye(3)),)),
        )


def _reading(
    path: Path, model: RobotModel, order: str = "xyzw", upright: FloatArray = _UPRIGHT
) -> Reading:
    """Return what a file says, with its moving quaternions in an order, and its axes [x, y, z]."""
    content, buffer = read_glb(path)
    try:
        times, pos, turn = _played(content, buffer, order)
        names = [str(node.get("name", "")) for node in content["nodes"]]
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise RecordingError(f"{path}: no animation of a robot: {error!r}") from error
    if not (np.abs(pos) <= LARGEST).all() or not np.isfinite(turn).all():  # NaN, too
        raise RecordingError(f"{path}: no animation of a robot: it leads beyond all numbers")
    places = in_order(path, "node", names, model.body_names)
    pos = pos[:, places] @ upright
    quat = matrix_to_quaternion(upright.T @ turn[:, places])
    reading = Reading(_rate(times), pos[:, 0], quat[:, 0], None, pos, quat, times_s=times)
    return reading.require(path, model)


def _rate(times: FloatArray) -> float:
    """Return frames per second [1/s]: the plainest number that the times, rounded floats, allow."""
    rate_hz = float((len(times) - 1) / (times[-1] - times[0]))
    plain = (round(rate_hz, decimals) for decimals in range(6))
    return next((rate for rate in plain if abs(rate / rate_hz - 1.0) < _ROUNDED), rate_hz)


def _turned() -> FloatArray:
    """Return how the robot's world is turned in the file's, a quaternion (x, y, z, w)."""
    return np.asarray(matrix_to_quaternion(_UPRIGHT)[_TO_XYZW])


def _local(motion: RobotMotion, model: RobotModel) -> tuple[FloatArray, FloatArray]:
    """Return each body's place in the body that carries it, (T, B, 3), and turn (x, y, z, w)."""
    bodies = model.forward(motion.root_pos, motion.root_quat, motion.joint_pos)
    turn, pos = quaternion_to_matrix(bodies.quat), bodies.pos.copy()
    local = turn.copy()
    for b, parent in enumerate(model.parents.tolist()):
        if parent >= 0:
            back = np.swapaxes(turn[:, parent], 1, 2)
            local[:, b] = back @ turn[:, b]
            away = bodies.pos[:, b] - bodies.pos[:, parent]
            pos[:, b] = np.einsum("tij,tj->ti", back, away)
    quat = continuous_quaternions(matrix_to_quaternion(local))
    return pos, quat[..., _TO_XYZW]


def _meshes(
    document: Document, model: RobotModel
) -> tuple[dict[int, dict[str, Any]], list[dict[str, Any]]]:
    """Return the mesh of each body that has shapes, and the materials: one a colour."""
    meshes: dict[int, dict[str, Any]] = {}
    colours: dict[tuple[float, ...], int] = {}
    for shape in surfaces(model):
        material = colours.setdefault(tuple(shape.rgb), len(colours))
        primitive = {
            "attributes": {"POSITION": document.add(shape.points, VERTICES)},
            "indices": document.add(shape.faces.ravel(), CORNERS),
            "material": material,
        }
        meshes.setdefault(shape.body, {"primitives": []})["primitives"].append(primitive)
    materials = [
        {
            "pbrMetallicRoughness": {
                "baseColorFactor": [*_linear(colour), 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": 0.6,
            }
        }
        for colour in colours
    ]
    return meshes, materials


def _linear(colour: tuple[float, ...]) -> list[float]:
    """Return a colour as screens show it (sRGB) as the format counts it, by light."""
    values = np.array(colour)
    light = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return [round(float(x), 5) for x in light]


def _animation(
    document: Document, motion: RobotMotion, pos: FloatArray, quat: FloatArray
) -> dict[str, Any]:
    times = document.add(motion.times_s)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []
    for b in range(pos.shape[1]):
        for kind, values in (("translation", pos[:, b]), ("rotation", quat[:, b])):
            if b > 0 and np.ptp(values, axis=0).max() < _STILL:
                continue
            channels.append({"sampler": len(samplers), "target": {"node": b, "path": kind}})
            samplers.append(
                {"input": times, "output": document.add(values), "interpolation": "LINEAR"}
            )
    spans = [span._asdict() for span in motion.spans]
    return {
        "name": motion.name,
        "samplers": samplers,
        "channels": channels,
        "extras": {"primitives": spans, "rate_hz": motion.rate_hz},
    }


def _played(
    content: dict[str, Any], buffer: bytes, order: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the times, and where the first animation has all nodes then, in the file's axes.

    Args:
        content: The document.
        buffer: Its numbers.
        order: Of the quaternions that move nodes; those at rest are as the format has them.

    Returns:
        Shapes (T,) [s], (T, N, 3) [m] and (T, N, 3, 3).
    """
    nodes, animation = content["nodes"], content["animations"][0]
    moved: dict[tuple[int, str], FloatArray] = {}
    times: FloatArray | None = None
    for channel in animation["channels"]:
        sampler, target = animation["samplers"][channel["sampler"]], channel["target"]
        own = numbers(content, buffer, sampler["input"])[:, 0]
        if times is None:
            times = own
        if not np.array_equal(own, times) or sampler.get("interpolation", "LINEAR") != "LINEAR":
            raise ValueError("its parts move at other times, or not linearly")
        values = numbers(content, buffer, sampler["output"])
        if target["path"] == "rotation":
            values = values[:, [order.index(c) for c in "xyzw"]]
        moved[target["node"], target["path"]] = values
    if times is None or len(times) < 2:
        raise ValueError("nothing moves")
    n_frames = len(times)
    pos, turn = np.zeros((n_frames, len(nodes), 3)), np.zeros((n_frames, len(nodes), 3, 3))
    ahead = [(node, -1) for node in content["scenes"][content.get("scene", 0)]["nodes"]]
    seen: set[int] = set()
    while ahead:
        node, parent = ahead.pop()
        if node in seen:
            raise ValueError(f"node {node} hangs on two")
        seen.add(node)
        said = nodes[node]
        if "matrix" in said or any(s != 1.0 for s in said.get("scale", ())):
            raise ValueError(f"node {node} is scaled")
        place = moved.get((node, "translation"), np.array([said.get("translation", [0.0] * 3)]))
        quat = moved.get((node, "rotation"), np.array([said.get("rotation", [0.0, 0.0, 0.0, 1.0])]))
        pos[:, node], turn[:, node] = place, quaternion_to_matrix(quat[:, [3, 0, 1, 2]])
        if parent >= 0:
            pos[:, node] = pos[:, parent] + np.einsum("tij,tj->ti", turn[:, parent], pos[:, node])
            turn[:, node] = turn[:, parent] @ turn[:, node]
        ahead += [(child, node) for child in said.get("children", ())]
    return times, pos, turn

"""A foreign MJCF model brought to this package's conventions: its zero, its soles, its floor."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from mplearn.errors import RobotError
from mplearn.recording import FloatArray

from .compiling import read_model
from .drives import JointGroup
from .feet import SOLES, below

_LEVEL = 0.995  # least cosine between the floor and the foot of a robot at attention
_HALF_SOLE_M = 0.01
_ROTOR_S2 = 5e-4  # rotor inertia by torque limit [kg m^2 / (N m)], about as the humanoid's
_NEARLY_RAD = 0.1  # so far from zero a hinge may stand at attention without being told


def read_spec(source: str | Path, name: str) -> Any:
    """Return a model's ``MjSpec`` with orientations as quaternions and absolute places of files.

    Raises:
        RobotError: There is no such file, or it does not compile.
    """
    try:
        if isinstance(source, str) and "<mujoco" in source:
            spec, folder = mujoco.MjSpec.from_string(source), Path.cwd()
        else:
            path = Path(source)
            if not path.is_file():
                raise RobotError(f"robot {name!r}: there is no file {str(path)!r}")
            spec, folder = mujoco.MjSpec.from_file(str(path)), path.resolve().parent
        if all(body.explicitinertial for body in spec.bodies[1:]):
            _drop_hulls(spec)
        spec.meshdir = str((folder / spec.meshdir).resolve())
        spec.texturedir = str((folder / spec.texturedir).resolve())
        spec.compile()
        return mujoco.MjSpec.from_string(spec.to_xml())
    except ValueError as error:
        raise RobotError(f"the MJCF of robot {name!r} does not compile: {error}") from error


def _drop_hulls(spec: Any) -> None:
    """Delete hidden meshes that only collide: their convex hulls take a second to compute."""
    for geom in list(spec.geoms):
        if geom.group > 2 and geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            spec.delete(geom)


def take_out_drives(spec: Any) -> None:
    """Delete what is neither a body nor a shape: actuators, sensors, keyframes, constraints."""
    for part in ("actuators", "sensors", "keys", "equalities", "tendons", "excludes", "pairs"):
        for element in list(getattr(spec, part)):
            spec.delete(element)


def move_zero(spec: Any, attention: Mapping[str, float], name: str) -> dict[str, float]:
    """Shift the hinges' angles so that they are zero where they were ``attention`` [rad].

    Returns:
        By how much each hinge was shifted [rad], without those that were not.

    Raises:
        RobotError: An angle lies outside its limits, or cannot become zero.
    """
    shifted: dict[str, float] = {}
    for body in spec.bodies[1:]:
        later = Rotation.identity()  # by the hinges nearer to the body than the present one
        for joint in reversed(body.joints):
            if joint.type == mujoco.mjtJoint.mjJNT_FREE:
                continue
            low, high = joint.range if joint.range[0] < joint.range[1] else (-np.pi, np.pi)
            nearest = float(np.clip(0.0, low, high))  # many a knee is never quite straight
            angle = attention.get(joint.name, nearest if abs(nearest) < _NEARLY_RAD else 0.0)
            if not low - 1e-9 <= angle <= high + 1e-9:
                raise RobotError(
                    f"robot {name!r} cannot stand at attention: {joint.name!r} at {angle:.3g} rad "
                    f"is outside its limits [{low:.3g}, {high:.3g}]"
                )
            if angle and np.any(joint.pos):
                raise RobotError(
                    f"robot {name!r}: the zero of {joint.name!r} cannot be moved, for it does not "
                    f"turn about its body's origin"
                )
            if angle:
                shifted[joint.name] = float(angle)
            joint.range = (low - angle, high - angle)
            joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
            joint.ref = joint.springref = 0.0
            axis = np.array(joint.axis, dtype=np.float64)
            joint.axis = later.inv().apply(axis)
            later = Rotation.from_rotvec(angle * axis) * later
        turned = Rotation.from_quat(body.quat, scalar_first=True) * later
        body.quat = turned.as_quat(scalar_first=True)
    return shifted


def add_soles(spec: Any, feet: tuple[str, str], name: str) -> None:
    """Give each foot one box around its shapes, those that collide if any do; only soles collide.

    Raises:
        RobotError: A foot is tilted, or has no shape.
    """
    model = compiled(spec, name)
    boxes = [_sole_box(model, foot, name) for foot in feet]
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
        if geom.name in SOLES:  # those names are for the boxes that are added here
            geom.name = ""
    for foot, sole, (middle, half) in zip(feet, SOLES, boxes, strict=True):
        spec.body(foot).add_geom(
            name=sole,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=middle,
            size=half,
            mass=0.0,
            group=3,
            contype=1,
            conaffinity=1,
            condim=3,
            friction=(1.0, 0.005, 0.0001),
        )


def _sole_box(model: mujoco.MjModel, foot: str, name: str) -> tuple[FloatArray, FloatArray]:
    """Return middle and half sizes, shape (3,) each [m], of the box in the foot's frame."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    body = model.body(foot).id
    frame = data.xmat[body].reshape(3, 3)
    if frame[2, 2] < _LEVEL:
        raise RobotError(
            f"robot {name!r}: {foot!r} is not level at attention; give the angles of its ankle "
            f"there, or a foot whose z axis points up when it stands"
        )
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    own = np.isin(model.geom_bodyid, list(below(model, body)))  # the toes at zero, too
    collide = own & ((model.geom_contype != 0) | (model.geom_conaffinity != 0))
    corners = []
    for geom in np.flatnonzero(collide if collide.any() else own):
        box, turn = model.geom_aabb[geom], data.geom_xmat[geom].reshape(3, 3)
        corners.append((box[:3] + signs * box[3:]) @ turn.T + data.geom_xpos[geom])
    if not corners:
        raise RobotError(f"robot {name!r}: foot {foot!r} has no shape to stand on")
    local = (np.concatenate(corners) - data.xpos[body]) @ frame
    low, high = local.min(axis=0), local.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    middle[2], half[2] = low[2] + _HALF_SOLE_M, _HALF_SOLE_M
    return middle, half


def add_servos(spec: Any, groups: tuple[JointGroup, ...]) -> None:
    """Give each hinge its position servo, in the hinges' order.

    A drive whose torque limit is not the model's own gets a rotor that fits it: full torque on a
    part as light as a toe would throw it past its target within one period, to and fro.
    """
    drives = {hinge: group for group in groups for hinge in group.names}
    for joint in spec.joints:
        if joint.type == mujoco.mjtJoint.mjJNT_FREE:
            continue
        drive = drives[joint.name]
        if joint.actfrcrange[0] >= joint.actfrcrange[1]:
            joint.armature = max(joint.armature, _ROTOR_S2 * drive.torque)
        joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
        servo = spec.add_actuator(
            name=joint.name,
            target=joint.name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            forcerange=(-drive.torque, drive.torque),
            forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        )
        servo.set_to_position(kp=drive.stiffness, kv=drive.damping)


def on_our_floor(spec: Any, name: str) -> str:
    """Return the model as MJCF text, with the humanoid's floor, light, camera and options."""
    robot, ours = ET.fromstring(spec.to_xml()), ET.fromstring(read_model("humanoid"))
    robot.set("model", name)
    for tag in ("option", "visual", "statistic", "keyframe"):
        for element in robot.findall(tag):
            robot.remove(element)
    robot.extend(element for tag in ("option", "visual") for element in ours.findall(tag))
    world, assets = _child(robot, "worldbody"), _child(robot, "asset")
    for element in list(world):
        if element.tag != "body":
            world.remove(element)
    around = [each for each in _child(ours, "worldbody") if each.tag != "body"]
    taken = {(each.tag, each.get("name")) for each in around}
    for element in world.iter():
        if (element.tag, element.get("name")) in taken:
            del element.attrib["name"]
    for element in _child(ours, "asset"):
        if element.get("name") in ("floor", "tiles") or element.get("type") == "skybox":
            assets.append(_classless(_owned(element, "name", "texture")))
    world.extend(_classless(_owned(each, "material")) for each in around)
    return ET.tostring(robot, encoding="unicode")


def compiled(spec: Any, name: str) -> mujoco.MjModel:
    """Compile a changed model.

    Raises:
        RobotError: It does not compile.
    """
    try:
        return spec.compile()
    except ValueError as error:
        raise RobotError(f"the MJCF of robot {name!r} does not compile: {error}") from error


def _child(element: ET.Element, tag: str) -> ET.Element:
    found = element.find(tag)
    return ET.SubElement(element, tag) if found is None else found


def _owned(element: ET.Element, *attributes: str) -> ET.Element:
    """Mark the names of our assets, for the robot may have some of the same name."""
    for attribute in attributes:
        if attribute in element.attrib:
            element.set(attribute, f"mplearn {element.attrib[attribute]}")
    return element


def _classless(element: ET.Element) -> ET.Element:
    element.attrib.pop("class", None)
    return element

"""A foreign MJCF model brought to this package's conventions: its soles, servos, floor."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import mujoco

from mplearn.errors import RobotError
from mplearn.recording import FloatArray

from .compiling import read_model
from .drives import JointGroup
from .feet import LEVEL, SOLES, foot_points
from .unframe import without_frames

_HALF_SOLE_M = 0.01
_ROTOR_S2 = 5e-4  # rotor inertia by torque limit [kg m^2 / (N m)], about as the humanoid's


def read_spec(source: str | Path, name: str) -> Any:
    """Return a model's ``MjSpec`` without frames, with quaternions and absolute places of files.

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
        return without_frames(mujoco.MjSpec.from_string(spec.to_xml()))
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
            solref=(0.02, 1.0),
            solimp=(0.9, 0.95, 0.001, 0.5, 2.0),
            priority=0,
            margin=0.0,
            gap=0.0,
        )


def _sole_box(model: mujoco.MjModel, foot: str, name: str) -> tuple[FloatArray, FloatArray]:
    """Return middle and half sizes, shape (3,) each [m], of the box in the foot's frame."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    body = model.body(foot).id
    frame = data.xmat[body].reshape(3, 3)
    if frame[2, 2] < LEVEL:
        raise RobotError(
            f"robot {name!r}: {foot!r} is not level at attention; give the angles of its ankle "
            "there"
        )
    points = foot_points(model, data, body)  # the toes at zero, too
    if not len(points):
        raise RobotError(f"robot {name!r}: foot {foot!r} has no shape to stand on")
    local = (points - data.xpos[body]) @ frame
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
            ctrllimited=mujoco.mjtLimited.mjLIMITED_FALSE,  # and not as the model's own drives
            gear=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            dyntype=mujoco.mjtDyn.mjDYN_NONE,
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
    for element in list(assets):
        if element.get("type") == "skybox":
            assets.remove(element)
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

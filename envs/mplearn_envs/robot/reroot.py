"""A foreign model's tree re-rooted at its pelvis, zero where it stands, frames as ours are.

Hinges of one body turn it by ``exp(x_1 d_1) ... exp(x_n d_n)`` from where it stands upright, where
``x_k`` are their axes in that posture, and so whichever bodies' frames they are written in; where
parent and child change places, their order is reversed and they turn the other way. Nothing else
of the mechanics changes.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise, permutations, product
from typing import Any, NamedTuple

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from mplearn.errors import RobotError
from mplearn.recording import FloatArray

from .feet import LEVEL, below, foot_points, way_up

_NEARLY_RAD = 0.1  # so far from zero a hinge may stand at attention without being told
_ASKEW_RAD = 0.35  # a model that stands farther off its axes is turned by where its hips are
_SIDEWAYS = 0.5  # least cosine between a knee's axis and the line through the hips
_OFF_M = 1e-3  # a hip or an ankle that is nearer to its body's origin is at it
#: The 24 rotations that exchange axes.
_EXCHANGES = Rotation.from_matrix(
    [
        turn
        for places in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
        if np.linalg.det(turn := np.diag(signs)[list(places)]) > 0
    ]
)


@dataclass(frozen=True)
class Origin:
    """The model that a re-rooted robot came from, for those who have it.

    Attributes:
        xml: Its MJCF text, as it was but floating, alone and without drives.
        base: The body by which it floats.
        offset: Where that body's origin is there, in the frame of our body of that name, shape (3,)
            [m].
        quat: How it is turned there, in that frame (w, x, y, z).
    """

    xml: str
    base: str
    offset: tuple[float, ...]
    quat: tuple[float, ...]


@dataclass(frozen=True)
class Rooted:
    """A re-rooted model.

    Attributes:
        spec: The model.
        shifted: Angle of each hinge at attention in the zero that it had, those without 0 [rad].
        flipped: Hinges that count the other way.
        origin: What it was; None where only zeros were moved and hinges flipped.
    """

    spec: Any
    shifted: dict[str, float]
    flipped: tuple[str, ...]
    origin: Origin | None


class _Frames(NamedTuple):
    """Frames of all bodies in the world, at attention: turns and places, shape (B,) and (B, 3)."""

    turn: Rotation
    place: FloatArray

    def locally(self, body: int, turn: Rotation, place: FloatArray) -> tuple[Rotation, FloatArray]:
        """Return a turn and a place of the world in the frame of a body."""
        back = self.turn[body].inv()
        return back * turn, back.apply(place - self.place[body])

    def world(self, body: int, turn: Rotation, place: FloatArray) -> tuple[Rotation, FloatArray]:
        """Return a turn and a place in the frame of a body, as they are in the world."""
        own = self.turn[body]
        return own * turn, own.apply(place) + self.place[body]


class _Hinges(NamedTuple):
    """All joints: angles at attention [rad], limits, anchors and axes in the world there."""

    angle: FloatArray
    limits: FloatArray
    anchor: FloatArray
    axis: FloatArray


def rerooted(
    spec: Any, segments: Mapping[str, str], attention: Mapping[str, float], name: str
) -> Rooted:
    """Return a model that floats by its pelvis, x ahead, z up, zero where it stands at attention.

    Args:
        spec: The model; it is changed.
        segments: The body of each role.
        attention: Angles of the hinges at attention, in the model's own zero [rad].
        name: What the robot is called.

    Raises:
        RobotError: An angle lies outside its limits, or the knees bend as no human's do.
    """
    was = str(spec.to_xml())
    model = spec.compile()
    pelvis = model.body(segments["pelvis"]).id
    root = int(model.body_rootid[pelvis])
    angle, limits = _attention(model, attention, name)
    old, hinges, soles = _stood(model, segments, angle, limits, name)
    new = _our_frames(model, segments, old, hinges, soles)
    path = way_up(model, pelvis)[::-1]
    owner = np.array(model.jnt_bodyid)  # the body that a joint moves, in the new tree
    flip = np.zeros(model.njnt, dtype=np.bool_)
    for parent, child in pairwise(path):
        owner[model.jnt_bodyid == child] = parent
    for side in "lr":
        shank, thigh = (segments[f"{role}_{side}"] for role in ("shank", "thigh"))
        flip[_knee_that_flips(model, shank, thigh, hinges, name)] = True
    turned = np.isin(model.jnt_bodyid, path[1:])  # parent and child change places
    _write(spec, model, old, new, hinges, owner, flip, turned)
    spec = _nested(spec, model, new, path)
    names = [model.joint(j).name for j in range(model.njnt)]
    own = [j for j in range(model.njnt) if model.jnt_type[j] != mujoco.mjtJoint.mjJNT_FREE]
    same = (old.turn.inv() * new.turn).magnitude() < 1e-4
    same &= np.linalg.norm(old.place - new.place, axis=1) < 1e-6
    robot = sorted(below(model, root))
    origin = None
    if len(path) > 1 or not same[robot].all():
        turn, place = new.locally(root, old.turn[root], old.place[root])
        base = model.body(root).name
        quat = turn.as_quat(scalar_first=True)
        origin = Origin(_floating(was, base), base, tuple(place.tolist()), tuple(quat.tolist()))
    return Rooted(
        spec,
        {names[j]: float(angle[j]) for j in own if angle[j]},
        tuple(names[j] for j in own if flip[j]),
        origin,
    )


def _attention(
    model: mujoco.MjModel, attention: Mapping[str, float], name: str
) -> tuple[FloatArray, FloatArray]:
    """Return the joints' angles at attention, shape (J,), and their limits, shape (J, 2) [rad]."""
    angle, limits = np.zeros(model.njnt), np.tile([-np.pi, np.pi], (model.njnt, 1))
    for j in range(model.njnt):
        if model.jnt_type[j] != mujoco.mjtJoint.mjJNT_HINGE:
            continue
        low, high = model.jnt_range[j]
        if low < high:
            limits[j] = low, high
        low, high = limits[j]
        nearest = float(np.clip(0.0, low, high))  # many a knee is never quite straight
        hinge = model.joint(j).name
        angle[j] = attention.get(hinge, nearest if abs(nearest) < _NEARLY_RAD else 0.0)
        if not low - 1e-9 <= angle[j] <= high + 1e-9:
            raise RobotError(
                f"robot {name!r} cannot stand at attention: {hinge!r} at {angle[j]:.3g} rad is "
                f"outside its limits [{low:.3g}, {high:.3g}]"
            )
    return angle, limits


def _stood(
    model: mujoco.MjModel,
    segments: Mapping[str, str],
    angle: FloatArray,
    limits: FloatArray,
    name: str,
) -> tuple[_Frames, _Hinges, list[FloatArray]]:
    """Return where all is at attention, in a world whose x axis is ahead and whose z axis is up.

    The last are the points around the left and the right foot, shape (P, 3) each.

    Raises:
        RobotError: Hips and ankles do not say where ahead and up are.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    hinge = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
    data.qpos[model.jnt_qposadr[hinge]] = angle[hinge]
    mujoco.mj_kinematics(model, data)
    hips, ankles = (
        [data.xpos[model.body(segments[f"{role}_{side}"]).id] for side in "lr"]
        for role in ("thigh", "foot")
    )
    left = hips[0] - hips[1]
    up = 0.5 * (hips[0] + hips[1] - ankles[0] - ankles[1])
    ahead = np.cross(left, up)
    axes = np.array([ahead, np.cross(up, ahead), up])
    lengths = np.linalg.norm(axes, axis=1, keepdims=True)
    if lengths.min() < 1e-9:
        raise RobotError(f"robot {name!r}: its hips and ankles are in one line at attention")
    upright = Rotation.from_matrix(axes / lengths)
    off = (_EXCHANGES.inv() * upright).magnitude()
    world = _EXCHANGES[int(off.argmin())] if off.min() < _ASKEW_RAD else upright
    turn = world * Rotation.from_quat(data.xquat, scalar_first=True)
    anchor, axis = world.apply(data.xanchor), world.apply(data.xaxis)
    feet = [model.body(segments[f"foot_{side}"]).id for side in "lr"]
    points = [world.apply(foot_points(model, data, foot)) for foot in feet]
    return _Frames(turn, world.apply(data.xpos)), _Hinges(angle, limits, anchor, axis), points


def _our_frames(
    model: mujoco.MjModel,
    segments: Mapping[str, str],
    old: _Frames,
    hinges: _Hinges,
    soles: list[FloatArray],
) -> _Frames:
    """Return frames as controllers want them: an upright pelvis, hips and ankles for origins.

    A foot keeps its axes, whichever they are called; but where they are askew in it, as they are
    if it is thinner along the floor's, it gets the floor's.
    """
    turns, places = list(old.turn), old.place.copy()
    pelvis = model.body(segments["pelvis"]).id
    turns[pelvis] = Rotation.identity()
    for side, points in zip("lr", soles, strict=True):
        foot = model.body(segments[f"foot_{side}"]).id
        axes = turns[foot] * _EXCHANGES
        turns[foot] = axes[int(axes.magnitude().argmin())]
        up = turns[foot].as_matrix()[:, 2]
        if up[2] < LEVEL and np.ptp(points[:, 2]) < np.ptp(points @ up):
            turns[foot] = Rotation.identity()
        leg = way_up(model, foot)
        leg = leg[: leg.index(pelvis)]
        thigh = [body for body in leg if model.body_jntnum[body]][-1]
        for body in (thigh, foot):
            first, n = int(model.body_jntadr[body]), int(model.body_jntnum[body])
            away = old.place[body] - hinges.anchor[first : first + n]
            along = np.einsum("ji,ji->j", away, hinges.axis[first : first + n])
            away -= along[:, None] * hinges.axis[first : first + n]
            if n and np.linalg.norm(away, axis=1).max() > _OFF_M:
                places[body] = hinges.anchor[first]
    return _Frames(Rotation.concatenate(turns), places)


def _knee_that_flips(
    model: mujoco.MjModel, shank: str, thigh: str, hinges: _Hinges, name: str
) -> list[int]:
    """Return the hinge from a thigh to its shank if it counts negative when flexed, else nothing.

    Raises:
        RobotError: It does not turn about the line through the hips, or bends ahead.
    """
    way = way_up(model, model.body(shank).id)
    leg = way[: way.index(model.body(thigh).id)] if model.body(thigh).id in way else []
    knees = [j for j in range(model.njnt) if model.jnt_bodyid[j] in leg]
    if len(knees) != 1:
        return []
    knee = knees[0]
    hinge, aside = model.joint(knee).name, float(hinges.axis[knee, 1])
    if abs(aside) < _SIDEWAYS:
        raise RobotError(
            f"robot {name!r}: its knee {hinge!r} turns about {hinges.axis[knee].round(2).tolist()} "
            "(x ahead, y left, z up), not about the line through its hips"
        )
    low, high = np.sort((hinges.limits[knee] - hinges.angle[knee]) * np.sign(aside))
    if high < -low - 1e-9:
        raise RobotError(
            f"robot {name!r}: its knee {hinge!r} bends ahead, by up to {-low:.3g} rad, and back by "
            f"{high:.3g}: left and right of the segments are exchanged, or it is no humanoid's"
        )
    return [knee] if aside < 0.0 else []


def _write(
    spec: Any,
    model: mujoco.MjModel,
    old: _Frames,
    new: _Frames,
    hinges: _Hinges,
    owner: Any,
    flip: Any,
    turned: Any,
) -> None:
    """Write all that bodies carry in their new frames, and the joints in those of their owners."""
    for body in spec.bodies[1:]:
        b = body.id
        same = (new.turn[b].inv() * old.turn[b]).magnitude() < 1e-12
        if not (same and np.array_equal(new.place[b], old.place[b])):
            for part in (*body.geoms, *body.sites, *body.cameras):
                turn = Rotation.from_quat(part.quat, scalar_first=True)
                turn, part.pos = new.locally(b, *old.world(b, turn, np.array(part.pos)))
                part.quat = turn.as_quat(scalar_first=True)
            for light in body.lights:
                _, light.pos = new.locally(b, *old.world(b, old.turn[b], np.array(light.pos)))
                light.dir = (new.turn[b].inv() * old.turn[b]).apply(light.dir)
            if body.explicitinertial:
                turn = Rotation.from_quat(body.iquat, scalar_first=True)
                turn, body.ipos = new.locally(b, *old.world(b, turn, np.array(body.ipos)))
                body.iquat = turn.as_quat(scalar_first=True)
        for joint in body.joints:
            j = joint.id
            if joint.type != mujoco.mjtJoint.mjJNT_HINGE:
                continue
            back, at = new.turn[owner[j]].inv(), new.place[owner[j]]
            axis, place = back.apply(hinges.axis[j]), back.apply(hinges.anchor[j] - at)
            sign = -1.0 if flip[j] else 1.0
            joint.axis = axis * sign * (-1.0 if turned[j] else 1.0)
            joint.pos = np.where(np.abs(place) < 1e-9, 0.0, place)
            joint.range = np.sort(sign * (hinges.limits[j] - hinges.angle[j]))
            joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
            joint.actfrcrange = np.sort(sign * np.array(joint.actfrcrange))
            joint.springref = sign * (joint.springref - hinges.angle[j])
            joint.ref = 0.0


def _nested(spec: Any, model: mujoco.MjModel, new: _Frames, path: list[int]) -> Any:
    """Return the model with its bodies hung on each other anew, from the pelvis on.

    What else lies about in its world is left out.
    """
    whole = ET.fromstring(spec.to_xml())
    world = whole.find("worldbody")
    assert world is not None
    _name_classes(world, None)
    elements = {k + 1: element for k, element in enumerate(world.iter("body"))}
    parent = {b: int(model.body_parentid[b]) for b in below(model, path[0])}
    joints = {b: [e for e in elements[b] if e.tag in ("joint", "freejoint")] for b in parent}
    for b in parent:
        for child in (*joints[b], *elements[b].findall("body")):
            elements[b].remove(child)
    free = [e for e in joints[path[0]] if e.tag == "freejoint" or e.get("type") == "free"]
    moved = {above: joints[child][::-1] for above, child in pairwise(path)}
    joints |= moved | {path[-1]: free or [ET.Element("freejoint")]}
    parent |= dict(pairwise(path)) | {path[-1]: 0}
    for element in world.findall("body"):
        world.remove(element)
    _hang(world, 0, parent, elements, joints, new)
    return mujoco.MjSpec.from_string(ET.tostring(whole, encoding="unicode"))


def _hang(
    element: ET.Element,
    body: int,
    parent: Mapping[int, int],
    elements: Mapping[int, ET.Element],
    joints: Mapping[int, list[ET.Element]],
    new: _Frames,
) -> None:
    for child in sorted(b for b, above in parent.items() if above == body):
        turn, place = new.turn[child], new.place[child]
        if body:
            turn, place = new.locally(body, turn, place)
        own = elements[child]
        own.set("pos", " ".join(f"{x:.9g}" for x in place))
        own.set("quat", " ".join(f"{x:.9g}" for x in turn.as_quat(scalar_first=True)))
        for joint in reversed(joints[child]):
            own.insert(0, joint)
        element.append(own)
        _hang(own, child, parent, elements, joints, new)


def _name_classes(element: ET.Element, inherited: str | None) -> None:
    """Name the class of each element, that it may move to another body."""
    for child in element:
        if child.tag == "body":
            _name_classes(child, child.attrib.pop("childclass", inherited))
        elif inherited is not None and child.tag in ("geom", "joint", "site", "camera", "light"):
            child.attrib.setdefault("class", inherited)


def _floating(xml: str, base: str) -> str:
    """Return a model's text in which one of its bodies floats, and nothing else lies about."""
    spec = mujoco.MjSpec.from_string(xml)
    body = spec.body(base)
    for other in list(spec.worldbody.bodies):
        if other.parent.name == "world" and other.name != base:
            spec.delete(other)
    if not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in body.joints):
        body.add_freejoint()
    return str(spec.to_xml())

"""A foreign model without frames: what they hold lies where it lay, in the body itself."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from mplearn.recording import FloatArray


def without_frames(spec: Any) -> Any:
    """Return a model without frames, which writes orientations as quaternions.

    Args:
        spec: The model, with orientations as quaternions; it is changed.
    """
    if not spec.frames:
        return spec
    for part in (*spec.bodies[1:], *spec.geoms, *spec.sites, *spec.cameras):
        turn, place = _pose(part.frame)
        part.pos = turn.apply(part.pos) + place
        part.quat = (turn * Rotation.from_quat(part.quat, scalar_first=True)).as_quat(
            scalar_first=True
        )
    for joint in spec.joints:
        turn, place = _pose(joint.frame)
        joint.pos, joint.axis = turn.apply(joint.pos) + place, turn.apply(joint.axis)
    for light in spec.lights:
        turn, place = _pose(light.frame)
        light.pos, light.dir = turn.apply(light.pos) + place, turn.apply(light.dir)
    for frame in spec.frames:
        frame.pos, frame.quat = np.zeros(3), np.eye(4)[0]
    whole = ET.fromstring(spec.to_xml())
    _lift(whole)
    return mujoco.MjSpec.from_string(ET.tostring(whole, encoding="unicode"))


def _pose(frame: Any) -> tuple[Rotation, FloatArray]:
    """Return how a frame lies in its body: turn, and place [m]; None is the body itself."""
    turn, place = Rotation.identity(), np.zeros(3)
    while frame is not None:
        outer = Rotation.from_quat(frame.quat, scalar_first=True)
        turn, place = outer * turn, outer.apply(place) + frame.pos
        frame = frame.frame
    return turn, place


def _lift(parent: ET.Element) -> None:
    """Put in the place of each frame what it holds, of the class that it has there."""
    k = 0
    while k < len(parent):
        child = parent[k]
        if child.tag != "frame":
            _lift(child)
            k += 1
            continue
        if (kind := child.get("childclass")) is not None:
            for own in child:
                nests = own.tag in ("body", "frame")
                own.attrib.setdefault("childclass" if nests else "class", kind)
        parent[k : k + 1] = list(child)

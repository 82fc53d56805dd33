"""The human body at any size: the committed model, stretched segment by segment."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np

from mplearn.errors import BodyError
from mplearn.recording import FloatArray

from .body import Body, body_from_xml

# what can be longer or shorter than the average person's, and along which axes of which bodies (x,
# y, z)
PROPORTIONS: dict[str, tuple[tuple[str, ...], tuple[bool, bool, bool]]] = {
    "pelvis_width": (("pelvis",), (False, True, False)),
    "trunk": (("pelvis", "abdomen", "chest"), (False, False, True)),
    "shoulder_width": (("chest", "clavicle_l", "clavicle_r"), (False, True, False)),
    "head": (("head",), (True, True, True)),
    "upper_arm": (("upper_arm_l", "upper_arm_r"), (False, False, True)),
    "forearm": (("forearm_l", "forearm_r"), (False, False, True)),
    "hand": (("hand_l", "hand_r"), (False, False, True)),
    "thigh": (("thigh_l", "thigh_r"), (False, False, True)),
    "shank": (("shank_l", "shank_r"), (False, False, True)),
    "foot": (("foot_l", "foot_r", "toes_l", "toes_r"), (True, False, False)),
}


def human_body(height_m: float = 1.75, proportions: Mapping[str, float] | None = None) -> Body:
    """Return a human of a given stature.

    Args:
        height_m: Stature [m], in (0.5, 2.6). It is met exactly, whatever the proportions.
        proportions: Factors on the average proportions, by the names in `PROPORTIONS`: 1.1 for
            "thigh" is a thigh a tenth longer than the average person's of the same build. Mass
            follows the volume of each segment.

    Raises:
        BodyError: The stature or a factor is out of range, or a proportion has an unknown name.

    Example:
        >>> body = human_body(1.60)
        >>> len(body.joint_names), body.joint_names[:2]
        (40, ('lumbar_pitch', 'lumbar_roll'))
    """
    if not 0.5 < height_m < 2.6:
        raise BodyError(f"height_m must lie in (0.5, 2.6) m, not {height_m}")
    chosen = dict(proportions or {})
    unknown = sorted(set(chosen) - set(PROPORTIONS))
    if unknown:
        raise BodyError(f"unknown proportions {unknown}; allowed are {sorted(PROPORTIONS)}")
    for name, factor in chosen.items():
        if not 0.4 < factor < 2.5:
            raise BodyError(f"proportion {name!r} must lie in (0.4, 2.5), not {factor}")
    return _scaled_human(float(height_m), tuple(sorted(chosen.items())))


@cache
def _reference() -> Body:
    xml = (files(__package__) / "human.xml").read_text(encoding="utf-8")
    return body_from_xml("human", xml)


@cache
def _scaled_human(height_m: float, proportions: tuple[tuple[str, float], ...]) -> Body:
    reference = _reference()
    factors = np.ones_like(reference.tree.offset)
    for name, factor in proportions:
        bodies, axes = PROPORTIONS[name]
        for body in bodies:
            factors[reference.tree.body(body), np.flatnonzero(axes)] *= factor
    factors *= height_m / _stature(reference, factors)
    tree = reference.tree.scaled(factors)
    named = dict(zip(tree.body_names, factors, strict=True))
    return body_from_xml("human", scale_mjcf(reference.xml, named, tree.offset[0]))


def _stature(body: Body, factors: FloatArray) -> float:
    tree = body.tree.scaled(factors)
    return float(tree.site_positions(tree.rest)[tree.site_names.index("head_top"), 2])


def scale_mjcf(xml: str, factors: Mapping[str, FloatArray], base: FloatArray) -> str:
    """Stretch the bodies of an MJCF text, each along its own axes.

    Args:
        xml: Model whose body frames are all parallel at rest, with explicit inertias.
        factors: Factors (3,) for each body by name: on what is attached to it (children, shapes,
            sites) and, as their product, on its mass.
        base: Position of the root [m], shape (3,).
    """
    root = ET.fromstring(xml)
    for body in root.iter("body"):
        own = factors[body.attrib["name"]]
        for child in body:
            if child.tag in ("body", "geom", "site", "inertial"):
                _scale_element(child, own)
    for body in root.findall("worldbody/body"):
        body.set("pos", _text(base))
    return ET.tostring(root, encoding="unicode")


def _scale_element(element: ET.Element, factors: FloatArray) -> None:
    if "pos" in element.attrib:
        element.set("pos", _text(_numbers(element.attrib["pos"]) * factors))
    if "fromto" in element.attrib:
        element.set("fromto", _text(_numbers(element.attrib["fromto"]) * np.tile(factors, 2)))
    if element.tag == "geom":
        size = _numbers(element.attrib["size"])
        element.set("size", _text(size * (factors if size.size == 3 else factors.mean())))
    if element.tag == "inertial":
        growth = float(np.prod(factors))
        element.set("mass", _text(np.array([float(element.attrib["mass"]) * growth])))
        inertia = _numbers(element.attrib["diaginertia"])
        squares = (inertia.sum() / 2 - inertia) * factors**2  # of the lengths along x, y, z
        element.set("diaginertia", _text((squares.sum() - squares) * growth))


def _numbers(text: str) -> FloatArray:
    return np.array(text.split(), dtype=np.float64)


def _text(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)

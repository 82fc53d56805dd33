"""The tree that follows the markers: the body's own, with what a person's shoulders do besides.

A person's shoulder joint rises by several centimetres with the arm, and the robot's does not.
Where a body has no clavicles, the follower gets some that only slide: they take up the shoulder's
path, so that it bends neither the trunk nor the arm, while the arm's orientation stays that of the
body's own hinges.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from mplearn.maths.read_only import read_only
from mplearn.recording import BoolArray, FloatArray, IntArray

from ..kinematics.tree import KinematicTree
from ..models.body import Body
from ..models.human import human_body

GIRDLE_RANGE_M = 0.09
GIRDLE_SIGMA_M = 0.03  # how far a shoulder usually is from its place


@dataclass(frozen=True, eq=False)
class Follower:
    """A body as the solver sees it, shared by all who follow that body: its arrays refuse changes.

    Attributes:
        body: The body whose posture is wanted.
        tree: Its kinematics, with sliding clavicles where it has none.
    """

    body: Body
    tree: KinematicTree

    @property
    def is_human(self) -> bool:
        """Whether the body has a person's spine and clavicles."""
        return all(name in self.body.tree.body_names for name in ("abdomen", "clavicle_l"))

    @cached_property
    def free(self) -> BoolArray:
        """Degrees of freedom of the tree that may move: all but the held hinges, shape (6 + n,)."""
        moves = [True] * 6 + [name not in self.body.held for name in self.tree.joint_names]
        return read_only(np.array(moves, dtype=np.bool_))

    @cached_property
    def own(self) -> IntArray:
        """Where the body's own posture lies in the tree's, shape (nq,)."""
        joints = [7 + self.tree.joint_names.index(name) for name in self.body.joint_names]
        return read_only(np.array([*range(7), *joints], dtype=np.int64))

    @cached_property
    def rest_weight(self) -> FloatArray:
        """Weight of each joint's distance from zero, shape (n,) [1/rad^2, for slides 1/m^2].

        A joint's range is taken for four standard deviations of its angle.
        """
        sigma = np.ptp(self.tree.limits, axis=1) / 4
        weight: FloatArray = np.where(self.tree.slides, GIRDLE_SIGMA_M, sigma) ** -2.0
        return read_only(weight)


@lru_cache(maxsize=16)
def follower(body: Body) -> Follower:
    """Return the follower of a body: the same for the same body, as nobody changes it."""
    if "clavicle_l" in body.tree.body_names:
        return Follower(body, body.tree)
    import mujoco

    root = ET.fromstring(body.xml)
    for side in "lr":
        _add_clavicle(root, side, body.tree.offset[0, 2])
    xml = ET.tostring(root, encoding="unicode")
    return Follower(body, KinematicTree.from_model(mujoco.MjModel.from_xml_string(xml)))


def _add_clavicle(root: ET.Element, side: str, hip_height: float) -> None:
    person = human_body().tree
    arm_name = f"upper_arm_{side}"
    inner = person.offset[person.body(arm_name)] * hip_height / person.offset[0, 2]
    for parent in root.iter("body"):
        for index, arm in enumerate(parent):
            if arm.tag == "body" and arm.attrib.get("name") == arm_name:
                outer = np.array(arm.attrib["pos"].split(), dtype=np.float64) - inner
                clavicle = ET.Element("body", name=f"clavicle_{side}", pos=_text(outer))
                for axis, direction in (("x", "1 0 0"), ("z", "0 0 1")):
                    ET.SubElement(
                        clavicle,
                        "joint",
                        name=f"clavicle_{axis}_{side}",
                        type="slide",
                        axis=direction,
                        range=f"{-GIRDLE_RANGE_M} {GIRDLE_RANGE_M}",
                    )
                ET.SubElement(clavicle, "inertial", pos="0 0 0", mass="0.01", diaginertia="1 1 1")
                arm.set("pos", _text(inner))
                clavicle.append(arm)
                parent[index] = clavicle
                return


def _text(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)

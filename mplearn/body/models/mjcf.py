"""How both bodies are drawn as MJCF: a part with its joints and inertia, and the shapes one sees.

The elements passed around are ``dm_control.mjcf`` elements; this module itself imports nothing
heavy.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import radians
from typing import Any, NamedTuple

from mplearn.recording import FloatArray

Vector = Sequence[float] | FloatArray

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
COLLIDES, VISUAL = 3, 1  # geom groups: MuJoCo's viewers show 0-2 and hide 3


class Hinge(NamedTuple):
    """A hinge at a part's origin.

    Attributes:
        name: Joint name.
        axis: Axis in the part's frame at rest, length 3.
        low_deg: Lower limit [deg].
        high_deg: Upper limit [deg].
        armature: Rotor inertia seen at the joint [kg m^2].
    """

    name: str
    axis: Vector
    low_deg: float
    high_deg: float
    armature: float = 0.0


def empty_model(name: str, materials: dict[str, dict[str, Any]]) -> Any:
    """Return an empty MJCF model with the given materials and no floor, light or actuator."""
    from dm_control import mjcf

    root = mjcf.RootElement(model=name)
    root.compiler.angle = "radian"
    root.compiler.autolimits = True
    root.default.geom.contype = 0
    root.default.geom.conaffinity = 0
    root.default.geom.group = VISUAL
    root.default.geom.mass = 0
    root.default.site.group = 4
    root.default.site.size = [0.008]
    for material, looks in materials.items():
        root.asset.add("material", name=material, **looks)
    return root


def add_part(
    parent: Any,
    name: str,
    pos: Vector,
    hinges: Sequence[Hinge],
    mass: float,
    centre: Vector,
    size: Vector,
) -> Any:
    """Add a rigid part: its hinges, and the inertia of a solid box of the given size.

    Args:
        parent: Element to hang the part on.
        name: Body name.
        pos: Origin in the parent's frame [m].
        hinges: Joints, in kinematic order.
        mass: Mass [kg].
        centre: Centre of mass in the part's frame [m].
        size: Edge lengths of the box whose inertia the part takes [m].
    """
    body = parent.add("body", name=name, pos=list(pos))
    a, b, c = (edge * edge * mass / 12.0 for edge in size)
    body.add(
        "inertial",
        pos=list(centre),
        mass=mass,
        diaginertia=[b + c, a + c, a + b],
    )
    for hinge in hinges:
        body.add(
            "joint",
            name=hinge.name,
            type="hinge",
            axis=list(hinge.axis),
            range=[radians(hinge.low_deg), radians(hinge.high_deg)],
            armature=hinge.armature,
        )
    return body


def capsule(body: Any, start: Vector, end: Vector, radius: float, material: str) -> None:
    """Draw a capsule between two points [m]."""
    body.add("geom", type="capsule", fromto=[*start, *end], size=[radius], material=material)


def cylinder(body: Any, start: Vector, end: Vector, radius: float, material: str) -> None:
    """Draw a cylinder between two points [m]."""
    body.add("geom", type="cylinder", fromto=[*start, *end], size=[radius], material=material)


def ellipsoid(body: Any, pos: Vector, radii: Vector, material: str) -> None:
    """Draw an ellipsoid with the given radii [m]."""
    body.add("geom", type="ellipsoid", pos=list(pos), size=list(radii), material=material)


def box(body: Any, pos: Vector, half: Vector, material: str) -> None:
    """Draw a box with the given half edges [m]."""
    body.add("geom", type="box", pos=list(pos), size=list(half), material=material)


def add_sole(foot: Any, side: str, pos: Vector, half: Vector) -> None:
    """Mark the four lower corners of a foot's box as sites ``sole_{heel,toe}_{in,out}_{side}``."""
    outward = 1.0 if side == "l" else -1.0
    for end, sx in (("heel", -1.0), ("toe", 1.0)):
        for edge, sy in (("in", -outward), ("out", outward)):
            foot.add(
                "site",
                name=f"sole_{end}_{edge}_{side}",
                pos=[pos[0] + sx * half[0], pos[1] + sy * half[1], pos[2] - half[2]],
            )


def to_xml(root: Any) -> str:
    """Return the model as MJCF text, numbers to the micrometre."""
    return str(root.to_xml_string(precision=7))

"""A body: an MJCF model with what the rest of the library asks of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from mplearn.errors import BodyError
from mplearn.maths.read_only import read_only
from mplearn.recording import FloatArray, IntArray

from ..kinematics.tree import KinematicTree

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, eq=False)
class Body:
    """A kinematic body, human or robot.

    A posture ``q`` has MuJoCo's qpos layout, shape (7 + n,): position of the pelvis [m], its
    quaternion (w, x, y, z), then the n hinge angles [rad] in the order of `joint_names`.
    At ``q = rest`` the body stands upright at the origin, soles on z = 0, arms hanging.

    Attributes:
        name: "human" or "robot".
        xml: The model as MJCF text, without floor, lights or actuators.
        joint_names: Names of the n hinges, in the order of qpos.
        joint_limits: Lower and upper limit of each hinge, shape (n, 2) [rad].
        height_m: Stature, sole to top of the head [m].
        tree: The same kinematics as plain arrays.
        held: Hinges that are kept at zero, not driven.

    Example:
        >>> from mplearn.body import robot_body
        >>> robot = robot_body()
        >>> robot.rest.shape, robot.rest[3:7].tolist()
        ((45,), [1.0, 0.0, 0.0, 0.0])
    """

    name: str
    xml: str
    joint_names: tuple[str, ...]
    joint_limits: FloatArray
    height_m: float
    tree: KinematicTree
    held: tuple[str, ...] = ()

    def model(self) -> mujoco.MjModel:
        """Compile the MJCF text."""
        import mujoco

        return mujoco.MjModel.from_xml_string(self.xml)

    @property
    def nq(self) -> int:
        """Length of a posture."""
        return 7 + len(self.joint_names)

    @cached_property
    def driven(self) -> IntArray:
        """Indices into `joint_names` of the hinges that are not held."""
        driven = [i for i, name in enumerate(self.joint_names) if name not in self.held]
        return read_only(np.array(driven, dtype=np.int64))

    @cached_property
    def driven_names(self) -> tuple[str, ...]:
        """Names of the hinges that are not held, in order."""
        return tuple(self.joint_names[i] for i in self.driven)

    @property
    def rest(self) -> FloatArray:
        """The upright posture, shape (7 + n,): all angles zero, soles on z = 0."""
        q = np.zeros(self.nq)
        q[:3] = self.tree.offset[0]
        q[3] = 1.0
        return q


def load_body(name: str, held: tuple[str, ...] = ()) -> Body:
    """Load a body from the package's models."""
    return body_from_xml(
        name, (files(__package__) / f"{name}.xml").read_text(encoding="utf-8"), held
    )


def body_from_xml(name: str, xml: str, held: tuple[str, ...] = ()) -> Body:
    """Return the body that an MJCF text describes.

    Raises:
        BodyError: The model is no tree of hinges on a free base, or lacks the sites ``head_top``
            and ``sole_*`` that give its stature.
    """
    import mujoco

    try:
        model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise BodyError(f"the MJCF of body {name!r} does not compile: {error}") from error
    tree = KinematicTree.from_model(model)
    unknown = sorted(set(held) - set(tree.joint_names))
    if unknown:
        raise BodyError(f"body {name!r} has no joints {unknown} to hold")
    rest = np.concatenate((tree.offset[0], (1.0, 0.0, 0.0, 0.0), np.zeros(len(tree.joint_names))))
    sites = tree.site_positions(rest)
    soles = [i for i, site in enumerate(tree.site_names) if site.startswith("sole_")]
    if "head_top" not in tree.site_names or not soles:
        raise BodyError(
            f"body {name!r} needs the sites 'head_top' and 'sole_*'; it has {tree.site_names}"
        )
    top, floor = sites[tree.site_names.index("head_top"), 2], sites[soles, 2].min()
    if abs(floor) > 1e-3:
        raise BodyError(f"body {name!r} stands {floor:.4f} m above the floor at rest; 0 is needed")
    return Body(
        name=name,
        xml=xml,
        joint_names=tree.joint_names,
        joint_limits=tree.limits,
        height_m=float(top - floor),
        tree=tree,
        held=held,
    )

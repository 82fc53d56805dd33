"""What the controllers and environments need to know of a robot, whichever it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mplearn.errors import RobotError
from mplearn.recording import FloatArray, IntArray

if TYPE_CHECKING:
    import mujoco

BASE_CHANNELS = ("base_height", "base_roll", "base_pitch")
#: Segments that a robot may have, as the library's bodies name them; a standing robot needs legs.
TRUNK_ROLES = ("pelvis", "chest", "head")
LIMB_ROLES = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
ROLES = (*TRUNK_ROLES, *(f"{role}_{side}" for side in "lr" for role in LIMB_ROLES))
NEEDED_ROLES = ("pelvis", *(f"{role}_{side}" for side in "lr" for role in LIMB_ROLES[3:]))


@dataclass(frozen=True)
class JointGroup:
    """Joints that are driven alike.

    Attributes:
        names: The joints' names.
        stiffness: Gain of the position servo, ``kp`` [N m/rad].
        damping: Its velocity gain, ``kv`` [N m s/rad].
        torque: Torque limit [N m].
        velocity: Velocity limit [rad/s].
    """

    names: tuple[str, ...]
    stiffness: float
    damping: float
    torque: float
    velocity: float


@dataclass(frozen=True)
class Robot:
    """A standing robot: its simulation model and the roles of its joints.

    The model has one free base and hinges; every hinge has one position servo of the same name.
    With all hinges at zero the robot stands upright, legs straight, arms hanging. The hinges of
    ``legs`` balance, all others track.

    Attributes:
        name: Name of the body whose features the robot can perform.
        xml: The whole simulation model (floor, servos, camera) as MJCF text.
        groups: All joints with their gains and limits.
        legs: Joints of the left and of the right leg, from hip to foot.
        knees: The left and the right knee; they count positive when flexed.
        thighs: Bodies whose origin is the hip joint, left and right.
        feet: Bodies of the feet, whose origin is the ankle; the sole is geom ``sole_l``,
            ``sole_r``.
        stance_knee_rad: Knee flexion when standing [rad].
        guard_knee_rad: The knees are never made straighter than about this [rad].
        base_velocity: Velocity limits of base height [m/s], roll and pitch [rad/s].
        segments: Pairs of a role (see `ROLES`) and the body that has it, through which motions of
            other bodies are retargeted.
    """

    name: str
    xml: str
    groups: tuple[JointGroup, ...]
    legs: tuple[tuple[str, ...], tuple[str, ...]]
    knees: tuple[str, str]
    thighs: tuple[str, str]
    feet: tuple[str, str]
    stance_knee_rad: float
    guard_knee_rad: float
    base_velocity: tuple[float, float, float]
    segments: tuple[tuple[str, str], ...]

    @classmethod
    def from_mjcf(
        cls,
        source: str | Path,
        name: str,
        segments: Mapping[str, str],
        *,
        attention: Mapping[str, float] | None = None,
    ) -> Robot:
        """Describe any humanoid of which there is an MJCF model.

        The model gets this package's floor, one servo a hinge and one box a sole; only soles
        collide. Its zero is moved to the upright posture.

        Args:
            source: A file, or the MJCF text itself.
            name: What the robot shall be called.
            segments: The body of each role; those in `NEEDED_ROLES` must be there.
            attention: Angles of the hinges, in the model's own zero, with which the robot stands
                upright, legs straight, soles flat, arms hanging, palms inwards [rad]; 0 where not
                given.

        Raises:
            RobotError: The model does not compile or is no humanoid on two feet, with the reason.
        """
        from .mjcf import robot_from_mjcf

        return robot_from_mjcf(source, name, segments, attention or {})

    def __post_init__(self) -> None:
        model = self.model()
        hinges = tuple(model.joint(i).name for i in range(1, model.njnt))
        servos = tuple(model.actuator(i).name for i in range(model.nu))
        listed = [name for group in self.groups for name in group.names]
        if sorted(listed) != sorted(hinges) or servos != hinges:
            raise RobotError(
                f"robot {self.name!r} needs one servo and one group for each hinge, in the hinges' "
                f"order; hinges {hinges}, servos {servos}, grouped {tuple(listed)}"
            )
        missing = {n for leg in self.legs for n in leg} | set(self.knees)
        missing -= set(hinges)
        bodies = {model.body(i).name for i in range(model.nbody)}
        missing |= {*self.thighs, *self.feet, *(body for _, body in self.segments)} - bodies
        missing |= {"sole_l", "sole_r"} - {model.geom(i).name for i in range(model.ngeom)}
        if missing:
            raise RobotError(f"robot {self.name!r} has no joint, body or sole {sorted(missing)}")

    def model(self) -> mujoco.MjModel:
        """Compile the simulation model."""
        return _compile(self.xml)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the n driven hinges, in the order of qpos and of the servos."""
        model = self.model()
        return tuple(model.joint(i).name for i in range(1, model.njnt))

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Names of the features that the robot can perform, length 3 + n."""
        return BASE_CHANNELS + self.joint_names

    @cached_property
    def leg_joints(self) -> IntArray:
        """Indices of the legs' hinges, left leg first, shape (n_legs,)."""
        return np.array([self.joint_names.index(n) for leg in self.legs for n in leg])

    @cached_property
    def upper_joints(self) -> IntArray:
        """Indices of all other hinges, shape (n - n_legs,)."""
        return np.setdiff1d(np.arange(len(self.joint_names)), self.leg_joints)

    @cached_property
    def position_limits(self) -> FloatArray:
        """Lower and upper limit of each hinge, shape (n, 2) [rad]."""
        return np.array(self.model().jnt_range[1:])

    def per_joint(self, quantity: str) -> FloatArray:
        """Return one of the groups' quantities for every hinge, shape (n,).

        Args:
            quantity: "stiffness", "damping", "torque" or "velocity".
        """
        values = {n: getattr(group, quantity) for group in self.groups for n in group.names}
        return np.array([values[n] for n in self.joint_names], dtype=np.float64)


@cache
def _compile(xml: str) -> mujoco.MjModel:
    """Compile once; nobody changes a robot's model (an environment copies it)."""
    import mujoco

    try:
        return mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise RobotError(f"the robot's MJCF does not compile: {error}") from error


def read_model(name: str) -> str:
    """Return the text of one of the package's models."""
    return (files(__package__) / "models" / f"{name}.xml").read_text(encoding="utf-8")

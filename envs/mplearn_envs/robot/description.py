"""What the controllers and environments need to know of a robot, whichever it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mplearn.errors import RobotError
from mplearn.maths.read_only import read_only
from mplearn.recording import FloatArray, IntArray

from .compiling import compile_once
from .drives import JointGroup
from .feet import SOLES, foot_hinges, require_soles
from .roles import BASE_CHANNELS

if TYPE_CHECKING:
    import mujoco

    from .reroot import Origin


@dataclass(frozen=True)
class Robot:
    """A standing robot: its simulation model and the roles of its joints.

    The model has one free base and hinges; every hinge has one position servo of the same name.
    With all hinges at zero the robot stands upright, legs straight, arms hanging. The hinges of
    ``legs`` balance, those of ``toes`` are held at zero, all others track.

    Attributes:
        name: Name of the body whose features the robot can perform.
        xml: The whole simulation model (floor, servos, camera) as MJCF text.
        groups: All joints with their gains and limits.
        legs: Joints of the left and of the right leg, from hip to foot.
        knees: The left and the right knee; they count positive when flexed.
        thighs: Bodies whose origin is the hip joint, left and right.
        feet: Bodies of the feet, whose origin is the ankle; the sole is geom ``sole_l``,
            ``sole_r``, a box along the foot's axes.
        stance_knee_rad: Knee flexion when standing [rad].
        guard_knee_rad: The knees are never made straighter than about this [rad].
        base_velocity: Velocity limits of base height [m/s], roll and pitch [rad/s].
        segments: Pairs of a role (see `ROLES`) and the body that has it, through which motions of
            other bodies are retargeted.
        toes: Hinges within the feet: toes, or heels. They are held at zero, for a foot stands on
            one flat sole; motions that bend them are refused.
        attention: Hinges that stand upright at another angle than 0 in the zero of the MJCF that
            the robot came from, and that angle [rad]: there they are at ours plus this.
        flipped: Hinges that count the other way in that MJCF: there they are at minus ours, plus
            their angle at attention.
        origin: That MJCF and how it floats, where more than zeros and signs differ; else None.

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> robot = humanoid()
        >>> robot.name, robot.knees
        ('robot', ('knee_l', 'knee_r'))
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
    toes: tuple[str, ...] = ()
    attention: tuple[tuple[str, float], ...] = ()
    flipped: tuple[str, ...] = ()
    origin: Origin | None = None

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

        The model is re-rooted at its pelvis, x ahead and z up, and zero where it stands upright. It
        gets this package's floor, one servo a hinge and one box a sole; only soles collide.

        Args:
            source: A file, or the MJCF text itself.
            name: What the robot shall be called.
            segments: The body of each role; those in `NEEDED_ROLES` must be there.
            attention: Angles of the hinges, in the model's own zero, with which the robot stands
                upright, legs straight, soles flat, arms hanging, palms inwards [rad]; 0 where not
                given.

        Raises:
            RobotError: The model does not compile or is no humanoid on two feet, with the reason.

        Example:
            >>> from pathlib import Path
            >>> import dm_control
            >>> sides = {"l": "left", "r": "right"}
            >>> links = {"thigh": "thigh", "shank": "shin", "foot": "foot"}
            >>> segments = {"pelvis": "pelvis"} | {
            ...     f"{role}_{s}": f"{side}_{link}"
            ...     for s, side in sides.items()
            ...     for role, link in links.items()
            ... }
            >>> file = Path(dm_control.__file__).parent / "suite/humanoid.xml"
            >>> robot = Robot.from_mjcf(file, "theirs", segments)
            >>> robot.origin.base, robot.flipped
            ('torso', ('right_knee', 'left_knee'))
        """
        from .from_mjcf import described

        return cls(**described(source, name, segments, attention or {}))

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
        missing |= set(SOLES) - {model.geom(i).name for i in range(model.ngeom)}
        if missing:
            raise RobotError(f"robot {self.name!r} has no joint, body or sole {sorted(missing)}")
        require_soles(model, self.feet, self.name)
        toes = foot_hinges(model, self.feet)
        if set(toes) != set(self.toes):
            raise RobotError(
                f"robot {self.name!r}: the hinges within its feet are {toes}, and its toes are "
                f"said to be {self.toes}"
            )
        if unknown := ({hinge for hinge, _ in self.attention} | set(self.flipped)) - set(hinges):
            raise RobotError(
                f"robot {self.name!r} has no hinge {sorted(unknown)} at attention, or to be flipped"
            )

    def model(self) -> mujoco.MjModel:
        """Return the simulation model; all who ask share it, so copy it before you change it."""
        return compile_once(self.xml)

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
    def attention_angles(self) -> FloatArray:
        """Where each hinge is upright in the zero of the robot's MJCF, shape (n,) [rad]."""
        angles = dict(self.attention)
        return read_only(np.array([angles.get(name, 0.0) for name in self.joint_names]))

    @cached_property
    def signs(self) -> FloatArray:
        """-1 for each hinge that counts the other way in the robot's MJCF, else 1, shape (n,)."""
        return read_only(np.where(np.isin(self.joint_names, self.flipped), -1.0, 1.0))

    @cached_property
    def leg_joints(self) -> IntArray:
        """Indices of the legs' hinges, left leg first, shape (n_legs,)."""
        return read_only(np.array([self.joint_names.index(n) for leg in self.legs for n in leg]))

    @cached_property
    def upper_joints(self) -> IntArray:
        """Indices of all other hinges, shape (n - n_legs,)."""
        return read_only(np.setdiff1d(np.arange(len(self.joint_names)), self.leg_joints))

    @cached_property
    def position_limits(self) -> FloatArray:
        """Lower and upper limit of each hinge, shape (n, 2) [rad]."""
        return read_only(np.array(self.model().jnt_range[1:]))

    def per_joint(self, quantity: str) -> FloatArray:
        """Return one of the groups' quantities for every hinge, shape (n,).

        Args:
            quantity: "stiffness", "damping", "torque" or "velocity".
        """
        values = {n: getattr(group, quantity) for group in self.groups for n in group.names}
        return np.array([values[n] for n in self.joint_names], dtype=np.float64)

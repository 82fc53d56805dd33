"""A robot as those who read the files know it: its own MJCF, with its own zero."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mplearn.errors import RobotError
from mplearn.maths.rotations import quaternion_to_matrix
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.robot import Robot, make_robot
from mplearn_envs.robot.compiling import compile_once

if TYPE_CHECKING:
    import mujoco
    from scipy.spatial.transform import Rotation

_SQUARE = 1e-6  # cosine between hinges' axes
_NEAR_FLOOR_M = 0.02


class Bodies(NamedTuple):
    """Where the bodies of a robot are along a motion: link frames, in the world's.

    Attributes:
        pos: Their origins, shape (T, B, 3) [m].
        quat: How they are turned, unit quaternions (w, x, y, z), shape (T, B, 4).
    """

    pos: FloatArray
    quat: FloatArray


class Velocities(NamedTuple):
    """How fast all of a robot moves along a motion.

    Attributes:
        joint: Of the hinges, shape (T, n) [rad/s].
        linear: Of the bodies' origins, in the world's frame, shape (T, B, 3) [m/s].
        angular: Of the bodies, in the world's frame, shape (T, B, 3) [rad/s].
    """

    joint: FloatArray
    linear: FloatArray
    angular: FloatArray


@dataclass(frozen=True, eq=False)
class RobotModel:
    """The floating tree of hinges that a robot is.

    Attributes:
        name: What the robot is called.
        model: The compiled MJCF; it is not changed.
        shift: What is added to the model's angles, times their `signs`, to get those in the zero of
            the robot's own MJCF, shape (n,) [rad].
        robot: The description that it comes from; None where only an MJCF is known.

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> model = RobotModel.of(humanoid())
        >>> model.name, len(model.joint_names)
        ('robot', 30)
    """

    name: str
    model: mujoco.MjModel
    shift: FloatArray
    robot: Robot | None = None

    @classmethod
    def of(cls, robot: Robot) -> RobotModel:
        """Return the model of a described robot, as it was before it was re-rooted."""
        if robot.origin is not None:
            model = compile_once(robot.origin.xml)
            return cls(robot.name, model, np.zeros(len(robot.joint_names)), robot)
        return cls(robot.name, robot.model(), robot.attention_angles, robot)

    @classmethod
    def from_mjcf(cls, path: Path | str) -> RobotModel:
        """Read a model that need not be a humanoid.

        Raises:
            RobotError: There is no such file, it does not compile, or it is no tree of hinges on
                one floating base.
        """
        import mujoco

        path = Path(path)
        if not path.is_file():
            raise RobotError(f"there is no file {str(path)!r}")
        try:
            model = mujoco.MjModel.from_xml_path(str(path))
        except ValueError as error:
            raise RobotError(f"{path} does not compile: {error}") from error
        found = cls(path.stem, model, np.zeros(0))
        return cls(path.stem, model, np.zeros(len(found.joint_names)))

    @cached_property
    def bodies(self) -> IntArray:
        """Ids of the robot's bodies, parents first, shape (B,)."""
        below = np.zeros(self.model.nbody, dtype=np.bool_)
        below[self.model.jnt_bodyid[self._free]] = True
        for body in range(1, self.model.nbody):
            below[body] |= below[self.model.body_parentid[body]]
        return np.flatnonzero(below)

    @cached_property
    def joints(self) -> IntArray:
        """Ids of the robot's hinges, in the model's order, shape (n,)."""
        import mujoco

        own = np.flatnonzero(np.isin(self.model.jnt_bodyid, self.bodies))
        own = own[own != self._free]
        for joint in own:
            if self.model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
                raise RobotError(
                    f"robot {self.name!r}: joint {self.model.joint(joint).name!r} is no hinge"
                )
        return np.asarray(own, dtype=np.int64)

    @cached_property
    def _free(self) -> int:
        import mujoco

        free = np.flatnonzero(self.model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
        if len(free) != 1:
            raise RobotError(
                f"robot {self.name!r} must float by one free joint, not by {len(free)}"
            )
        return int(free[0])

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the n hinges, in the model's order."""
        return tuple(self.model.joint(int(joint)).name for joint in self.joints)

    @cached_property
    def body_names(self) -> tuple[str, ...]:
        """Names of the B bodies without the world, in the model's order."""
        return tuple(self.model.body(int(body)).name for body in self.bodies)

    @cached_property
    def parents(self) -> IntArray:
        """What each body hangs on, as a place among the bodies; -1 for the base, shape (B,)."""
        place = {int(body): k for k, body in enumerate(self.bodies)}
        return np.array([place.get(int(self.model.body_parentid[b]), -1) for b in self.bodies])

    @cached_property
    def joint_bodies(self) -> IntArray:
        """Which of the bodies each hinge turns, shape (n,)."""
        place = {int(body): k for k, body in enumerate(self.bodies)}
        return np.array([place[int(self.model.jnt_bodyid[j])] for j in self.joints], dtype=np.int64)

    @cached_property
    def axes(self) -> FloatArray:
        """The hinges' axes, each in the frame of the body that it turns, shape (n, 3)."""
        return np.asarray(self.signs[:, None] * self.model.jnt_axis[self.joints])

    @cached_property
    def signs(self) -> FloatArray:
        """-1 for a hinge that counts the other way in the robot's own MJCF, else 1, shape (n,)."""
        if self.robot is None or self.robot.origin is not None:
            return np.ones(len(self.joint_names))
        return self.robot.signs

    @cached_property
    def limits(self) -> FloatArray:
        """Smallest and largest angle of each hinge, infinite where not limited, (n, 2) [rad]."""
        limits = self.signs[:, None] * self.model.jnt_range[self.joints]
        limits = np.sort(limits, axis=1) + self.shift[:, None]
        limits[self.model.jnt_limited[self.joints] == 0] = (-np.inf, np.inf)
        return np.asarray(limits)

    @cached_property
    def velocity_limits(self) -> FloatArray | None:
        """Largest velocity of each hinge, shape (n,) [rad/s]; None where it is not known."""
        if self.robot is None:
            return None
        limits = dict(zip(self.robot.joint_names, self.robot.per_joint("velocity"), strict=True))
        return np.array([limits[name] for name in self.joint_names])

    @cached_property
    def at_zero(self) -> Bodies:
        """The bodies with all angles zero, the base at the origin: one frame."""
        root = np.array([[1.0, 0.0, 0.0, 0.0]])
        return self.forward(np.zeros((1, 3)), root, np.zeros((1, len(self.joint_names))))

    def forward(self, root_pos: FloatArray, root_quat: FloatArray, joint_pos: FloatArray) -> Bodies:
        """Return where all bodies are, by forward kinematics.

        Args:
            root_pos: Place of the base, shape (T, 3) [m].
            root_quat: Its quaternions (w, x, y, z), of any length but zero, shape (T, 4).
            joint_pos: Angles in the zero of the robot's own MJCF, shape (T, n) [rad].
        """
        import mujoco

        model, data = self.model, mujoco.MjData(self.model)
        pos = np.empty((len(root_pos), len(self.bodies), 3))
        quat = np.empty((len(root_pos), len(self.bodies), 4))
        qpos = self._qpos(root_pos, root_quat, joint_pos)
        for t in range(len(qpos)):
            data.qpos[:] = qpos[t]
            mujoco.mj_kinematics(model, data)
            pos[t], quat[t] = data.xpos[self.bodies], data.xquat[self.bodies]
        return Bodies(pos, quat)

    def velocities(
        self, root_pos: FloatArray, root_quat: FloatArray, joint_pos: FloatArray, rate_hz: float
    ) -> Velocities:
        """Return how fast all moves: central differences of base and hinges, the rest follows.

        The first and the last frame have the differences to their neighbours.
        """
        import mujoco

        model, data = self.model, mujoco.MjData(self.model)
        joint = np.gradient(joint_pos, 1.0 / rate_hz, axis=0)
        base = np.gradient(root_pos, 1.0 / rate_hz, axis=0)
        turning = angular_velocities(root_quat, rate_hz)
        qpos = self._qpos(root_pos, root_quat, joint_pos)
        address = int(model.jnt_dofadr[self._free])
        hinges = model.jnt_dofadr[self.joints]
        n_bodies = len(self.bodies)
        linear, angular = (np.empty((len(qpos), n_bodies, 3)) for _ in range(2))
        own = np.einsum("tji,tj->ti", quaternion_to_matrix(root_quat), turning)
        root = model.body_rootid[self.bodies]
        for t in range(len(qpos)):
            data.qpos[:] = qpos[t]
            data.qvel[address : address + 3], data.qvel[address + 3 : address + 6] = base[t], own[t]
            data.qvel[hinges] = self.signs * joint[t]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_comVel(model, data)
            velocity = data.cvel[self.bodies]  # at the COG of the whole, turned as the world
            arm = data.xpos[self.bodies] - data.subtree_com[root]
            angular[t] = velocity[:, :3]
            linear[t] = velocity[:, 3:] + np.cross(velocity[:, :3], arm)
        return Velocities(joint, linear, angular)

    def angles_of(self, quat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the angles of the hinges that turn bodies as they are, as well as hinges can.

        Args:
            quat: Quaternions of the bodies (w, x, y, z), shape (T, B, 4).

        Returns:
            The angles, shape (T, n) [rad]; and how far each body is turned otherwise than its
            hinges can turn it, shape (T, B) [rad].
        """
        turn = quaternion_to_matrix(quat)
        rest = quaternion_to_matrix(self.at_zero.quat[0])
        limits = self.limits
        limited = np.isfinite(limits).all(axis=1, keepdims=True)
        middle = np.where(limited, limits, 0.0).mean(axis=1)
        out = np.zeros((len(quat), len(self.joint_names)))
        off = np.zeros(quat.shape[:2])
        for b in range(1, len(self.bodies)):
            own = np.flatnonzero(self.joint_bodies == b)
            p = self.parents[b]
            fixed = rest[p].T @ rest[b]
            relative = np.einsum("ji,tkj,tkl->til", fixed, turn[:, p], turn[:, b])
            out[:, own], off[:, b] = _about(relative, self.axes[own], middle[own])
        return out + 2 * np.pi * np.round((middle - out) / (2 * np.pi)), off

    @cached_property
    def ground_points(self) -> tuple[IntArray, FloatArray]:
        """Corners that are near the floor when it stands: their bodies (P,), places (P, 3) [m]."""
        model, signs = self.model, np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
        place = {int(body): k for k, body in enumerate(self.bodies)}
        turn = quaternion_to_matrix(self.at_zero.quat[0])
        own = np.flatnonzero(np.isin(model.geom_bodyid, self.bodies))
        touch = own[(model.geom_contype[own] != 0) | (model.geom_conaffinity[own] != 0)]
        whose, corners, heights = [], [], []
        for geom in touch if len(touch) else own:
            body = place[int(model.geom_bodyid[geom])]
            box = model.geom_aabb[geom]
            local = box[:3] + signs * box[3:]
            local = local @ quaternion_to_matrix(model.geom_quat[geom]).T + model.geom_pos[geom]
            whose += [body] * len(local)
            corners.append(local)
            heights.append((local @ turn[body].T + self.at_zero.pos[0, body])[:, 2])
        if not corners:
            return np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        height = np.concatenate(heights)
        low = height < height.min() + _NEAR_FLOOR_M
        return np.array(whose)[low], np.concatenate(corners)[low]

    def lowest(self, bodies: Bodies) -> FloatArray:
        """Return the height of the lowest point of the feet, shape (T,) [m]."""
        whose, corners = self.ground_points
        turn = quaternion_to_matrix(bodies.quat[:, whose])
        points = np.einsum("tpij,pj->tpi", turn, corners) + bodies.pos[:, whose]
        return np.asarray(points[..., 2].min(axis=1))

    def _qpos(
        self, root_pos: FloatArray, root_quat: FloatArray, joint_pos: FloatArray
    ) -> FloatArray:
        qpos = np.tile(self.model.qpos0, (len(root_pos), 1))
        address = int(self.model.jnt_qposadr[self._free])
        qpos[:, address : address + 3] = root_pos
        qpos[:, address + 3 : address + 7] = root_quat
        qpos[:, self.model.jnt_qposadr[self.joints]] = self.signs * (joint_pos - self.shift)
        return qpos


def robot_model(robot: str | Path | Robot) -> RobotModel:
    """Return the model of a robot: one of `make_robot`, or an MJCF file.

    Raises:
        InvalidValueError: There is none of that name.
        MissingDependencyError: Its model is not installed.
        RobotError: The file is missing, or is no tree of hinges on one floating base.

    Example:
        >>> robot_model("humanoid").body_names[:3]
        ('pelvis', 'chest', 'head')
    """
    if isinstance(robot, Robot):
        return RobotModel.of(robot)
    if str(robot).lower().endswith(".xml"):
        return RobotModel.from_mjcf(robot)
    return RobotModel.of(make_robot(robot))


def angular_velocities(quaternions: FloatArray, rate_hz: float) -> FloatArray:
    """Return angular velocities in the world's frame, for (T, ..., 4), shape (T, ..., 3) [rad/s].

    They are central differences; the first and the last frame repeat their neighbours', as the
    scripts do that make mjlab's files.
    """
    from scipy.spatial.transform import Rotation

    n_frames, rest = len(quaternions), quaternions.shape[1:-1]
    flat = quaternions.reshape(n_frames, -1, 4)
    first, last = flat[:-2], flat[2:]
    step = 2.0
    if n_frames == 2:
        first, last, step = flat[:1], flat[1:], 1.0
    turn = (
        Rotation.from_quat(last.reshape(-1, 4), scalar_first=True)
        * Rotation.from_quat(first.reshape(-1, 4), scalar_first=True).inv()
    )
    middle = turn.as_rotvec().reshape(len(first), -1, 3) * rate_hz / step
    return np.concatenate((middle[:1], middle, middle[-1:]))[:n_frames].reshape(n_frames, *rest, 3)


def _about(
    relative: FloatArray, axes: FloatArray, middle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return angles about a body's hinges, shape (T, k), and what of its turn they leave (T,).

    Of the two ways in which three hinges turn a body alike, the one nearer to the middle of their
    limits is taken.
    """
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_matrix(relative)
    if len(axes) == 0:
        return np.zeros((len(relative), 0)), np.asarray(turn.magnitude())
    if len(axes) == 1:
        quat = turn.as_quat(scalar_first=True)
        angles = 2 * np.arctan2(quat[:, 1:] @ axes[0], quat[:, 0])[:, None]
    else:
        angles = _davenport(turn, axes, middle)
    done = Rotation.identity()
    for k, axis in enumerate(axes):
        done = done * Rotation.from_rotvec(angles[:, k, None] * axis)
    return angles, np.asarray((done.inv() * turn).magnitude())


def _davenport(turn: Rotation, axes: FloatArray, middle: FloatArray) -> FloatArray:
    """Return angles about two or three hinges of one body, each square to the one before."""
    import warnings

    three = axes if len(axes) == 3 else np.vstack((axes, np.cross(axes[0], axes[1])))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # gimbal lock: any of the choices does
        try:
            angles = np.asarray(turn.as_davenport(three, "intrinsic"))
        except ValueError as error:
            raise RobotError(
                f"hinges of one body that are not square to each other cannot be read: {error}"
            ) from error
    if abs(three[0] @ three[2]) < _SQUARE:
        other = np.column_stack((angles[:, 0] + np.pi, np.pi - angles[:, 1], angles[:, 2] + np.pi))
        aim = np.append(middle, np.zeros(3 - len(middle)))
        far = [np.abs(np.angle(np.exp(1j * (way - aim)))).max(axis=1) for way in (angles, other)]
        if len(axes) == 2:  # there is no third hinge
            far = [np.abs(np.angle(np.exp(1j * way[:, 2]))) for way in (angles, other)]
        angles = np.where((far[1] < far[0])[:, None], other, angles)
    return np.asarray(angles[:, : len(axes)])

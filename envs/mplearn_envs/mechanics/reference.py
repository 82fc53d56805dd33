"""The kinematic reference robot: a robot's arrays, its stance, and where it is in its motion."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from mplearn.errors import RobotError
from mplearn.maths.plane import turn_in_plane
from mplearn.maths.rotations import quaternion_to_matrix
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.robot import Robot
from mplearn_envs.robot.feet import sole_corners

from .heels import bearing_corners
from .kinematics import MassTree, forward, mass_tree
from .velocity_ik import Stance, settle

N_BASE = 3  # base height, roll, pitch


class ReferenceRobot(NamedTuple):
    """A robot as the kernels need it.

    Its U tracked coordinates are base height, roll and pitch, then all joints but the legs'.

    Attributes:
        tree: Kinematics and masses.
        inertia: Rotational inertia of each body about its centre of mass, in its own frame, shape
            (B, 3, 3) [kg m^2].
        stance: Both feet on the floor, symmetric about the origin.
        corners: Lower corners of the soles in their feet's frames, shape (2, 4, 3) [m].
        ground: Where the feet stand: x, y [m] and yaw [rad], shape (2, 3).
        upper: Hinges that are tracked, shape (U - 3,).
        limits: Smallest and largest value of the tracked coordinates, shape (U, 2) [m, rad].
        velocity: Their velocity limits, shape (U,) [m/s, rad/s].
        standing_height: Base height with straight legs, to which features refer [m].
        stance_height: Base height in the standing posture (knees a little bent) [m].
        rest: Standing posture, arms hanging, shape (7 + n,).

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> ref = reference_robot(humanoid())
        >>> ref.limits.shape == (len(ref.velocity), 2), ref.stance_height < ref.standing_height
        (True, True)
    """

    tree: MassTree
    inertia: FloatArray
    stance: Stance
    corners: FloatArray
    ground: FloatArray
    upper: IntArray
    limits: FloatArray
    velocity: FloatArray
    standing_height: float
    stance_height: float
    rest: FloatArray


class Reference(NamedTuple):
    """Where the reference robot is, from which the next motion starts.

    Attributes:
        target: Tracked coordinates, shape (U,) [m, rad]; the height as the features have it.
        velocity: Their velocities, shape (U,) [m/s, rad/s].
        q: The whole posture, shape (7 + n,); its origin is on the floor between the feet, x ahead.
        swing: The legs as the motion has them, which a foot in the air follows: angles of the legs'
            hinges [rad], then the heights of the left and the right sole [m], shape (n_legs + 2,).
        swing_velocity: Their velocities, shape (n_legs + 2,) [rad/s, m/s].
        up: 1 for the foot that is in the air, shape (2,).
        ground: Where each foot stands or left the ground: x, y [m] and yaw [rad], shape (2, 3).
        heel: By how much each heel is raised, the front edge of the sole staying, shape (2,) [rad].

    Example:
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.robot import humanoid
        >>> reference = rest_reference(humanoid())
        >>> reference.lifted, reference.q.shape, reference.up.tolist()
        (-1, (37,), [0.0, 0.0])
    """

    target: FloatArray
    velocity: FloatArray
    q: FloatArray
    swing: FloatArray
    swing_velocity: FloatArray
    up: FloatArray
    ground: FloatArray
    heel: FloatArray

    @property
    def lifted(self) -> int:
        """Side of the foot that is in the air, 0 left, 1 right; -1 for none."""
        return int(np.argmax(self.up)) if self.up.any() else -1


@lru_cache(maxsize=8)
def reference_robot(robot: Robot) -> ReferenceRobot:
    """Return the arrays of a robot, standing with its knees bent by ``stance_knee_rad``.

    Raises:
        RobotError: The robot cannot stand so that its COG is over its feet.

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> ref = reference_robot(humanoid())
        >>> round(ref.standing_height, 2), ref.corners.shape
        (0.89, (2, 4, 3))
    """
    model = robot.model()
    tree = mass_tree(model)
    names = robot.joint_names
    body = {model.body(i).name: i - 1 for i in range(1, model.nbody)}
    feet = np.array([body[n] for n in robot.feet])
    thighs = np.array([body[n] for n in robot.thighs])
    knees = [names.index(n) for n in robot.knees]

    straight = np.zeros(7 + len(names))
    straight[3] = 1.0
    straight[2] = -soles(robot, straight)[..., 2].min()
    pose = forward(tree, straight)
    centre = 0.5 * (pose.position[feet[0]] + pose.position[feet[1]])
    straight[:2] -= centre[:2]
    pose = forward(tree, straight)

    reach, crouch = np.empty(2), np.empty(2)
    for angle, out in ((robot.guard_knee_rad, reach), (robot.stance_knee_rad, crouch)):
        bent = straight.copy()
        bent[[7 + k for k in knees]] = angle
        moved = forward(tree, bent).position
        out[:] = np.linalg.norm(moved[thighs] - moved[feet], axis=1)
    limits = robot.position_limits.copy()
    stance = Stance(
        robot.leg_joints.copy(),
        np.repeat(np.arange(2), [len(leg) for leg in robot.legs]),
        limits[robot.leg_joints].copy(),
        feet,
        thighs,
        pose.position[feet],
        pose.rotation[feet],
        reach,
        soles(robot, straight)[..., :2].mean(axis=(0, 1)),
        np.zeros(2),
    )
    length = np.linalg.norm(pose.position[thighs] - pose.position[feet], axis=1)
    stance_height = float(straight[2] - np.max(length - crouch))
    guess = straight.copy()
    guess[2] = stance_height
    guess[[7 + k for k in knees]] = robot.stance_knee_rad
    rest, worst = settle(tree, stance, guess, stance_height, np.eye(3), 1e-10, 50)
    if worst > 1e-6:
        few = min(len(leg) for leg in robot.legs)
        raise RobotError(
            f"robot {robot.name!r} cannot stand: its feet or COG miss by {worst:.3g} m"
            + (f"; it takes 6 hinges to place a foot, its legs have {few}" if few < 6 else "")
        )
    limits[[names.index(name) for name in robot.toes]] = 0.0  # one flat sole a foot
    upper = robot.upper_joints.copy()
    lowest = 0.45 * straight[2]
    base_limits = np.array([[lowest, straight[2]], [-0.6, 0.6], [-0.6, 1.6]])
    turn = quaternion_to_matrix(model.body_iquat[1:])
    return ReferenceRobot(
        tree,
        np.einsum("bij,bj,bkj->bik", turn, model.body_inertia[1:], turn),
        stance,
        sole_corners(model),
        np.column_stack((stance.foot_position[:, :2], np.zeros(2))),
        upper,
        np.vstack((base_limits, limits[upper])),
        np.concatenate((robot.base_velocity, robot.per_joint("velocity")[upper])),
        float(straight[2]),
        stance_height,
        rest,
    )


def rest_reference(robot: Robot) -> Reference:
    """Return the reference of a robot that stands still, arms hanging.

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> rest = rest_reference(humanoid())
        >>> rest.ground.round(2).tolist()  # where its feet stand: x, y, yaw
        [[0.0, 0.09, 0.0], [0.0, -0.09, 0.0]]
    """
    ref = reference_robot(robot)
    target = np.zeros(len(ref.limits))
    target[0] = ref.standing_height
    swing = np.append(ref.rest[7 + robot.leg_joints], np.zeros(2))
    still, flat = np.zeros_like(target), np.zeros(2)
    posture, ground = ref.rest.copy(), ref.ground.copy()
    return Reference(target, still, posture, swing, 0.0 * swing, np.zeros(2), ground, flat)


def tracked_columns(robot: Robot) -> IntArray:
    """Return which of the robot's channels are tracked, not left to balance: shape (U,)."""
    return np.concatenate((np.arange(N_BASE), N_BASE + robot.upper_joints))


def soles(robot: Robot, q: FloatArray) -> FloatArray:
    """Return the lower corners of both soles in posture ``q``, world frame, shape (2, 4, 3) [m]."""
    model = robot.model()
    pose = forward(mass_tree(model), q)
    feet = [model.body(n).id - 1 for n in robot.feet]
    local = sole_corners(model)
    return np.stack([local[s] @ pose.rotation[f].T + pose.position[f] for s, f in enumerate(feet)])


def sole_middles(
    robot: ReferenceRobot, ground: FloatArray, heel: FloatArray | None = None
) -> FloatArray:
    """Return the middles of what both soles stand on, shape (..., 2, 2) [m].

    Args:
        robot: The reference robot.
        ground: Where the feet stand: x, y [m] and yaw [rad], shape (..., 2, 3).
        heel: By how much their heels are raised, shape (..., 2) [rad]; None is not at all.
    """
    middle = _bearing(robot, heel).mean(axis=-2)
    turned = turn_in_plane(middle[..., 0], middle[..., 1], ground[..., 2])
    return np.asarray(ground[..., :2] + np.stack(turned, axis=-1))


def sole_outlines(
    robot: ReferenceRobot, ground: FloatArray, heel: FloatArray | None = None
) -> FloatArray:
    """Return the corners of what both soles stand on, shape (..., 2, 4, 2) [m].

    Args:
        robot: The reference robot.
        ground: Where the feet stand: x, y [m] and yaw [rad], shape (..., 2, 3).
        heel: By how much their heels are raised, shape (..., 2) [rad]; None is not at all.
    """
    corners = _bearing(robot, heel)
    turned = turn_in_plane(corners[..., 0], corners[..., 1], ground[..., 2, None])
    return np.asarray(ground[..., None, :2] + np.stack(turned, axis=-1))


def _bearing(robot: ReferenceRobot, heel: FloatArray | None) -> FloatArray:
    """Return the corners, in the feet's frames, of what both soles bear on, (..., 2, 4, 2) [m]."""
    corners = robot.corners if heel is None else bearing_corners(robot.corners, heel)
    return corners[..., :2]

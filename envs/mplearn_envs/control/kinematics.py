"""Kinematics of the reference robot: body poses, COG and Jacobians, as numba kernels on plain arrays.

MuJoCo gives the same numbers (the tests compare), but a call per quantity and posture from Python
costs more than the mathematics; planning needs some hundred postures for every primitive.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from mplearn.errors import RobotError
from mplearn.recording import FloatArray, IntArray


class MassTree(NamedTuple):
    """A floating-base tree of B bodies and J hinges; body 0 is the base, parents come first.

    Attributes:
        parent: Index of each body's parent, shape (B,); -1 for the base.
        offset: Position in the parent's frame, shape (B, 3) [m].
        turn: Orientation in the parent's frame, shape (B, 4), w x y z.
        centre: Centre of mass in the body's own frame, shape (B, 3) [m].
        mass: Mass, shape (B,) [kg].
        first_joint: Index of each body's first hinge, shape (B,).
        n_joints: Number of hinges of each body, shape (B,).
        joint_body: Body that each hinge moves, shape (J,).
        anchor: A point of each axis in the frame of its body, shape (J, 3) [m].
        axis: Unit axis of each hinge in the frame of its body, shape (J, 3).
    """

    parent: IntArray
    offset: FloatArray
    turn: FloatArray
    centre: FloatArray
    mass: FloatArray
    first_joint: IntArray
    n_joints: IntArray
    joint_body: IntArray
    anchor: FloatArray
    axis: FloatArray


class Pose(NamedTuple):
    """Where everything is in one posture (world frame).

    Attributes:
        position: Body origins, shape (B, 3) [m].
        rotation: Body orientations, shape (B, 3, 3).
        anchor: A point of every hinge axis, shape (J, 3) [m].
        axis: Hinge axes, shape (J, 3).
        moment: Mass times centre of mass of each body with all that it carries, shape (B, 3) [kg m].
        carried: Mass of each body with all that it carries, shape (B,) [kg].
    """

    position: FloatArray
    rotation: FloatArray
    anchor: FloatArray
    axis: FloatArray
    moment: FloatArray
    carried: FloatArray


def mass_tree(model: Any) -> MassTree:
    """Read the tree from an ``MjModel`` of one floating base with hinges.

    Raises:
        RobotError: The first joint is not free, or another one is not a hinge.
    """
    kinds = model.jnt_type
    if model.njnt < 2 or kinds[0] != 0 or np.any(kinds[1:] != 3) or model.jnt_bodyid[0] != 1:
        raise RobotError("a robot needs one free joint at its first body, then hinges only")
    n_joints = model.body_jntnum[1:].astype(np.int64)
    first = model.body_jntadr[1:].astype(np.int64) - 1
    n_joints[0] -= 1
    first[0] = 0
    return MassTree(
        model.body_parentid[1:].astype(np.int64) - 1,
        np.array(model.body_pos[1:]),
        np.array(model.body_quat[1:]),
        np.array(model.body_ipos[1:]),
        np.array(model.body_mass[1:]),
        first,
        n_joints,
        model.jnt_bodyid[1:].astype(np.int64) - 1,
        np.array(model.jnt_pos[1:]),
        np.array(model.jnt_axis[1:]),
    )


@njit(cache=True)
def rotation_matrix(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrix, shape (3, 3), of a unit quaternion w x y z."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    out = np.empty((3, 3))
    out[0, 0] = 1 - 2 * (y * y + z * z)
    out[0, 1] = 2 * (x * y - w * z)
    out[0, 2] = 2 * (x * z + w * y)
    out[1, 0] = 2 * (x * y + w * z)
    out[1, 1] = 1 - 2 * (x * x + z * z)
    out[1, 2] = 2 * (y * z - w * x)
    out[2, 0] = 2 * (x * z - w * y)
    out[2, 1] = 2 * (y * z + w * x)
    out[2, 2] = 1 - 2 * (x * x + y * y)
    return out


@njit(cache=True)
def axis_rotation(axis: FloatArray, angle: float) -> FloatArray:
    """Return the rotation matrix, shape (3, 3), about a unit axis by an angle [rad]."""
    half = 0.5 * angle
    s = np.sin(half)
    return rotation_matrix(np.array([np.cos(half), axis[0] * s, axis[1] * s, axis[2] * s]))


@njit(cache=True)
def times(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the product of two (3, 3) matrices (BLAS costs more than this at so small a size)."""
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return out


@njit(cache=True)
def turned(a: FloatArray, v: FloatArray) -> FloatArray:
    """Return a (3, 3) matrix times a vector."""
    out = np.empty(3)
    for i in range(3):
        out[i] = a[i, 0] * v[0] + a[i, 1] * v[1] + a[i, 2] * v[2]
    return out


@njit(cache=True)
def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product of two vectors."""
    out = np.empty(3)
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


@njit(cache=True)
def forward(tree: MassTree, q: FloatArray) -> Pose:
    """Return the pose of every body and hinge for ``q`` = position (3), quaternion (4), angles (J,)."""
    n_bodies, n_hinges = tree.parent.shape[0], tree.axis.shape[0]
    position, rotation = np.empty((n_bodies, 3)), np.empty((n_bodies, 3, 3))
    anchor, axis = np.empty((n_hinges, 3)), np.empty((n_hinges, 3))
    moment, carried = np.empty((n_bodies, 3)), tree.mass.copy()
    for b in range(n_bodies):
        p = tree.parent[b]
        if p < 0:
            origin = q[:3].copy()
            frame = rotation_matrix(q[3:7])
        else:
            origin = position[p] + turned(rotation[p], tree.offset[b])
            frame = times(rotation[p], rotation_matrix(tree.turn[b]))
        for j in range(tree.first_joint[b], tree.first_joint[b] + tree.n_joints[b]):
            anchor[j] = origin + turned(frame, tree.anchor[j])
            axis[j] = turned(frame, tree.axis[j])
            frame = times(frame, axis_rotation(tree.axis[j], q[7 + j]))
            origin = anchor[j] - turned(frame, tree.anchor[j])
        position[b] = origin
        rotation[b] = frame
        moment[b] = tree.mass[b] * (origin + turned(frame, tree.centre[b]))
    for b in range(n_bodies - 1, 0, -1):
        moment[tree.parent[b]] += moment[b]
        carried[tree.parent[b]] += carried[b]
    return Pose(position, rotation, anchor, axis, moment, carried)


@njit(cache=True)
def rotation_error(wanted: FloatArray, actual: FloatArray) -> FloatArray:
    """Return the rotation vector [rad], world frame, that turns ``actual`` into ``wanted``."""
    r = times(wanted, actual.T)
    sine = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) * 0.5
    s = np.sqrt(sine[0] ** 2 + sine[1] ** 2 + sine[2] ** 2)
    cosine = 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)
    if s < 1e-9:
        return sine
    return sine * (np.arctan2(s, cosine) / s)


@njit(cache=True)
def rotate_quaternion(quaternion: FloatArray, vector: FloatArray) -> FloatArray:
    """Return the unit quaternion turned by a rotation vector [rad] of the world frame."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    half = 0.5 * angle
    k = 0.5 if angle < 1e-9 else np.sin(half) / angle
    a, b, c, d = np.cos(half), vector[0] * k, vector[1] * k, vector[2] * k
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    out = np.array(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )
    return out / np.sqrt(np.sum(out * out))

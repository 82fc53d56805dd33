"""Kinematics of the reference robot with its masses: body poses and COG, as numba kernels.

MuJoCo gives the same numbers (the tests compare), but a call per quantity and posture from Python
costs more than the mathematics; planning needs some hundred postures for every primitive.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mplearn.body.kinematics.kernels import forward_kinematics
from mplearn.body.kinematics.linkage import Linkage, empty_configuration
from mplearn.body.kinematics.tree import KinematicTree
from mplearn.maths.compiling import njit
from mplearn.maths.quaternions import quaternion_product, vector_quaternion
from mplearn.recording import FloatArray, IntArray

if TYPE_CHECKING:
    import mujoco


class MassTree(NamedTuple):
    """A floating-base tree of B bodies and J hinges; body 0 is the base, parents come first.

    Attributes:
        linkage: How the bodies hang on each other.
        centre: Centre of mass of each body in its own frame, shape (B, 3) [m].
        mass: Mass of each body, shape (B,) [kg].
    """

    linkage: Linkage
    centre: FloatArray
    mass: FloatArray


class Pose(NamedTuple):
    """Where everything is in one posture (world frame).

    Attributes:
        position: Body origins, shape (B, 3) [m].
        rotation: Body orientations, shape (B, 3, 3).
        anchor: A point of every hinge axis, shape (J, 3) [m].
        axis: Hinge axes, shape (J, 3).
        moment: Mass times centre of mass of each body with all that it carries, shape (B, 3) [kg
            m].
        carried: Mass of each body with all that it carries, shape (B,) [kg].
    """

    position: FloatArray
    rotation: FloatArray
    anchor: FloatArray
    axis: FloatArray
    moment: FloatArray
    carried: FloatArray


def mass_tree(model: mujoco.MjModel) -> MassTree:
    """Read the tree from a model of one floating base with hinges.

    Raises:
        BodyError: The first joint is not free, or another one is not a hinge.
    """
    tree = KinematicTree.from_model(model)
    return MassTree(
        tree.linkage,
        np.array(model.body_ipos[1:]),
        np.array(model.body_mass[1:]),
    )


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
    """Return where bodies and hinges are, for ``q`` in the layout of qpos, shape (7 + J,)."""
    at, parent = empty_configuration(tree.linkage), tree.linkage.parent
    forward_kinematics(q, tree.linkage, at)
    position, rotation = at.position, at.rotation
    n_bodies = len(parent)
    moment, carried = np.empty((n_bodies, 3)), tree.mass.copy()
    for b in range(n_bodies):
        x, y, z = tree.centre[b]
        for i in range(3):
            off = rotation[b, i, 0] * x + rotation[b, i, 1] * y + rotation[b, i, 2] * z
            moment[b, i] = tree.mass[b] * (position[b, i] + off)
    for b in range(n_bodies - 1, 0, -1):
        for i in range(3):
            moment[parent[b], i] += moment[b, i]
        carried[parent[b]] += carried[b]
    return Pose(position, rotation, at.anchor, at.axis, moment, carried)


@njit(cache=True, nogil=True)
def places(tree: MassTree, bodies: IntArray, q: FloatArray) -> FloatArray:
    """Return where bodies are on the floor along a motion of shape (T, 7 + J).

    Returns:
        x, y [m] and yaw [rad] of each, shape (T, len(bodies), 3).
    """
    out = np.empty((q.shape[0], bodies.shape[0], 3))
    for t in range(q.shape[0]):
        pose = forward(tree, q[t])
        for i in range(bodies.shape[0]):
            turn = pose.rotation[bodies[i]]
            out[t, i, 0] = pose.position[bodies[i], 0]
            out[t, i, 1] = pose.position[bodies[i], 1]
            out[t, i, 2] = np.arctan2(turn[1, 0], turn[0, 0])
    return out


@njit(cache=True)
def rotate_quaternion(quaternion: FloatArray, vector: FloatArray) -> FloatArray:
    """Return the unit quaternion turned by a rotation vector [rad] of the world frame."""
    turn = vector_quaternion(vector[0], vector[1], vector[2])
    out = np.array(quaternion_product(turn, quaternion))
    out /= np.sqrt(np.sum(out * out))
    return out

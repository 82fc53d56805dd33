"""A body's kinematics as tuples of arrays, for kernels: how it is built, and where all of it is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.recording import BoolArray, FloatArray, IntArray

from ...maths.compiling import njit


class Linkage(NamedTuple):
    """How B bodies hang on each other by n joints; see `KinematicTree`, whose `linkage` it is.

    Attributes:
        parent: Each body's parent, shape (B,); -1 for the base.
        offset: Position in the parent's frame, shape (B, 3) [m].
        rotation: Orientation in the parent's frame, shape (B, 3, 3).
        joint_body: Body that each joint moves, shape (n,).
        slides: Which joints slide, shape (n,).
        axis: Axes in the body's frame, shape (n, 3).
        anchor: Anchors in the body's frame, shape (n, 3) [m].
        first: Body b has the joints [first[b], first[b + 1]), shape (B + 1,).
        above: The next degree of freedom that carries each, shape (6 + n,); -1 for none.
    """

    parent: IntArray
    offset: FloatArray
    rotation: FloatArray
    joint_body: IntArray
    slides: BoolArray
    axis: FloatArray
    anchor: FloatArray
    first: IntArray
    above: IntArray


class Configuration(NamedTuple):
    """Where everything is in one posture, in the world.

    Attributes:
        position: Origins of the bodies, shape (B, 3) [m].
        rotation: Their orientations, shape (B, 3, 3).
        axis: Axes of the joints, shape (n, 3).
        anchor: A point of each axis, shape (n, 3) [m].
    """

    position: FloatArray
    rotation: FloatArray
    axis: FloatArray
    anchor: FloatArray


@njit(cache=True)
def empty_configuration(linkage: Linkage) -> Configuration:
    """Return arrays for `forward_kinematics` to fill."""
    n_bodies, n_joints = len(linkage.parent), len(linkage.axis)
    return Configuration(
        np.empty((n_bodies, 3)),
        np.empty((n_bodies, 3, 3)),
        np.empty((n_joints, 3)),
        np.empty((n_joints, 3)),
    )

"""A body's kinematics as a tuple of arrays, for kernels; points that are fixed to its parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mplearn.recording import BoolArray, FloatArray, IntArray

from .kernels import first_joints, forward_kinematics
from .tree import KinematicTree


class Linkage(NamedTuple):
    """The arrays of a tree that kernels need; see `KinematicTree`, `first_joints` and `_above`."""

    parent: IntArray
    offset: FloatArray
    rotation: FloatArray
    joint_body: IntArray
    slides: BoolArray
    axis: FloatArray
    anchor: FloatArray
    first: IntArray
    above: IntArray

    @classmethod
    def of(cls, tree: KinematicTree) -> Linkage:
        """Take the arrays out of a tree."""
        return cls(
            tree.parent,
            tree.offset,
            tree.rotation,
            tree.joint_body,
            tree.slides,
            tree.axis,
            tree.anchor,
            first_joints(tree.joint_body, len(tree.parent)),
            _above(tree),
        )


def _above(tree: KinematicTree) -> IntArray:
    """Return the next degree of freedom above each, shape (6 + n,); -1 for the first of the base.

    Above a joint are those that carry it: others of its body, its parents', and the base's.
    """
    last = np.full(len(tree.parent), 5)  # degree of freedom nearest to each body
    above = np.arange(-1, 5 + len(tree.joint_body))
    for b, parent in enumerate(tree.parent):
        if parent >= 0:
            last[b] = last[parent]
        for j in np.flatnonzero(tree.joint_body == b):
            above[6 + j], last[b] = last[b], 6 + j
    return above


@njit(cache=True)
def locate(
    q: FloatArray,
    linkage: Linkage,
    bodies: IntArray,
    offsets: FloatArray,
    pos: FloatArray,
    mat: FloatArray,
    axes: FloatArray,
    anchors: FloatArray,
    points: FloatArray,
) -> None:
    """Fill the bodies' places, the hinges' axes and anchors, and the markers' positions."""
    forward_kinematics(
        q,
        linkage.parent,
        linkage.offset,
        linkage.rotation,
        linkage.joint_body,
        linkage.axis,
        linkage.anchor,
        pos,
        mat,
        axes,
        anchors,
        linkage.slides,
    )
    for m in range(len(bodies)):
        b = bodies[m]
        for i in range(3):
            points[m, i] = (
                pos[b, i]
                + mat[b, i, 0] * offsets[m, 0]
                + mat[b, i, 1] * offsets[m, 1]
                + mat[b, i, 2] * offsets[m, 2]
            )


@njit(cache=True)
def points_of_postures(
    postures: FloatArray, linkage: Linkage, bodies: IntArray, offsets: FloatArray
) -> FloatArray:
    """Return the world positions (T, M, 3) [m] of body-fixed points at each posture (T, nq)."""
    n_bodies, n_joints = len(linkage.parent), len(linkage.axis)
    out = np.empty((len(postures), len(bodies), 3))
    pos, mat = np.empty((n_bodies, 3)), np.empty((n_bodies, 3, 3))
    axes, anchors = np.empty((n_joints, 3)), np.empty((n_joints, 3))
    for t in range(len(postures)):
        locate(postures[t], linkage, bodies, offsets, pos, mat, axes, anchors, out[t])
    return out

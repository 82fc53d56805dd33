"""Kernels of kinematics: where bodies are, how points move, how a posture takes a step.

Conventions as in `tree`; all of them fill arrays that the caller owns.
"""

from __future__ import annotations

import numpy as np

from mplearn.maths.quaternions import quaternion_product, vector_quaternion
from mplearn.maths.rotation_kernels import quaternion_matrix, turn_in_place
from mplearn.recording import FloatArray, IntArray

from ...maths.compiling import njit
from .linkage import Configuration, Linkage, empty_configuration


@njit(cache=True)
def forward_kinematics(q: FloatArray, linkage: Linkage, configuration: Configuration) -> None:
    """Fill a configuration by a posture, shape (7 + n,)."""
    parent, offset, rotation = linkage.parent, linkage.offset, linkage.rotation
    joint_body, axis, anchor = linkage.joint_body, linkage.axis, linkage.anchor
    pos, mat = configuration.position, configuration.rotation
    axes, anchors = configuration.axis, configuration.anchor
    pos[0] = q[:3]
    mat[0] = quaternion_matrix(q[3:7])
    j = 0
    for b in range(len(parent)):
        if b > 0:
            p = parent[b]
            for i in range(3):
                at = pos[p, i]
                for k in range(3):
                    at += mat[p, i, k] * offset[b, k]
                    mat[b, i, k] = (
                        mat[p, i, 0] * rotation[b, 0, k]
                        + mat[p, i, 1] * rotation[b, 1, k]
                        + mat[p, i, 2] * rotation[b, 2, k]
                    )
                pos[b, i] = at
        while j < len(joint_body) and joint_body[j] == b:
            for i in range(3):
                at, along = pos[b, i], 0.0
                for k in range(3):
                    at += mat[b, i, k] * anchor[j, k]
                    along += mat[b, i, k] * axis[j, k]
                anchors[j, i] = at
                axes[j, i] = along
            if linkage.slides[j]:
                for i in range(3):
                    pos[b, i] += axes[j, i] * q[7 + j]
                j += 1
                continue
            turn_in_place(mat[b], axis[j], q[7 + j])
            for i in range(3):
                at = anchors[j, i]
                for k in range(3):
                    at -= mat[b, i, k] * anchor[j, k]
                pos[b, i] = at
            j += 1


@njit(cache=True)
def locate(
    q: FloatArray,
    linkage: Linkage,
    bodies: IntArray,
    offsets: FloatArray,
    configuration: Configuration,
    points: FloatArray,
) -> None:
    """Fill a configuration, and the world positions of body-fixed points (M, 3) [m]."""
    forward_kinematics(q, linkage, configuration)
    pos, mat = configuration.position, configuration.rotation
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
    out = np.empty((len(postures), len(bodies), 3))
    configuration = empty_configuration(linkage)
    for t in range(len(postures)):
        locate(postures[t], linkage, bodies, offsets, configuration, out[t])
    return out


@njit(cache=True)
def point_jacobian(
    points: FloatArray,
    bodies: IntArray,
    linkage: Linkage,
    configuration: Configuration,
    out: FloatArray,
) -> None:
    """Fill the Jacobian (M, 3, 6 + n) of world points; `out` is zero where a joint has no part."""
    base_pos, base_mat = configuration.position[0], configuration.rotation[0]
    axes, anchors = configuration.axis, configuration.anchor
    slides, parent, first = linkage.slides, linkage.parent, linkage.first
    for m in range(len(points)):
        x, y, z = points[m, 0], points[m, 1], points[m, 2]
        for k in range(3):
            out[m, k, k] = 1.0
            rx, ry, rz = x - base_pos[0], y - base_pos[1], z - base_pos[2]
            ax, ay, az = base_mat[0, k], base_mat[1, k], base_mat[2, k]
            out[m, 0, 3 + k] = ay * rz - az * ry
            out[m, 1, 3 + k] = az * rx - ax * rz
            out[m, 2, 3 + k] = ax * ry - ay * rx
        b = bodies[m]
        while b >= 0:
            for j in range(first[b], first[b + 1]):
                if slides[j]:
                    for k in range(3):
                        out[m, k, 6 + j] = axes[j, k]
                    continue
                rx, ry, rz = x - anchors[j, 0], y - anchors[j, 1], z - anchors[j, 2]
                out[m, 0, 6 + j] = axes[j, 1] * rz - axes[j, 2] * ry
                out[m, 1, 6 + j] = axes[j, 2] * rx - axes[j, 0] * rz
                out[m, 2, 6 + j] = axes[j, 0] * ry - axes[j, 1] * rx
            b = parent[b]


@njit(cache=True)
def integrate(q: FloatArray, step: FloatArray) -> None:
    """Move a posture, in place, by a step (6 + n,) [m, rad], as `mj_integratePos` does."""
    for i in range(3):
        q[i] += step[i]
    if step[3] != 0.0 or step[4] != 0.0 or step[5] != 0.0:
        turn = vector_quaternion(step[3], step[4], step[5])
        q[3], q[4], q[5], q[6] = quaternion_product(q[3:7], turn)
        norm = np.sqrt(q[3] ** 2 + q[4] ** 2 + q[5] ** 2 + q[6] ** 2)
        for i in range(3, 7):
            q[i] /= norm
    for i in range(6, len(step)):
        q[1 + i] += step[i]

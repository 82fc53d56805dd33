"""The kinematics of a body as plain arrays: postures, point positions, their Jacobian.

MuJoCo's conventions throughout, so that `mj_kinematics` and `mj_jacSite` are exact oracles. A
posture q has MuJoCo's qpos layout (free base, then hinges and slides). A velocity has the layout
of qvel: base velocity in the world's axes, base angular velocity in the base's own axes, then the
joint rates.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from mplearn.errors import BodyError
from mplearn.recording import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, eq=False)
class KinematicTree:
    """A tree of rigid bodies, each hung on its parent by hinges and slides; the root is free.

    Attributes:
        body_names: Names of the B bodies, parents before children.
        parent: Index of each body's parent, shape (B,); -1 for the root.
        offset: Position of each body in its parent's frame, shape (B, 3) [m]; for the root, its
            position in the upright posture.
        rotation: Orientation of each body in its parent's frame at rest, shape (B, 3, 3).
        joint_names: Names of the n joints.
        joint_body: Body that each joint moves, shape (n,), not decreasing.
        slides: Which joints slide along their axis instead of turning about it, shape (n,).
        axis: Joint axes in the body's frame, shape (n, 3).
        anchor: Joint anchors in the body's frame, shape (n, 3) [m].
        limits: Lower and upper joint limits, shape (n, 2) [rad, or m for a slide].
        site_names: Names of the S sites.
        site_body: Body of each site, shape (S,).
        site_offset: Sites in their body's frame, shape (S, 3) [m].
    """

    body_names: tuple[str, ...]
    parent: IntArray
    offset: FloatArray
    rotation: FloatArray
    joint_names: tuple[str, ...]
    joint_body: IntArray
    slides: BoolArray
    axis: FloatArray
    anchor: FloatArray
    limits: FloatArray
    site_names: tuple[str, ...]
    site_body: IntArray
    site_offset: FloatArray

    @classmethod
    def from_model(cls, model: mujoco.MjModel) -> KinematicTree:
        """Extract the kinematics of a compiled model.

        Raises:
            BodyError: The model is not one tree with a free root, or has joints other than hinges
                and slides.
        """
        import mujoco

        kinds = model.jnt_type
        if model.nbody < 2 or model.body_jntnum[1] != 1 or kinds[0] != mujoco.mjtJoint.mjJNT_FREE:
            raise BodyError("the first body of the model needs one free joint")
        allowed = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
        if not np.isin(kinds[1:], [int(kind) for kind in allowed]).all():
            raise BodyError("all joints but the base's must be hinges or slides")
        if (model.body_parentid[2:] == 0).any():
            raise BodyError("all bodies must hang on the first one; the model has several trees")

        def name(kind: int, i: int) -> str:
            return mujoco.mj_id2name(model, kind, i) or ""

        quats = model.body_quat[1:].astype(np.float64)
        return cls(
            body_names=tuple(name(mujoco.mjtObj.mjOBJ_BODY, i) for i in range(1, model.nbody)),
            parent=model.body_parentid[1:].astype(np.int64) - 1,
            offset=model.body_pos[1:].astype(np.float64),
            rotation=np.array([quaternion_matrix(q) for q in quats]),
            joint_names=tuple(name(mujoco.mjtObj.mjOBJ_JOINT, i) for i in range(1, model.njnt)),
            joint_body=model.jnt_bodyid[1:].astype(np.int64) - 1,
            slides=kinds[1:] == int(mujoco.mjtJoint.mjJNT_SLIDE),
            axis=model.jnt_axis[1:].astype(np.float64),
            anchor=model.jnt_pos[1:].astype(np.float64),
            limits=np.where(
                model.jnt_limited[1:, None].astype(bool), model.jnt_range[1:], (-np.pi, np.pi)
            ),
            site_names=tuple(name(mujoco.mjtObj.mjOBJ_SITE, i) for i in range(model.nsite)),
            site_body=model.site_bodyid.astype(np.int64) - 1,
            site_offset=model.site_pos.astype(np.float64),
        )

    @property
    def n_dofs(self) -> int:
        """Degrees of freedom: 6 of the base and one a joint."""
        return 6 + len(self.joint_names)

    def body(self, name: str) -> int:
        """Return the index of a body.

        Raises:
            BodyError: There is none of that name.
        """
        if name not in self.body_names:
            raise BodyError(f"no body {name!r}; there are {', '.join(self.body_names)}")
        return self.body_names.index(name)

    def scaled(self, factors: FloatArray) -> KinematicTree:
        """Return the tree with each body's lengths multiplied, factors (B, 3) along its own axes.

        A body's factors move what is attached to it: its children, joints and sites. The root's
        rest height follows, so that the soles stay on the floor.
        """
        if factors.shape != self.offset.shape or not (factors > 0).all():
            raise BodyError(
                f"factors must be positive, of shape {self.offset.shape}, not {factors.shape}"
            )
        offset = self.offset.copy()
        offset[1:] *= factors[self.parent[1:]]
        tree = replace(
            self,
            offset=offset,
            anchor=self.anchor * factors[self.joint_body],
            site_offset=self.site_offset * factors[self.site_body],
        )
        soles = [i for i, site in enumerate(self.site_names) if site.startswith("sole_")]
        if soles:
            offset[0, 2] -= tree.site_positions(tree.rest)[soles, 2].min()
        return tree

    @property
    def rest(self) -> FloatArray:
        """The upright posture, all joints at zero, shape (7 + n,)."""
        return np.concatenate((self.offset[0], (1.0, 0.0, 0.0, 0.0), np.zeros(len(self.axis))))

    def forward(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where the bodies are: positions (B, 3) [m] and orientations (B, 3, 3)."""
        pos, mat, _, _ = self._forward(q)
        return pos, mat

    def site_positions(self, q: FloatArray) -> FloatArray:
        """Return the sites' positions in the world, shape (S, 3) [m]."""
        return self.points(q, self.site_body, self.site_offset)

    def points(self, q: FloatArray, bodies: IntArray, offsets: FloatArray) -> FloatArray:
        """Return the world positions of body-fixed points, shape (M, 3) [m].

        Args:
            q: Posture, shape (7 + n,).
            bodies: Body of each point, shape (M,).
            offsets: Points in their body's frame, shape (M, 3) [m].
        """
        pos, mat = self.forward(q)
        points: FloatArray = pos[bodies] + np.einsum("mij,mj->mi", mat[bodies], offsets)
        return points

    def jacobian(self, q: FloatArray, bodies: IntArray, offsets: FloatArray) -> FloatArray:
        """Return the Jacobian of points, shape (M, 3, 6 + n); arguments as in `points`."""
        pos, mat, axes, anchors = self._forward(q)
        points = pos[bodies] + np.einsum("mij,mj->mi", mat[bodies], offsets)
        out = np.zeros((len(bodies), 3, self.n_dofs))
        first = first_joints(self.joint_body, len(self.parent))
        point_jacobian(
            points, bodies, pos[0], mat[0], axes, anchors, self.slides, self.parent, first, out
        )
        return out

    def _forward(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        if q.shape != (7 + len(self.axis),):
            raise BodyError(f"a posture has shape ({7 + len(self.axis)},), not {q.shape}")
        n_bodies, n = len(self.parent), len(self.axis)
        pos, mat = np.empty((n_bodies, 3)), np.empty((n_bodies, 3, 3))
        axes, anchors = np.empty((n, 3)), np.empty((n, 3))
        forward_kinematics(
            np.ascontiguousarray(q, dtype=np.float64),
            self.parent,
            self.offset,
            self.rotation,
            self.joint_body,
            self.axis,
            self.anchor,
            pos,
            mat,
            axes,
            anchors,
            self.slides,
        )
        return pos, mat, axes, anchors


def first_joints(joint_body: IntArray, n_bodies: int) -> IntArray:
    """Return, for each body, its first joint; body b has joints [first[b], first[b + 1])."""
    return np.searchsorted(joint_body, np.arange(n_bodies + 1)).astype(np.int64)


@njit(cache=True)
def quaternion_matrix(q: FloatArray) -> FloatArray:
    """Return the rotation matrix (3, 3) of a quaternion (w, x, y, z), which need not be normal."""
    norm = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    w, x, y, z = q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm
    m = np.empty((3, 3))
    m[0, 0] = 1 - 2 * (y * y + z * z)
    m[0, 1] = 2 * (x * y - w * z)
    m[0, 2] = 2 * (x * z + w * y)
    m[1, 0] = 2 * (x * y + w * z)
    m[1, 1] = 1 - 2 * (x * x + z * z)
    m[1, 2] = 2 * (y * z - w * x)
    m[2, 0] = 2 * (x * z - w * y)
    m[2, 1] = 2 * (y * z + w * x)
    m[2, 2] = 1 - 2 * (x * x + y * y)
    return m


@njit(cache=True)
def turn(mat: FloatArray, axis: FloatArray, angle: float) -> None:
    """Turn a rotation matrix, in place, about an axis of its own frame."""
    s, c = np.sin(angle), np.cos(angle)
    x, y, z = axis[0], axis[1], axis[2]
    v = 1.0 - c
    r00, r01, r02 = c + x * x * v, x * y * v - z * s, x * z * v + y * s
    r10, r11, r12 = y * x * v + z * s, c + y * y * v, y * z * v - x * s
    r20, r21, r22 = z * x * v - y * s, z * y * v + x * s, c + z * z * v
    for i in range(3):
        a, b, d = mat[i, 0], mat[i, 1], mat[i, 2]
        mat[i, 0] = a * r00 + b * r10 + d * r20
        mat[i, 1] = a * r01 + b * r11 + d * r21
        mat[i, 2] = a * r02 + b * r12 + d * r22


@njit(cache=True)
def forward_kinematics(
    q: FloatArray,
    parent: IntArray,
    offset: FloatArray,
    rotation: FloatArray,
    joint_body: IntArray,
    axis: FloatArray,
    anchor: FloatArray,
    pos: FloatArray,
    mat: FloatArray,
    axes: FloatArray,
    anchors: FloatArray,
    slides: BoolArray | None = None,
) -> None:
    """Fill body positions and orientations, and each joint's axis and anchor in the world.

    All joints are hinges where `slides` is not given.
    """
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
            if slides is not None and slides[j]:
                for i in range(3):
                    pos[b, i] += axes[j, i] * q[7 + j]
                j += 1
                continue
            turn(mat[b], axis[j], q[7 + j])
            for i in range(3):
                at = anchors[j, i]
                for k in range(3):
                    at -= mat[b, i, k] * anchor[j, k]
                pos[b, i] = at
            j += 1


@njit(cache=True)
def point_jacobian(
    points: FloatArray,
    bodies: IntArray,
    base_pos: FloatArray,
    base_mat: FloatArray,
    axes: FloatArray,
    anchors: FloatArray,
    slides: BoolArray,
    parent: IntArray,
    first: IntArray,
    out: FloatArray,
) -> None:
    """Fill the Jacobian (M, 3, 6 + n) of world points; `out` is zero where a joint has no part."""
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
    angle = np.sqrt(step[3] ** 2 + step[4] ** 2 + step[5] ** 2)
    if angle > 0.0:
        s = np.sin(0.5 * angle) / angle
        rw, rx, ry, rz = np.cos(0.5 * angle), s * step[3], s * step[4], s * step[5]
        w, x, y, z = q[3], q[4], q[5], q[6]
        q[3] = w * rw - x * rx - y * ry - z * rz
        q[4] = w * rx + x * rw + y * rz - z * ry
        q[5] = w * ry - x * rz + y * rw + z * rx
        q[6] = w * rz + x * ry - y * rx + z * rw
        norm = np.sqrt(q[3] ** 2 + q[4] ** 2 + q[5] ** 2 + q[6] ** 2)
        for i in range(3, 7):
            q[i] /= norm
    for i in range(6, len(step)):
        q[1 + i] += step[i]

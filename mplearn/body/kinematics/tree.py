"""The kinematics of a body as plain arrays: postures, point positions, their Jacobian.

MuJoCo's conventions throughout, so that `mj_kinematics` and `mj_jacSite` are exact oracles. A
posture q has MuJoCo's qpos layout (free base, then hinges and slides). A velocity has the layout
of qvel: base velocity in the world's axes, base angular velocity in the base's own axes, then the
joint rates.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mplearn.errors import BodyError
from mplearn.maths.read_only import read_only
from mplearn.maths.rotations import quaternion_to_matrix
from mplearn.recording import BoolArray, FloatArray, IntArray

from .kernels import forward_kinematics, point_jacobian
from .linkage import Configuration, Linkage, empty_configuration

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, eq=False)
class KinematicTree:
    """A tree of rigid bodies, each hung on its parent by hinges and slides; the root is free.

    Its arrays refuse to be changed: bodies are shared by all who ask for them.

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

    Example:
        >>> from mplearn.body import human_body
        >>> tree = human_body().tree
        >>> position, rotation = tree.forward(tree.rest)
        >>> position.shape, rotation.shape
        ((20, 3), (20, 3, 3))
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
    _own: dict[str, Any] = field(init=False, repr=False)  # the arrays themselves, for kernels

    def __post_init__(self) -> None:
        given = {each.name: getattr(self, each.name) for each in fields(self) if each.init}
        own = {
            name: value if value.flags.writeable else value.copy()
            for name, value in given.items()
            if isinstance(value, np.ndarray)
        }
        object.__setattr__(self, "_own", own)
        for name, value in own.items():
            object.__setattr__(self, name, read_only(value))

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

        return cls(
            body_names=tuple(name(mujoco.mjtObj.mjOBJ_BODY, i) for i in range(1, model.nbody)),
            parent=model.body_parentid[1:].astype(np.int64) - 1,
            offset=model.body_pos[1:].astype(np.float64),
            rotation=quaternion_to_matrix(model.body_quat[1:]),
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

    @cached_property
    def linkage(self) -> Linkage:
        """The tree's arrays, as kernels take them."""
        first = np.searchsorted(self.joint_body, np.arange(len(self.parent) + 1)).astype(np.int64)
        own = {name: self._own[name] for name in Linkage._fields if name in self._own}
        return Linkage(**own, first=first, above=_above(self.parent, self.joint_body))

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
        at = self._configuration(q)
        return at.position, at.rotation

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
        at = self._configuration(q)
        points = at.position[bodies] + np.einsum("mij,mj->mi", at.rotation[bodies], offsets)
        out = np.zeros((len(bodies), 3, self.n_dofs))
        point_jacobian(points, bodies, self.linkage, at, out)
        return out

    def _configuration(self, q: FloatArray) -> Configuration:
        if q.shape != (7 + len(self.axis),):
            raise BodyError(f"a posture has shape ({7 + len(self.axis)},), not {q.shape}")
        at: Configuration = empty_configuration(self.linkage)
        forward_kinematics(np.ascontiguousarray(q, dtype=np.float64), self.linkage, at)
        return at


def _above(parent: IntArray, joint_body: IntArray) -> IntArray:
    """Return the next degree of freedom above each, shape (6 + n,); -1 for the first of the base.

    Above a joint are those that carry it: others of its body, its parents', and the base's.
    """
    last = np.full(len(parent), 5)  # degree of freedom nearest to each body
    above = np.arange(-1, 5 + len(joint_body))
    for b, up in enumerate(parent):
        if up >= 0:
            last[b] = last[up]
        for j in np.flatnonzero(joint_body == b):
            above[6 + j], last[b] = last[b], 6 + j
    return above

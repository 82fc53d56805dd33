"""The shapes of a robot: as they are, or as small convex polyhedra, which a plain canvas can draw.

For these, whatever a geom is, a mesh or a capsule, its outermost points in some directions are
taken and wrapped in their convex hull.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mplearn.maths.rotations import quaternion_to_matrix
from mplearn.recording import FloatArray, IntArray

from ..robot_model import RobotModel

if TYPE_CHECKING:
    import mujoco

_DIRECTIONS, _FINE = 60, 300
_HIDDEN_GROUP = 3  # geoms from this group on are for contact, not to be seen
_DEFAULT = (0.5, 0.5, 0.5, 1.0)


class Surface(NamedTuple):
    """A visible shape, by triangles.

    Attributes:
        body: Which of the robot's bodies it is a part of.
        points: Its corners in the body's frame, shape (P, 3) [m].
        faces: Corners of each triangle, counted round as seen from outside, shape (F, 3).
        rgb: Its colour, as screens show it, from 0 to 1.
    """

    body: int
    points: FloatArray
    faces: IntArray
    rgb: tuple[float, ...]


@lru_cache(maxsize=8)
def shapes(model: RobotModel) -> list[dict[str, Any]]:
    """Return the visible shapes in few words: ``body``, ``points`` [m], ``faces``, ``rgb``.

    They are worked out once a model; nobody changes them.
    """
    return [
        {
            "body": shape.body,
            "points": shape.points.round(4).tolist(),
            "faces": shape.faces.tolist(),
            "rgb": list(shape.rgb),
        }
        for shape in _shapes(model, as_they_are=False)
    ]


@lru_cache(maxsize=8)
def surfaces(model: RobotModel) -> tuple[Surface, ...]:
    """Return the visible shapes with the meshes as they are; worked out once a model."""
    return tuple(_shapes(model, as_they_are=True))


def _shapes(model: RobotModel, *, as_they_are: bool) -> Iterator[Surface]:
    import mujoco

    place = {int(body): k for k, body in enumerate(model.bodies)}
    mujoco_model = model.model
    own = [g for g in range(mujoco_model.ngeom) if int(mujoco_model.geom_bodyid[g]) in place]
    seen = [g for g in own if mujoco_model.geom_group[g] < _HIDDEN_GROUP] or own
    for geom in seen:
        wrapped: tuple[FloatArray, IntArray] | None
        if as_they_are and mujoco_model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            wrapped = _mesh(mujoco_model, geom)
        else:
            ways = _directions(_FINE if as_they_are else _DIRECTIONS)
            wrapped = _wrapped(_outermost(mujoco_model, geom, ways))
        if wrapped is None:
            continue
        corners, faces = wrapped
        turn = quaternion_to_matrix(mujoco_model.geom_quat[geom])
        body = place[int(mujoco_model.geom_bodyid[geom])]
        points = corners @ turn.T + mujoco_model.geom_pos[geom]
        yield Surface(body, points, faces, _colour(mujoco_model, geom))


def _mesh(model: mujoco.MjModel, geom: int) -> tuple[FloatArray, IntArray]:
    """Return corners and faces of a mesh, in the geom's frame."""
    mesh = int(model.geom_dataid[geom])
    start, n = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    first, n_faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    corners = np.array(model.mesh_vert[start : start + n], dtype=np.float64)
    return corners, np.array(model.mesh_face[first : first + n_faces], dtype=np.int64)


def _outermost(model: mujoco.MjModel, geom: int, ways: FloatArray) -> FloatArray:
    """Return points of a geom's surface, farthest in some directions, in its frame, (P, 3) [m]."""
    import mujoco

    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        vertices, _ = _mesh(model, geom)
        return np.asarray(vertices[np.unique(np.argmax(vertices @ ways.T, axis=0))])
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
        return np.asarray(size * corners)
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return np.asarray(size[0] * ways)
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return np.asarray(size * ways)
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return np.asarray(size[0] * ways + np.sign(ways[:, 2:]) * [0.0, 0.0, size[1]])
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        angle = np.linspace(0.0, 2 * np.pi, 20, endpoint=False)
        ring = np.column_stack((size[0] * np.cos(angle), size[0] * np.sin(angle)))
        return np.vstack([np.column_stack((ring, np.full(20, z))) for z in (-size[1], size[1])])
    return np.zeros((0, 3))  # planes and height fields are no part of a robot


def _wrapped(points: FloatArray) -> tuple[FloatArray, IntArray] | None:
    """Return the corners and faces (counted from outside) of a convex hull; None for a flat one."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) < 4:
        return None
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    used = hull.vertices
    number = {int(v): k for k, v in enumerate(used)}
    faces = []
    for corners, plane in zip(hull.simplices, hull.equations, strict=True):
        a, b, c = points[corners]
        outwards = np.cross(b - a, c - a) @ plane[:3] > 0
        order = corners if outwards else corners[::-1]
        faces.append([number[int(v)] for v in order])
    return points[used], np.array(faces, dtype=np.int64)


def _colour(model: mujoco.MjModel, geom: int) -> tuple[float, ...]:
    rgba, material = model.geom_rgba[geom], int(model.geom_matid[geom])
    if material >= 0 and np.allclose(rgba, _DEFAULT):
        rgba = model.mat_rgba[material]
    return tuple(round(float(x), 3) for x in rgba[:3])


def _directions(n: int) -> FloatArray:
    """Return unit vectors spread evenly (a Fibonacci sphere), shape (n, 3)."""
    k = np.arange(n) + 0.5
    z, angle = 1.0 - 2.0 * k / n, np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z * z)
    return np.column_stack((ring * np.cos(angle), ring * np.sin(angle), z))

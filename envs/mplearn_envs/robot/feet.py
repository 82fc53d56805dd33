"""Feet and soles: how they are named, where their corners are, when they touch, how they lift."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mplearn.errors import RobotError
from mplearn.recording import FloatArray

if TYPE_CHECKING:
    import mujoco

SOLES = ("sole_l", "sole_r")  # the boxes on which a robot stands, one a foot
#: Lower corners of a box, front ones first, counter-clockwise as seen from below.
CORNER_SIGNS = np.array([[1.0, 1, -1], [1, -1, -1], [-1, -1, -1], [-1, 1, -1]])

LEVEL = 0.995  # least cosine between the floor and the foot of a robot at attention
TOUCHES_M = 0.004  # the corner of a sole that is no higher above the floor carries
# A demonstrator's feet are measured through markers and a body that is not quite his, so a foot
# that stands seems to move by more than that; it is seen relative to the other.
LIFT_M = 0.03  # a foot that rises so far over the other leaves the ground
DOWN_M = 0.012  # and it is down where it is less


def sole_corners(model: mujoco.MjModel) -> FloatArray:
    """Return the lower corners of both soles in their feet's frames, shape (2, 4, 3) [m]."""
    soles = [model.geom(name) for name in SOLES]
    return np.stack([sole.pos + CORNER_SIGNS * sole.size for sole in soles])


def foot_hinges(model: mujoco.MjModel, feet: tuple[str, str]) -> tuple[str, ...]:
    """Return the hinges that move a part of a foot against the rest of it: toes, or heels."""
    parts = {body for foot in feet for body in below(model, model.body(foot).id)}
    parts -= {model.body(foot).id for foot in feet}
    return tuple(
        model.joint(j).name for j in range(model.njnt) if int(model.jnt_bodyid[j]) in parts
    )


def below(model: mujoco.MjModel, body: int) -> set[int]:
    """Return a body and all that it carries."""
    found = {body}
    for b in range(body + 1, model.nbody):  # parents come first
        if int(model.body_parentid[b]) in found:
            found.add(b)
    return found


def foot_points(model: mujoco.MjModel, data: mujoco.MjData, foot: int) -> FloatArray:
    """Return points around a foot and its toes, those shapes that collide if any do, (P, 3) [m].

    Corners of the shapes' boxes, or a mesh's vertices; world frame.
    """
    import mujoco

    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    own = np.isin(model.geom_bodyid, list(below(model, foot)))
    collide = own & ((model.geom_contype != 0) | (model.geom_conaffinity != 0))
    points = [np.zeros((0, 3))]
    for geom in np.flatnonzero(collide if collide.any() else own):
        local = model.geom_aabb[geom, :3] + signs * model.geom_aabb[geom, 3:]
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.mesh(int(model.geom_dataid[geom]))
            first = int(mesh.vertadr[0])
            local = model.mesh_vert[first : first + int(mesh.vertnum[0])].astype(np.float64)
        points.append(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return np.concatenate(points)


def way_up(model: mujoco.MjModel, body: int) -> list[int]:
    """Return a body and all that it hangs on, up to the one that hangs on nothing."""
    found = [body]
    while int(model.body_parentid[found[-1]]):
        found.append(int(model.body_parentid[found[-1]]))
    return found


def require_soles(model: mujoco.MjModel, feet: tuple[str, str], name: str) -> None:
    """Check that each foot has its sole: a box, its edges along the axes of the foot.

    Raises:
        RobotError: It has not.
    """
    import mujoco

    for foot, sole in zip(feet, SOLES, strict=True):
        geom = model.geom(sole)
        box = int(geom.type[0]) == int(mujoco.mjtGeom.mjGEOM_BOX)
        straight = np.allclose(np.abs(geom.quat), (1.0, 0.0, 0.0, 0.0), atol=1e-3)
        if int(geom.bodyid[0]) != model.body(foot).id or not box or not straight:
            raise RobotError(
                f"robot {name!r}: geom {sole!r} must be a box on body {foot!r}, its edges along "
                "the body's axes"
            )

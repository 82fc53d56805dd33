"""How a robot stands, drawn on the floor: support polygon, COG and ZMP."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.mechanics.support import convex_hull
from mplearn_envs.robot.feet import CORNER_SIGNS, SOLES, TOUCHES_M

_LIFT_M = 0.004  # what is drawn lies so far above the floor
_EDGE_M, _SPOT_M = 0.006, 0.016
_EDGE = (0.10, 0.45, 0.85, 1.0)
_COG = (0.10, 0.65, 0.25, 1.0)
_ZMP = (0.90, 0.25, 0.10, 1.0)


class BalanceMarks(NamedTuple):
    """What is drawn.

    Attributes:
        polygon: Corners of the support polygon, counter-clockwise, shape (H, 2) [m]; H = 0 where
            nothing carries.
        cog: Centre of gravity, shape (3,) [m].
        zmp: Zero-moment point, shape (2,) [m]; NaN where nothing carries.
    """

    polygon: FloatArray
    cog: FloatArray
    zmp: FloatArray


class BalanceMeter:
    """Finds the marks of simulations of one model; it leaves them as they are.

    Args:
        model: A model of one robot with the geoms ``sole_l`` and ``sole_r``, perhaps with other
            bodies behind it.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._data = mujoco.MjData(model)
        self._soles = [model.geom(name).id for name in SOLES]
        self._state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))

    def measure(self, data: mujoco.MjData) -> BalanceMarks:
        """Return the marks of a state of the simulation; the ZMP is that of the contact forces."""
        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        mujoco.mj_getState(self._model, data, self._state, kind)
        mujoco.mj_setState(self._model, self._data, self._state, kind)
        mujoco.mj_forward(self._model, self._data)
        return self._marks(self._centre_of_pressure())

    def pose(self, data: mujoco.MjData, zmp: FloatArray) -> BalanceMarks:
        """Return the marks of a posture without forces, given the ZMP (2,) [m]."""
        self._data.qpos[:] = data.qpos
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        return self._marks(zmp)

    def _marks(self, zmp: FloatArray) -> BalanceMarks:
        data, model = self._data, self._model
        corners = np.concatenate(
            [
                CORNER_SIGNS * model.geom_size[g] @ data.geom_xmat[g].reshape(3, 3).T
                + data.geom_xpos[g]
                for g in self._soles
            ]
        )
        down = corners[corners[:, 2] < TOUCHES_M, :2]
        polygon = convex_hull(down) if len(down) >= 3 else np.empty((0, 2))
        return BalanceMarks(polygon, data.subtree_com[1].copy(), zmp)

    def _centre_of_pressure(self) -> FloatArray:
        force, total, moment = np.empty(6), 0.0, np.zeros(2)
        for i in range(self._data.ncon):
            contact = self._data.contact[i]
            if contact.geom1 in self._soles or contact.geom2 in self._soles:
                mujoco.mj_contactForce(self._model, self._data, i, force)
                total += force[0]
                moment += force[0] * contact.pos[:2]
        return moment / total if total > 1.0 else np.full(2, np.nan)


def draw_balance(scene: mujoco.MjvScene, marks: BalanceMarks) -> None:
    """Add the marks to what is about to be drawn: polygon blue, COG green, ZMP red.

    The COG itself is a small ball, joined by a thin line to its projection on the floor.
    """
    corners = np.column_stack((marks.polygon, np.full(len(marks.polygon), _LIFT_M)))
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        _connect(scene, a, b, _EDGE_M, _EDGE)
    foot = np.array([*marks.cog[:2], 1.5 * _LIFT_M])
    _connect(scene, foot, marks.cog, 0.3 * _EDGE_M, (*_COG[:3], 0.5))
    _spot(scene, marks.cog, mujoco.mjtGeom.mjGEOM_SPHERE, 1.2 * _SPOT_M, _COG)
    _spot(scene, foot, mujoco.mjtGeom.mjGEOM_CYLINDER, 1.5 * _SPOT_M, _COG)
    if np.isfinite(marks.zmp).all():
        place = np.array([*marks.zmp, 3 * _LIFT_M])
        _spot(scene, place, mujoco.mjtGeom.mjGEOM_CYLINDER, _SPOT_M, _ZMP)


def _connect(
    scene: mujoco.MjvScene, a: FloatArray, b: FloatArray, width: float, colour: tuple[float, ...]
) -> None:
    kind = mujoco.mjtGeom.mjGEOM_CAPSULE
    geom = _add(scene, kind, np.zeros(3), np.zeros(3), colour)
    if geom is not None:
        mujoco.mjv_connector(geom, kind, width, a, b)


def _spot(
    scene: mujoco.MjvScene,
    place: FloatArray,
    kind: mujoco.mjtGeom,
    radius: float,
    colour: tuple[float, ...],
) -> None:
    _add(scene, kind, np.array([radius, 0.1 * _LIFT_M, 0.0]), place, colour)


def _add(
    scene: mujoco.MjvScene,
    kind: mujoco.mjtGeom,
    size: FloatArray,
    place: FloatArray,
    colour: tuple[float, ...],
) -> mujoco.MjvGeom | None:
    if scene.ngeom >= scene.maxgeom:
        return None
    geom = scene.geoms[scene.ngeom]
    rgba = np.array(colour, dtype=np.float32)
    mujoco.mjv_initGeom(geom, kind, size, place, np.eye(3).ravel(), rgba)
    geom.emission = 0.6
    scene.ngeom += 1
    return geom

"""A stage on which bodies stand side by side, and pictures of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mplearn.closing import Closing
from mplearn.recording import FloatArray

if TYPE_CHECKING:
    import mujoco

#: Distance between neighbours on the stage [m].
APART_M = 1.15
#: The camera stands far off with a long lens, or neighbours would be seen from different sides.
_DISTANCE_M = 7.0
_HEIGHT_M = 2.6  # of what is seen at the bodies


class Stage(Closing):
    """Renders postures, not physics: a posture is shown as it is given.

    Use it in a ``with`` block; it holds a renderer.

    Args:
        bodies: MJCF text of each body, from left to right as the audience sees them; the first one
            brings floor and light.
        size: Width and height of a picture [pixels].
        balance: Whether the first body's support polygon, COG and ZMP can be drawn.

    Raises:
        MissingDependencyError: There is no off-screen renderer on this machine.

    Example:
        >>> from mplearn.body import human_body
        >>> try:
        ...     with Stage([human_body().xml], size=(64, 48)) as stage:
        ...         shape = stage.picture([human_body().rest]).shape
        ... except MissingDependencyError:  # no renderer on this machine
        ...     shape = (48, 64, 3)
        >>> shape
        (48, 64, 3)
    """

    def __init__(
        self, bodies: Sequence[str], size: tuple[int, int] = (640, 480), *, balance: bool = False
    ) -> None:
        import mujoco

        from mplearn_envs.rendering.overlay import BalanceMeter
        from mplearn_envs.rendering.renderer import open_renderer

        self.bodies, self.size, self.balance = tuple(bodies), size, balance
        self._model = _scene(self.bodies)
        self._data = mujoco.MjData(self._model)
        self._meter = BalanceMeter(self._model) if balance else None
        self._starts = np.flatnonzero(self._model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
        self._starts = self._model.jnt_qposadr[self._starts]
        self._camera = mujoco.MjvCamera()
        self._camera.lookat[:] = (0.0, 0.0, 1.04)
        self._camera.distance = _DISTANCE_M
        self._camera.azimuth = 180.0 if len(self.bodies) > 1 else 165.0
        self._camera.elevation = -26.0 if balance else -5.0  # the floor must be seen
        self._renderer = open_renderer(self._model, *size)
        # shadows and reflections take three quarters of the time where there is no graphics card
        for effect in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._renderer.scene.flags[effect] = 0

    def picture(
        self, postures: Sequence[FloatArray], zmp: FloatArray | None = None
    ) -> NDArray[np.uint8]:
        """Return a picture, shape (H, W, 3), of one posture a body, each as its qpos (7 + n,).

        Args:
            postures: The postures.
            zmp: The first body's zero-moment point where it was performed, shape (2,) [m]; with
                ``balance`` it is drawn beside polygon and COG.
        """
        import mujoco

        places = _places(len(self.bodies))
        for start, posture, y in zip(self._starts, postures, places, strict=True):
            qpos = self._data.qpos[start : start + len(posture)]
            qpos[:] = posture
            qpos[1] += y
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._renderer.update_scene(self._data, self._camera)
        if self._meter is not None:
            from mplearn_envs.rendering.overlay import draw_balance

            shift = np.array([0.0, places[0]])
            point = np.full(2, np.nan) if zmp is None else zmp + shift
            draw_balance(self._renderer.scene, self._meter.pose(self._data, point))
        picture: NDArray[np.uint8] = self._renderer.render()
        return picture.copy()

    def close(self) -> None:
        """Give the renderer back."""
        self._renderer.close()


def _places(n: int) -> FloatArray:
    """Return where each body stands, across the stage [m]; y points to the audience's right."""
    return np.asarray(APART_M * (np.arange(n) - (n - 1) / 2), dtype=np.float64)


def _scene(bodies: Sequence[str]) -> mujoco.MjModel:
    import mujoco

    scene = mujoco.MjSpec.from_string(bodies[0])
    for k, xml in enumerate(bodies[1:]):
        body = mujoco.MjSpec.from_string(xml)
        scene.attach(body, prefix=f"body_{k + 2}_", frame=scene.worldbody.add_frame())
    for y in _places(len(bodies)):
        for radius in (0.14, 0.19, 0.25, 0.32):  # a soft shade under each body
            scene.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                size=(radius, 0.001, 0.0),
                pos=(0.02, y, 0.002 + 0.01 * (0.32 - radius)),
                rgba=(0.1, 0.13, 0.2, 0.09),
                contype=0,
                conaffinity=0,
            )
    model = scene.compile()
    model.vis.global_.fovy = np.degrees(2 * np.arctan(0.5 * _HEIGHT_M / _DISTANCE_M))
    model.vis.quality.numslices, model.vis.quality.numstacks = 20, 10  # a third faster than 28, 16
    return model

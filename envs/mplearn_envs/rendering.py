"""Pictures of the robot, and of the person beside it."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mplearn.errors import InvalidValueError, MissingDependencyError
from mplearn.recording import FloatArray

if TYPE_CHECKING:
    import mujoco.viewer

BESIDE_M = 1.1  # how far to the robot's left the person stands


class Renderer:
    """Draws a simulation off screen; the camera looks at the robot's waist and follows it.

    Args:
        model: The simulation's model.
        width: Width of the pictures [pixels].
        height: Height of the pictures [pixels].
        azimuth_deg: From where the camera looks: 180 is the robot's front.
        distance_m: How far away the camera is [m].
        shadows: Whether shadows are drawn, which takes four times as long without a graphics card.

    Raises:
        MissingDependencyError: There is no off-screen rendering on this machine.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        width: int = 640,
        height: int = 480,
        azimuth_deg: float = 150.0,
        distance_m: float = 3.0,
        shadows: bool = False,
    ) -> None:
        try:
            self._renderer = mujoco.Renderer(model, height=height, width=width)
        except (ImportError, AttributeError, RuntimeError, mujoco.FatalError) as error:
            raise MissingDependencyError(
                "pictures need an off-screen renderer: install libegl1 and libgl1-mesa-dri and set "
                f"MUJOCO_GL=egl, or libosmesa6 and MUJOCO_GL=osmesa ({error})"
            ) from error
        except ValueError as error:
            raise InvalidValueError(
                f"pictures of {width} x {height} cannot be drawn: {error}"
            ) from error
        self.camera = mujoco.MjvCamera()
        self.camera.azimuth = azimuth_deg
        self.camera.elevation = -8.0
        self.camera.distance = distance_m
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = int(shadows)
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0

    def render(self, data: mujoco.MjData, person: FloatArray | None = None) -> NDArray[np.uint8]:
        """Return a picture, shape (height, width, 3).

        Args:
            data: State of the simulation.
            person: Posture of `mplearn.body.human_body`, shape (47,), drawn at the robot's left.
        """
        here = data.xpos[1] * (1.0, 1.0, 0.0)
        there = here + np.array([0.0, BESIDE_M, 0.0])
        self.camera.lookat[:] = here if person is None else 0.5 * (here + there)
        self.camera.lookat[2] = 0.9
        self._renderer.update_scene(data, self.camera)
        add_ground_shadow(self._renderer.scene, here)
        if person is not None:
            add_ground_shadow(self._renderer.scene, there)
            add_person(self._renderer.scene, person, there)
        return np.array(self._renderer.render())

    def close(self) -> None:
        """Free the renderer; a second time does nothing."""
        self._renderer.close()


@lru_cache(maxsize=1)
def _person_model() -> tuple[mujoco.MjModel, mujoco.MjData]:
    from mplearn.body import human_body

    model = human_body().model()
    return model, mujoco.MjData(model)


def add_ground_shadow(scene: mujoco.MjvScene, place: FloatArray) -> None:
    """Darken the floor under a body: feet do not seem to float, and it costs next to nothing.

    Args:
        scene: What is about to be drawn.
        place: Middle of the shadow, shape (3,) [m].
    """
    for radius in np.linspace(0.12, 0.40, 10):
        if scene.ngeom >= scene.maxgeom:
            return
        mujoco.mjv_initGeom(
            scene.geoms[scene.ngeom],
            mujoco.mjtGeom.mjGEOM_CYLINDER,
            np.array([radius, 2e-4, 0.0]),
            np.array([place[0], place[1], 1e-3 - 1e-3 * radius]),
            np.eye(3).ravel(),
            np.array([0.0, 0.0, 0.0, 0.04], dtype=np.float32),
        )
        scene.ngeom += 1


def add_person(scene: mujoco.MjvScene, posture: FloatArray, place: FloatArray) -> None:
    """Add a person to a scene.

    Args:
        scene: What is about to be drawn.
        posture: Posture of `mplearn.body.human_body`, shape (47,).
        place: Where the person's base is moved to, shape (3,) [m]; its height stays.

    Raises:
        InvalidValueError: The posture does not fit the human body.
    """
    model, data = _person_model()
    posture = np.asarray(posture, dtype=np.float64)
    if posture.shape != (model.nq,) or not np.isfinite(posture).all():
        raise InvalidValueError(
            f"a person's posture is {model.nq} finite values, not {posture.shape}"
        )
    data.qpos[:] = posture
    data.qpos[:2] = place[:2]
    mujoco.mj_kinematics(model, data)
    first = scene.ngeom
    options, nothing = mujoco.MjvOption(), mujoco.MjvPerturb()
    mujoco.mjv_addGeoms(model, data, options, nothing, mujoco.mjtCatBit.mjCAT_DYNAMIC, scene)
    for geom in scene.geoms[first : scene.ngeom]:
        geom.matid = -1  # materials are looked up in the robot's model


class Viewer:
    """A window that shows a simulation, where there is a screen.

    Raises:
        MissingDependencyError: There is no screen.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        import os
        import sys

        if sys.platform == "linux" and not (
            os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        ):
            raise MissingDependencyError(
                "render_mode 'human' needs a screen, and there is none; use 'rgb_array'"
            )
        import mujoco.viewer

        self._window: Any = mujoco.viewer.launch_passive(model, data)

    def show(self) -> None:
        """Show the present state."""
        self._window.sync()

    def close(self) -> None:
        """Close the window."""
        self._window.close()

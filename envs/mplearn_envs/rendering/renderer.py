"""Pictures of the robot."""

from __future__ import annotations

import atexit
from functools import cache
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

import mujoco
import numpy as np
from numpy.typing import NDArray

from mplearn.errors import InvalidValueError, MissingDependencyError
from mplearn.recording import FloatArray

from .overlay import BalanceMeter, draw_balance

if TYPE_CHECKING:
    import mujoco.viewer

_open: WeakSet[Any] = WeakSet()
_refusal: list[str] = []  # why nothing can be drawn here, once it is known


@cache
def _register() -> None:
    """Go ahead of the end of EGL, which MuJoCo registered when it made the first renderer."""
    atexit.register(_close_all)


def _close_all() -> None:
    for renderer in list(_open):
        renderer.close()


def open_renderer(model: mujoco.MjModel, width: int, height: int) -> mujoco.Renderer:
    """Return MuJoCo's off-screen renderer, which is closed before the interpreter ends.

    One that is not needed before may be closed, or forgotten. Once it could not be opened, it is
    not tried again: with some graphics libraries a second attempt aborts the process.

    Raises:
        MissingDependencyError: There is no off-screen rendering on this machine.
        InvalidValueError: Pictures of this size cannot be drawn.
    """
    if _refusal:
        raise MissingDependencyError(_refusal[0])
    try:
        renderer = mujoco.Renderer(model, height=height, width=width)
    except (ImportError, AttributeError, RuntimeError, mujoco.FatalError) as error:
        _refusal.append(
            "pictures need an off-screen renderer: install libegl1 and libgl1-mesa-dri and set "
            "MUJOCO_GL=egl, or libosmesa6 and MUJOCO_GL=osmesa, before the process starts "
            f"({error})"
        )
        raise MissingDependencyError(_refusal[0]) from error
    except ValueError as error:
        raise InvalidValueError(
            f"pictures of {width} x {height} cannot be drawn: {error}"
        ) from error
    _open.add(renderer)
    _register()
    return renderer


class Renderer:
    """Draws a simulation off screen; the camera looks at the robot's waist and follows it.

    Args:
        model: The simulation's model.
        width: Width of the pictures [pixels].
        height: Height of the pictures [pixels].
        azimuth_deg: From where the camera looks: 180 is the robot's front.
        distance_m: How far away the camera is [m].
        shadows: Whether shadows are drawn, which takes four times as long without a graphics card.
        balance: Whether support polygon, COG and ZMP are drawn, see `draw_balance`.

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
        balance: bool = False,
    ) -> None:
        self._renderer = open_renderer(model, width, height)
        self._meter = BalanceMeter(model) if balance else None
        self.camera = mujoco.MjvCamera()
        self.camera.azimuth = azimuth_deg
        self.camera.elevation = -30.0 if balance else -8.0  # the floor must be seen
        self.camera.distance = distance_m
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = int(shadows)
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0

    def render(self, data: mujoco.MjData) -> NDArray[np.uint8]:
        """Return a picture of the simulation's state, shape (height, width, 3)."""
        here = data.xpos[1] * (1.0, 1.0, 0.0)
        self.camera.lookat[:] = here
        self.camera.lookat[2] = 0.9
        self._renderer.update_scene(data, self.camera)
        add_ground_shadow(self._renderer.scene, here)
        if self._meter is not None:
            draw_balance(self._renderer.scene, self._meter.measure(data))
        return np.array(self._renderer.render())

    def close(self) -> None:
        """Free the renderer; a second time does nothing."""
        self._renderer.close()


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

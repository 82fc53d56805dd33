"""What draws an environment: pictures off screen, or a window."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from mplearn.errors import InvalidValueError
from mplearn_envs.execution.simulation import Simulation

RENDER_MODES = ("human", "rgb_array")


class Screen:
    """Draws a simulation in the way a render mode asks for; loads nothing before it draws.

    Args:
        mode: None, "rgb_array" or "human".
        width: Width of pictures [pixels].
        height: Height of pictures [pixels].
        balance: Whether support polygon, COG and ZMP are drawn on the floor of pictures.
    """

    def __init__(
        self,
        mode: Literal["human", "rgb_array"] | None,
        width: int,
        height: int,
        balance: bool = False,
    ) -> None:
        self.mode = mode
        self.width = width
        self.height = height
        self.balance = balance
        self._drawer: Any = None

    def picture(self, simulation: Simulation) -> NDArray[np.uint8] | None:
        """Return a picture, shape (height, width, 3), or show the window.

        Raises:
            InvalidValueError: There is no render mode.
        """
        if self.mode is None:
            raise InvalidValueError("render needs render_mode='rgb_array' (or 'human')")
        if self.mode == "human":
            self.show(simulation)
            return None
        if self._drawer is None:
            from .renderer import Renderer

            self._drawer = Renderer(simulation.model, self.width, self.height, balance=self.balance)
        picture: NDArray[np.uint8] = self._drawer.render(simulation.data)
        return picture

    def show(self, simulation: Simulation) -> None:
        """Show the window, where the render mode is "human"."""
        if self.mode != "human":
            return
        if self._drawer is None:
            from .renderer import Viewer

            self._drawer = Viewer(simulation.model, simulation.data)
        self._drawer.show()

    def close(self) -> None:
        """Free what drawing needed; a second time does nothing."""
        if self._drawer is not None:
            self._drawer.close()
            self._drawer = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_drawer": None}

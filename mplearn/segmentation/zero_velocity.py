"""Zero-velocity segmentation: a boundary where the whole body comes to rest or turns round.

[Fod2002] cuts where joint velocities cross zero. Here one speed is watched, the norm of the
low-pass velocity of all channels, with hysteresis: a boundary lies at the local minimum between two
peaks that both exceed it by far. It is decided as soon as the second rise has shown itself.
Nothing depends on the unit of the channels.
"""

from __future__ import annotations

from typing import Any

from ..maths.compiling import njit
from ..recording import FloatArray
from .speed import Watched, ZeroVelocityConfig, readiness, take_speed
from .speed_segmenter import SpeedSegmenter
from .watch import watch


@njit(cache=True)
def _steps(frames: FloatArray, watched: Watched, hysteresis: float, out: Any) -> tuple[int, int]:
    """Take frames until some end segments; see `SpeedSegmenter`."""
    for k in range(len(frames)):
        s = take_speed(frames[k], watched)
        if s < 0.0:
            return k, -1
        m, p = watched.state[0], watched.settings[0]
        n = watch(m, p, s, hysteresis, readiness(m, p), watched.speeds, out)
        if n > 0:
            return k + 1, int(n)
    return len(frames), 0


class ZeroVelocity(SpeedSegmenter):
    """Cuts where the speed of the whole body has a deep local minimum, or rests.

    Args:
        n_channels: Width D of a frame.
        rate_hz: Frames per second [1/s].
        config: Settings.

    Raises:
        InvalidValueError: An argument is out of range.

    Example:
        >>> import numpy as np
        >>> segmenter = ZeroVelocity(n_channels=1, rate_hz=50.0)
        >>> swings = np.sin(np.pi * np.arange(400) / 50.0)[:, None]  # turns each second
        >>> cuts = [cut for frame in swings for cut in segmenter.update(frame)]
        >>> (cuts[3].end - cuts[2].end) / 50.0
        1.0
    """

    def __init__(
        self, n_channels: int, rate_hz: float, config: ZeroVelocityConfig | None = None
    ) -> None:
        config = config or ZeroVelocityConfig()
        super().__init__(n_channels, rate_hz, config)
        self.config = config
        self._reset()

    def _steps(self, frames: FloatArray) -> tuple[int, int]:
        return _steps(frames, self._watched, self.config.hysteresis, self._out)

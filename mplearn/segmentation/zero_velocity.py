"""Zero-velocity segmentation: a boundary where the whole body comes to rest or turns round.

[Fod2002] cuts where joint velocities cross zero. Here one speed is watched, the norm of the
low-pass velocity of all channels, with hysteresis: a boundary lies at the local minimum between two
peaks that both exceed it by far. It is decided as soon as the second rise has shown itself.
Nothing depends on the unit of the channels.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from ..recording import FloatArray
from .kernels import all_finite, smooth_velocity
from .speed import ZeroVelocityConfig, see_speed, watch
from .speed_segmenter import SpeedSegmenter


@njit(cache=True)
def _step(
    frame: FloatArray,
    filter_: FloatArray,
    hysteresis: float,
    memory: FloatArray,
    state: Any,
    settings: Any,
    out: FloatArray,
) -> int:
    """Take one frame; return the number of segments written to `out`, or -1 if it is not finite."""
    m, p = state[0], settings[0]
    if not all_finite(frame):
        return -1
    s = smooth_velocity(frame, filter_, memory, m.frames == 0)
    see_speed(m, p, s)
    return int(watch(m, p, s, hysteresis, out))


class ZeroVelocity(SpeedSegmenter):
    """Cuts where the speed of the whole body has a deep local minimum, or rests.

    Args:
        n_channels: Width D of a frame.
        rate_hz: Frames per second [1/s].
        config: Settings.

    Raises:
        InvalidValueError: An argument is out of range.
    """

    def __init__(
        self, n_channels: int, rate_hz: float, config: ZeroVelocityConfig | None = None
    ) -> None:
        config = config or ZeroVelocityConfig()
        super().__init__(n_channels, rate_hz, config)
        self.config = config
        self._reset()

    def _step(self, frame: FloatArray) -> int:
        return int(
            _step(
                frame,
                self._filter,
                self.config.hysteresis,
                self._arrays["memory"],
                self._arrays["state"],
                self._settings,
                self._out,
            )
        )

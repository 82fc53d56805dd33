"""Kinematic centroid segmentation: a boundary where a motion is farthest from where it began.

[Jenkins2004] follows the centroid of a limb and cuts where its distance from the segment's start
has a maximum. Here the low-pass frame itself takes the centroid's place, since channels may be of
any kind. A maximum counts if it is far compared with what the running speed covers, and it is
decided as soon as the distance has fallen by a share of itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..maths.compiling import njit
from ..recording import FloatArray
from .base import check_positive, check_share
from .kernels import distance
from .speed import (
    LENGTH,
    RETURN,
    Watched,
    ZeroVelocityConfig,
    all_low,
    close,
    readiness,
    running_speed,
    take_speed,
)
from .speed_segmenter import SpeedSegmenter


@dataclass(frozen=True)
class KinematicCentroidConfig:
    """Settings of `KinematicCentroid`.

    Attributes:
        drop: A maximum is decided when the distance has fallen by this share of it.
        reach_s: A maximum counts if it is as far as the running speed leads in this time [s].
        speed: How the speed is filtered, what counts as still, and how long segments are.

    Example:
        >>> config = KinematicCentroidConfig(drop=0.1)  # decided later, and more surely
        >>> KinematicCentroid(3, 100.0, config).n_channels
        3
    """

    drop: float = 0.05
    reach_s: float = 0.3
    speed: ZeroVelocityConfig = field(default_factory=ZeroVelocityConfig)

    def __post_init__(self) -> None:
        check_share(self, "drop")
        check_positive(self, "reach_s")


FARTHEST = np.dtype([("away", "f8"), ("frame", "i8")])


class Places(NamedTuple):
    """Filtered frames, shape (D,) each, and how far apart they are.

    Attributes:
        first: Where the open segment began.
        farthest: Where it was farthest from there.
        reach: How far that was, and when, shape (1,).
    """

    first: FloatArray
    farthest: FloatArray
    reach: Any


@njit(cache=True)
def _steps(
    frames: FloatArray, watched: Watched, drop: float, reach_s: float, places: Places, out: Any
) -> tuple[int, int]:
    """Take frames until one ends a segment; see `SpeedSegmenter`.

    Args:
        frames: Shape (T, D).
        watched: As bundled by `SpeedSegmenter`.
        drop: As in the configuration.
        reach_s: As in the configuration.
        places: What is kept of the open segment.
        out: Receives the segment.
    """
    for k in range(len(frames)):
        if take_speed(frames[k], watched) < 0.0:
            return k, -1
        m, p = watched.state[0], watched.settings[0]
        place, weights = watched.smooth.place, watched.smooth.weights
        t = m.frames - 1
        reach = places.reach[0]
        if t == 0:
            places.first[:] = place
        away = distance(place, places.first, weights)
        if away >= reach.away:
            reach.away, reach.frame = away, t
            places.farthest[:] = place
        end, confidence, cause = -1, 0.0, LENGTH
        needed = reach_s * running_speed(m) / readiness(m, p)
        far_enough = reach.away > needed and reach.frame - m.start >= p.shortest
        if far_enough and away < (1.0 - drop) * reach.away:
            end, confidence, cause = reach.frame, 1.0 - needed / reach.away, RETURN
        elif t - m.start >= p.longest:
            end = t
            places.farthest[:] = place
        if end < 0:
            continue
        low = p.still_share * running_speed(m)
        n = close(m, p, end, confidence, all_low(m, end, low, watched.speeds), cause, out, 0)
        places.first[:] = places.farthest
        reach.away = distance(place, places.first, weights)
        reach.frame = t
        places.farthest[:] = place
        return k + 1, int(n)
    return len(frames), 0


class KinematicCentroid(SpeedSegmenter):
    """Cuts where the body is farthest from where the segment began.

    Args:
        n_channels: Width D of a frame.
        rate_hz: Frames per second [1/s].
        config: Settings.

    Raises:
        InvalidValueError: An argument is out of range.

    Example:
        >>> import numpy as np
        >>> segmenter = KinematicCentroid(n_channels=1, rate_hz=100.0)
        >>> t = np.arange(800) / 100.0
        >>> lifts = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> [segment.end for segment in segmenter.segment(lifts)][:2]  # the top, the rest
        [50, 102]
    """

    def __init__(
        self, n_channels: int, rate_hz: float, config: KinematicCentroidConfig | None = None
    ) -> None:
        self.config = config = config or KinematicCentroidConfig()
        super().__init__(n_channels, rate_hz, config.speed)
        self._reset()

    def _new_arrays(self) -> dict[str, Any]:
        arrays = super()._new_arrays()
        width = self.n_channels
        places = Places(np.zeros(width), np.zeros(width), np.zeros(1, dtype=FARTHEST))
        return arrays | places._asdict()

    def _bind(self) -> None:
        super()._bind()
        self._places = self._bound(Places)

    def _steps(self, frames: FloatArray) -> tuple[int, int]:
        c = self.config
        return _steps(frames, self._watched, c.drop, c.reach_s, self._places, self._out)

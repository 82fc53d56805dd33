"""Kinematic centroid segmentation: a boundary where a motion is farthest from where it began.

[Jenkins2004] follows the centroid of a limb and cuts where its distance from the segment's start
has a maximum. Here the low-pass frame itself takes the centroid's place, since channels may be of
any kind. A maximum counts if it is far compared with what the running speed covers, and it is
decided as soon as the distance has fallen by a share of itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit

from ..recording import FloatArray
from .base import check_positive, check_share
from .speed import ZeroVelocityConfig, all_low, close, readiness, running_speed, take_speed
from .speed_segmenter import SpeedSegmenter


@dataclass(frozen=True)
class KinematicCentroidConfig:
    """Settings of `KinematicCentroid`.

    Attributes:
        drop: A maximum is decided when the distance has fallen by this share of it.
        reach_s: A maximum counts if it is as far as the running speed leads in this time [s].
        speed: How the speed is filtered, what counts as still, and how long segments are.
    """

    drop: float = 0.05
    reach_s: float = 0.3
    speed: ZeroVelocityConfig = field(default_factory=ZeroVelocityConfig)

    def __post_init__(self) -> None:
        check_share(self, "drop")
        check_positive(self, "reach_s")


@njit(cache=True)
def _distance(a: FloatArray, b: FloatArray, weights: FloatArray) -> float:
    total = 0.0
    for i in range(a.shape[0]):
        total += weights[i] * (a[i] - b[i]) ** 2
    return float(np.sqrt(total))


@njit(cache=True)
def _step(
    frame: FloatArray,
    watcher: Any,
    drop: float,
    reach_s: float,
    places: FloatArray,
    farthest: FloatArray,
    out: FloatArray,
) -> int:
    """Take one frame.

    Args:
        frame: Shape (D,).
        watcher: As bundled by `SpeedSegmenter`.
        drop: As in the configuration.
        reach_s: As in the configuration.
        places: The filtered frame where the segment began, and the farthest, shape (2, D).
        farthest: The greatest distance and its frame, shape (2,).
        out: Receives the segment.
    """
    filter_, settings, memory, state, speeds = watcher
    m, p = state[0], settings[0]
    if take_speed(frame, filter_, memory, m, p, speeds) < 0.0:
        return -1
    t = m.frames - 1
    if t == 0:
        places[0] = memory[2]
    away = _distance(memory[2], places[0], memory[4])
    if away >= farthest[0]:
        farthest[0], farthest[1] = away, t
        places[1] = memory[2]
    end, confidence = -1, 0.0
    needed = reach_s * running_speed(m) / readiness(m, p)
    far_enough = farthest[0] > needed and farthest[1] - m.start >= p.shortest
    if far_enough and away < (1.0 - drop) * farthest[0]:
        end, confidence = int(farthest[1]), 1.0 - needed / farthest[0]
    elif t - m.start >= p.longest:
        end = t
        places[1] = memory[2]
    if end < 0:
        return 0
    low = p.still_share * running_speed(m)
    n = close(m, p, end, confidence, all_low(m, end, low, speeds), out)
    places[0] = places[1]
    farthest[0] = _distance(memory[2], places[0], memory[4])
    farthest[1] = t
    places[1] = memory[2]
    return int(n)


class KinematicCentroid(SpeedSegmenter):
    """Cuts where the body is farthest from where the segment began.

    Args:
        n_channels: Width D of a frame.
        rate_hz: Frames per second [1/s].
        config: Settings.

    Raises:
        InvalidValueError: An argument is out of range.
    """

    def __init__(
        self, n_channels: int, rate_hz: float, config: KinematicCentroidConfig | None = None
    ) -> None:
        self.config = config = config or KinematicCentroidConfig()
        super().__init__(n_channels, rate_hz, config.speed)
        self._reset()

    def _new_arrays(self) -> dict[str, Any]:
        arrays = super()._new_arrays()
        arrays["places"] = np.zeros((2, self.n_channels))
        arrays["farthest"] = np.zeros(2)
        return arrays

    def _step(self, frame: FloatArray) -> int:
        a, c = self._arrays, self.config
        places, farthest = a["places"], a["farthest"]
        return int(_step(frame, self._watcher, c.drop, c.reach_s, places, farthest, self._out))

"""Kohlmorgen-Lemm segmentation: windows of the stream as states of a hidden Markov model.

The distance between windows is the integrated square error of their densities (`windows`); the
cheapest sequence of states is found as the windows come in (`viterbi`), and every change of state
is a candidate for a boundary. [Kulic2012], section 2.1; [KohlmorgenLemm2001]; first in, first out
after [Janus2006].

What the densities are taken over decides what is found. Over *postures*, as the paper has it, the
distribution changes most in the middle of a movement. Over the *direction of motion*, a unit
vector, it changes where people see a boundary: at the turn. There a change of state is taken as
evidence, and the boundary is set, and confirmed, by the minimum of the speed; or, where the speed
has none, by a turn of the motion (`turns`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray
from .base import check_positive, check_share, frames_of
from .envelope import ROWS
from .kohlmorgen_lemm_steps import (
    ENVELOPE,
    EXACT,
    PLAIN,
    SCALES,
    States,
    steps_direction,
    steps_posture,
)
from .speed import ZeroVelocityConfig
from .speed_segmenter import SpeedSegmenter, check_record
from .turns import Trail, TurnConfig, new_trail, turn_settings
from .viterbi import Path, new_path
from .windows import Windows, new_windows

Density = Literal["direction", "posture"]
TRAIL_S = 3.0  # how long the latest frames are kept to look at again
START_COST_S = 0.05  # C until the envelope has been seen


@dataclass(frozen=True)
class KohlmorgenLemmConfig:
    """Settings of `KohlmorgenLemm`; times in seconds.

    Attributes:
        density: What the densities are taken over.
        embedding: Number m of frames that make up one point.
        delay_s: Time tau between them [s].
        window_s: Length W of a window [s].
        fifo_s: Time over which windows are kept as states [s].
        switch_cost_s: Cost C of a change of state, times the frame interval: that of being at
            distance 1 for this long [s]. None lets the motion itself choose it, see `envelope`.
        sigma: Width of the kernels. For directions absolute, they have unit length; for postures a
            multiple of the running mean distance of a point to its nearest neighbours.
        neighbours_s: The number of those neighbours, as a stretch of frames [s].
        exact: Whether the path is found by dynamic programming over all states of the FIFO in
            every frame, instead of by the on-line recursion; the cost grows with its square.
        still_direction: For directions: motion slower than this share of the running speed loses
            its direction.
        hysteresis_turned: For directions: a minimum of the speed where the state changes is a
            boundary if it lies below this share of both peaks; elsewhere
            ``zero_velocity.hysteresis`` holds.
        tolerance_s: How far from the minimum the change of state may lie [s].
        zero_velocity: How the speed is watched.
        turns: For directions: how turns of a motion that never rests are found.

    Example:
        >>> KohlmorgenLemmConfig().density, KohlmorgenLemmConfig.posture().density
        ('direction', 'posture')
    """

    density: Density = "direction"
    embedding: int = 1
    delay_s: float = 0.02
    window_s: float = 0.06
    fifo_s: float = 2.0
    switch_cost_s: float | None = 0.05
    sigma: float = 1.2
    neighbours_s: float = 0.1
    exact: bool = False
    still_direction: float = 0.05
    hysteresis_turned: float = 0.35
    tolerance_s: float = 0.15
    zero_velocity: ZeroVelocityConfig = field(
        default_factory=lambda: ZeroVelocityConfig(hysteresis=0.25)
    )
    turns: TurnConfig = field(default_factory=TurnConfig)

    def __post_init__(self) -> None:
        if self.density not in ("direction", "posture"):
            raise InvalidValueError(
                f"density must be 'direction' or 'posture', not {self.density!r}"
            )
        if self.embedding < 1:
            raise InvalidValueError(f"embedding must be at least 1, not {self.embedding}")
        check_positive(self, "delay_s", "window_s", "sigma", "neighbours_s", "still_direction")
        check_positive(
            self, "tolerance_s", *(() if self.switch_cost_s is None else ("switch_cost_s",))
        )
        check_share(self, "hysteresis_turned")
        if self.exact and self.switch_cost_s is None:
            raise InvalidValueError("the exact path needs a switch_cost_s, not None")
        if not self.fifo_s >= 4 * self.window_s:
            raise InvalidValueError(
                f"fifo_s must be at least 4 window_s ({4 * self.window_s}), not {self.fifo_s}"
            )

    @classmethod
    def posture(cls) -> KohlmorgenLemmConfig:
        """Return the settings for the densities of the paper, over embedded postures."""
        return cls(
            density="posture",
            embedding=3,
            delay_s=0.03,
            window_s=0.3,
            fifo_s=5.0,
            switch_cost_s=0.1,
            sigma=2.0,
        )


SETTINGS = np.dtype(
    [
        ("delay", "i8"),
        ("window", "i8"),
        ("cost", "f8"),
        ("sigma", "f8"),
        ("neighbours", "i8"),
        ("mode", "i8"),
        ("every", "i8"),
        ("still_direction", "f8"),
        ("hysteresis", "f8"),
        ("hysteresis_turned", "f8"),
        ("tolerance", "i8"),
        ("forget", "f8"),
    ]
)


class KohlmorgenLemm(SpeedSegmenter):
    """Cuts where the density of the motion changes.

    Args:
        n_channels: Width D of a frame.
        rate_hz: Frames per second [1/s].
        config: Settings.

    Raises:
        InvalidValueError: An argument is out of range.

    Example:
        >>> import numpy as np
        >>> segmenter = KohlmorgenLemm(n_channels=2, rate_hz=100.0)
        >>> t = np.arange(800) / 100.0
        >>> lift = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)
        >>> frames = np.stack((lift, 0.5 * lift), axis=1)  # up, down, a rest
        >>> [segment.end for segment in segmenter.segment(frames)][:3]
        [50, 100, 201]
    """

    def __init__(
        self, n_channels: int, rate_hz: float, config: KohlmorgenLemmConfig | None = None
    ) -> None:
        self.config = config = config or KohlmorgenLemmConfig()
        super().__init__(n_channels, rate_hz, config.zero_velocity)
        self._model = settings = np.zeros(1, dtype=SETTINGS)
        settings["delay"] = frames_of(config.delay_s, rate_hz)
        settings["window"] = max(2, frames_of(config.window_s, rate_hz))
        settings["cost"] = (config.switch_cost_s or START_COST_S) * rate_hz
        settings["neighbours"] = frames_of(config.neighbours_s, rate_hz)
        settings["tolerance"] = frames_of(config.tolerance_s, rate_hz)
        settings["forget"] = 1.0 / frames_of(config.zero_velocity.memory_s, rate_hz)
        settings["hysteresis"] = config.zero_velocity.hysteresis
        for name in ("sigma", "still_direction", "hysteresis_turned"):
            settings[name] = getattr(config, name)
        settings["mode"] = EXACT if config.exact else PLAIN
        if config.switch_cost_s is None:
            settings["mode"] = ENVELOPE
        self._turns = turn_settings(config.turns, rate_hz, config.tolerance_s)
        self._kernel = steps_direction if config.density == "direction" else steps_posture
        self._reset()

    def _new_arrays(self) -> dict[str, Any]:
        q, embedding = self._model[0], self.config.embedding
        length, delay, mode = int(q["window"]), int(q["delay"]), int(q["mode"])
        count = max(4 * length, frames_of(self.config.fifo_s, self.rate_hz))
        size = count + length
        self._model["every"] = every = -(-size // ROWS)
        shape = {PLAIN: (1, 1), EXACT: (size, size), ENVELOPE: (size // every + 1, size)}[mode]
        arrays = super()._new_arrays()
        arrays |= new_windows(embedding * self.n_channels, length, count)._asdict()
        arrays |= new_path(size)._asdict()
        arrays |= new_trail(self.n_channels, frames_of(TRAIL_S, self.rate_hz))._asdict()
        arrays["history"] = np.zeros(((embedding - 1) * delay + 1, self.n_channels))
        arrays["scales"] = np.zeros(1, dtype=SCALES)
        arrays["matrix"] = np.zeros(shape)
        arrays["speeds"] = np.zeros(len(arrays["speeds"]) + size)  # postures are judged late
        return arrays

    def _bind(self) -> None:
        super()._bind()
        a, bound = self._arrays, self._bound
        self._states = States(bound(Windows), bound(Path), a["matrix"], a["history"], a["scales"])
        self._trail = bound(Trail)

    def _check_loaded(self, arrays: dict[str, Any]) -> None:
        super()._check_loaded(arrays)
        frames = arrays["state"]["frames"][0]
        times = ("anchor", "far_frame", "away_frame", "candidate", "before")
        lengths = ("pace", "far", "away", "apart", "along", "energy")
        ranges = dict.fromkeys(times, (-1, frames)) | dict.fromkeys(lengths, (0.0, np.inf))
        check_record("turning", arrays["turning"][0], ranges)

    def _steps(self, frames: FloatArray) -> tuple[int, int]:
        return self._kernel(
            frames,
            self._watched,
            self._model,
            self._states,
            self._turns,
            self._trail,
            self._out,
        )

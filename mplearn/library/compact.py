"""Exemplars in little space: fewer frames, and 16 bits a value."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from ..maths.filters import lowpass
from ..maths.splines import interpolate
from ..recording import FloatArray

_KNOT_RATE_HZ = 25.0
_CUTOFF_HZ = 8.0  # human motion lies below; what lies above would fold back at the knots


@dataclass(frozen=True, eq=False)
class CompactMotion:
    """A motion kept as knots of a cubic spline, at least 25 a second.

    What a library keeps of an exemplar is exactly this: `frames` before saving and after loading
    are equal bit for bit. Against the original they lack what is faster than 8 Hz, and are rounded
    to 2^-15 of the channel's largest magnitude.

    Attributes:
        knots: Shape (K, D), 16 bit integers.
        exponents: Values are ``knots * 2 ** exponents``, shape (D,).
        n_frames: Number of frames T.

    Example:
        >>> t = np.linspace(0.0, 1.0, 101)[:, None]
        >>> compact = CompactMotion.of(np.sin(2 * np.pi * t), 100.0)
        >>> len(compact.knots), bool(abs(compact.frames - np.sin(2 * np.pi * t)).max() < 1e-3)
        (26, True)
    """

    knots: NDArray[np.int16]
    exponents: NDArray[np.int16]
    n_frames: int

    def __post_init__(self) -> None:
        knots, exponents = np.array(self.knots, np.int16), np.array(self.exponents, np.int16)
        if knots.ndim != 2 or exponents.shape != knots.shape[1:]:
            raise ModelError(
                f"knots (K, D) need exponents (D,), not {knots.shape} and {exponents.shape}"
            )
        if not 1 <= len(knots) <= self.n_frames <= 1_000_000:
            raise ModelError(f"{len(knots)} knots cannot stand for {self.n_frames} frames")
        if (np.abs(exponents) > 900).any():
            raise ModelError("exponents must lie in [-900, 900]")
        for name, array in (("knots", knots), ("exponents", exponents)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def of(cls, frames: FloatArray, rate_hz: float) -> CompactMotion:
        """Make a motion compact.

        Args:
            frames: Shape (T, D), finite.
            rate_hz: Frames per second [1/s].
        """
        n_frames = len(frames)
        n_knots = int(np.ceil((n_frames - 1) / rate_hz * min(_KNOT_RATE_HZ, rate_hz))) + 1
        n_knots = min(max(n_knots, 4), n_frames)
        places = np.linspace(0, n_frames - 1, n_knots)
        smooth = lowpass(frames, rate_hz, _CUTOFF_HZ) if n_knots < n_frames else frames
        values = smooth if n_knots == n_frames else interpolate(smooth, places)
        magnitude = np.maximum(np.abs(values).max(axis=0), 1e-9)
        exponents = np.ceil(np.log2(magnitude)).astype(np.int16) - 15
        knots = np.clip(np.round(np.ldexp(values, -exponents)), -32768, 32767)
        return cls(knots.astype(np.int16), exponents, n_frames)

    @cached_property
    def frames(self) -> FloatArray:
        """The motion, shape (T, D)."""
        values = np.ldexp(self.knots.astype(np.float64), self.exponents)
        places = np.linspace(0, len(values) - 1, self.n_frames)
        frames = values if len(values) == self.n_frames else interpolate(values, places)
        frames.flags.writeable = False
        return frames

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the frames, which can be worked out again."""
        return {name: value for name, value in self.__dict__.items() if name != "frames"}

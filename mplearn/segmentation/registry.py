"""Segmenters by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from ..errors import InvalidValueError
from ..plugins import join_installed
from .base import Segmenter
from .kinematic_centroid import KinematicCentroid
from .kohlmorgen_lemm import KohlmorgenLemm, KohlmorgenLemmConfig
from .upsampling import upsampled
from .zero_velocity import ZeroVelocity

ENTRY_POINTS = "mplearn.segmenters"
"""Group of the entry points by which an installed package brings segmenters of its own."""


def _over_postures(n_channels: int, rate_hz: float) -> Segmenter:
    return KohlmorgenLemm(n_channels, rate_hz, KohlmorgenLemmConfig.posture())


SEGMENTERS: dict[str, Callable[[int, float], Segmenter]] = {
    "kinematic-centroid": upsampled(KinematicCentroid),
    "kohlmorgen-lemm": upsampled(KohlmorgenLemm),
    "kohlmorgen-lemm-posture": upsampled(_over_postures),
    "zero-velocity": upsampled(ZeroVelocity),
}


def register_segmenter(name: str, make: Callable[[int, float], Segmenter]) -> None:
    """Let `LearnerConfig.segmenter` and ``--segmenter`` name a segmenter of one's own.

    Args:
        name: Its name.
        make: Called with the width of a frame and the rate [1/s]; a class will do.

    Raises:
        InvalidValueError: The name is taken by another.

    Example:
        >>> from mplearn.segmentation import ZeroVelocity
        >>> register_segmenter("by rests", ZeroVelocity)
        >>> type(make_segmenter("by rests", 2, 100.0)).__name__
        'ZeroVelocity'
        >>> del SEGMENTERS["by rests"]
    """
    if SEGMENTERS.setdefault(name, make) is not make:
        raise InvalidValueError(f"there is a segmenter {name!r} already")


def make_segmenter(name: str, n_channels: int, rate_hz: float) -> Segmenter:
    """Build a segmenter with its default settings; of a slow stream it is `Upsampled`.

    Args:
        name: One of `SEGMENTERS`, or of those that were registered.
        n_channels: Width D of a frame.
        rate_hz: Frames per second [1/s].

    Raises:
        InvalidValueError: There is no such segmenter, or a number is out of range.

    Example:
        >>> import numpy as np
        >>> segmenter = make_segmenter("zero-velocity", n_channels=1, rate_hz=100.0)
        >>> t = np.arange(800) / 100.0
        >>> swings = np.sin(2 * np.pi * t / 2.0)[:, None]  # turns each second
        >>> found = [each for frame in swings for each in segmenter.update(frame)]
        >>> len(found) >= 5
        True
    """
    require_segmenter(name)
    return SEGMENTERS[name](n_channels, rate_hz)


def require_segmenter(name: str) -> None:
    """Check that there is a segmenter of a name.

    Raises:
        InvalidValueError: There is none; the message names those that there are.

    Example:
        >>> require_segmenter("zero-velocity")
        >>> require_segmenter("by eye")
        Traceback (most recent call last):
        mplearn.errors.InvalidValueError: segmenter must be one of [...] (...), not 'by eye'
    """
    _load_entry_points()
    if not isinstance(name, str) or name not in SEGMENTERS:
        raise InvalidValueError(
            f"segmenter must be one of {sorted(SEGMENTERS)} (register_segmenter adds one), "
            f"not {name!r}"
        )


@cache
def _load_entry_points() -> None:
    join_installed(ENTRY_POINTS, register_segmenter)

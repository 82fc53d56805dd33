"""How an observation is scaled for a network: numbers of like size."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

PRIOR = "transition_prior"
#: Measurements are multiplied by these; other bounded numbers are divided by their bounds.
SCALES = {"posture": 1.0, "velocity": 0.2, "cog": 10.0, "support_margin": 10.0}
LEAST_PRIOR = 0.01  # of actions that the demonstrator never chose here, so that they are tried too


def scale_of(key: str, part: spaces.Space[Any]) -> NDArray[np.float32]:
    """Return by what the numbers of a part of an observation are multiplied, shape (D,)."""
    size = spaces.flatdim(part)
    if key in SCALES:
        return np.full(size, SCALES[key], np.float32)
    if isinstance(part, spaces.Box):
        bound = np.maximum(np.abs(part.low), np.abs(part.high)).ravel().astype(np.float64)
        return np.where(np.isfinite(bound) & (bound > 0), 1.0 / bound, 1.0).astype(np.float32)
    return np.ones(size, np.float32)

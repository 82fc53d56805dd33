"""What every model of a motion can do, of whatever kind it is."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..recording import FloatArray, IntArray


class MotionModel(Protocol):
    """A model that recognises a motion by its likelihood and generates it.

    `LeftRightHMM`, `SemiMarkovHMM` and `FactorialHMM` are of this kind.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> swing = np.sin(np.linspace(0, np.pi, 40))[:, None]
        >>> model: MotionModel = fit([swing], 4, variance_floor=1e-3)
        >>> model.n_channels, model.mean_motion().shape
        (1, (24, 1))
    """

    @property
    def n_channels(self) -> int:
        """Number of channels D."""
        ...

    def score(
        self, frames: FloatArray, weights: FloatArray | None = None, *, complete: bool = True
    ) -> float:
        """Return log P(O | model) of a sequence, shape (T, D); NaN channels are marginalised."""
        ...

    def mean_motion(self) -> FloatArray:
        """Return the motion that the model expects, shape (T, D)."""
        ...


def held(durations_frames: FloatArray) -> IntArray:
    """Return the state of each frame where state n is held for its duration, at least a frame."""
    n_frames = np.maximum(1, np.rint(durations_frames)).astype(np.int64)
    return np.repeat(np.arange(len(n_frames)), n_frames)

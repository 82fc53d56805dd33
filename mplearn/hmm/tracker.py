"""How far known motions have come, frame by frame: forward variables of many models on-line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import FrameError
from ..maths.compiling import njit
from ..recording import FloatArray
from .kernels import log_add
from .model import LeftRightHMM
from .stack import ModelStack


class MotionTracker:
    """Follows a motion under way with every model that may explain it.

    Args:
        models: M left-right HMMs over the same channels, at the stream's own frame rate.

    Attributes:
        n_frames: Frames since the motion began.
        alpha: log P(o_1..o_t, s_t = n) of each model, shape (M, N), -inf where there is no state.

    Raises:
        ModelError: There is no model, or their channels differ.

    Example:
        >>> from mplearn.hmm import fit
        >>> up = np.linspace(0.0, 1.0, 40)[:, None]
        >>> models = [fit([motion], 4, variance_floor=1e-2) for motion in (up, -up)]
        >>> tracker = MotionTracker(models)
        >>> for frame in up[:20]:
        ...     tracker.update(frame)
        >>> int(tracker.log_likelihoods.argmax()), bool(tracker.endings[0] < 0.1)  # half of it
        (0, True)
    """

    def __init__(self, models: Sequence[LeftRightHMM]) -> None:
        self._stack = ModelStack.of(models)
        self.n_channels = int(self._stack.means.shape[2])
        self.alpha = np.empty(self._stack.log_stay.shape)
        self.restart()

    def restart(self) -> None:
        """Begin another motion."""
        self.n_frames = 0
        self.alpha[:] = -np.inf

    def update(self, frame: FloatArray) -> None:
        """Take the next frame of the motion, shape (D,); NaN where a measurement is missing.

        Raises:
            FrameError: The frame has another width.
        """
        frame = np.ascontiguousarray(frame, dtype=np.float64)
        if frame.shape != (self.n_channels,):
            raise FrameError(f"a frame must have shape ({self.n_channels},), not {frame.shape}")
        _advance(frame, self._stack, self.n_frames == 0, self.alpha)
        self.n_frames += 1

    @property
    def log_likelihoods(self) -> FloatArray:
        """Log P(o_1..o_t) of the motion so far under each model, shape (M,)."""
        return np.asarray(np.logaddexp.reduce(self.alpha, axis=1))

    @property
    def endings(self) -> FloatArray:
        """P(last state | o_1..o_t): how surely each model sees the motion's end, shape (M,)."""
        last = self._stack.n_states - 1
        at_end = self.alpha[np.arange(len(last)), last]
        total = self.log_likelihoods
        known = np.isfinite(total)
        return np.where(known, np.exp(at_end - np.where(known, total, 0.0)), 0.0)


@njit(cache=True)
def _advance(frame: FloatArray, models: ModelStack, first: bool, alpha: FloatArray) -> None:
    log_stay, log_next = models.log_stay, models.log_next
    for m in range(len(models.n_states)):
        for n in range(models.n_states[m] - 1, -1, -1):
            density = 0.0
            for d in range(frame.shape[0]):
                offset = frame[d] - models.means[m, n, d]
                scaled = 0.5 * offset * offset / models.variances[m, n, d]
                term = models.log_norms[m, n, d] - scaled
                density += term if term == term else 0.0
            if first:
                reached = 0.0 if n == 0 else -np.inf
            else:
                reached = alpha[m, n] + log_stay[m, n]
                if n > 0:
                    reached = log_add(reached, alpha[m, n - 1] + log_next[m, n - 1])
            alpha[m, n] = reached + density


def activity(model: LeftRightHMM) -> FloatArray:
    """Return how much each channel takes part in a motion, shape (D,), with a mean of 1.

    The variance of its means over the states, as a share of that of all channels.
    """
    spread = model.means.var(axis=0)
    mean = spread.mean()
    return np.asarray(spread / mean) if mean > 0 else np.ones(model.n_channels)

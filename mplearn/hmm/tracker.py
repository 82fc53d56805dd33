"""How far known motions have come, frame by frame: forward variables of many models on-line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import FrameError
from ..maths.compiling import njit
from ..recording import FloatArray, IntArray
from .kernels import log_add
from .model import LeftRightHMM
from .stack import ModelStack


class MotionTracker:
    """Follows a motion under way with every model that may explain it.

    Args:
        models: M left-right HMMs over the same channels, at the stream's own frame rate; or a stack
            that holds them.
        rows: Which of a stack are followed, shape (M,); all by default.

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

    def __init__(
        self, models: Sequence[LeftRightHMM] | ModelStack, rows: IntArray | None = None
    ) -> None:
        self._stack = models if isinstance(models, ModelStack) else ModelStack.of(models)
        self._rows = np.arange(self._stack.n_models) if rows is None else rows
        self._last = self._stack.n_states[self._rows] - 1
        self.n_channels = int(self._stack.means.shape[2])
        self.alpha = np.empty((len(self._rows), self._stack.log_stay.shape[1]))
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
        whole = bool(np.isfinite(frame).all())
        _advance(frame, self._stack, self._rows, self.n_frames == 0, whole, self.alpha)
        self.n_frames += 1

    @property
    def log_likelihoods(self) -> FloatArray:
        """Log P(o_1..o_t) of the motion so far under each model, shape (M,)."""
        return np.asarray(_log_sums(self.alpha))

    @property
    def endings(self) -> FloatArray:
        """P(last state | o_1..o_t): how surely each model sees the motion's end, shape (M,)."""
        at_end = self.alpha[np.arange(len(self._last)), self._last]
        total = self.log_likelihoods
        known = np.isfinite(total)
        return np.where(known, np.exp(at_end - np.where(known, total, 0.0)), 0.0)


@njit(cache=True)
def _log_sums(alpha: FloatArray) -> FloatArray:
    """Return the logarithm of the sum of what each row holds the logarithms of."""
    out = np.empty(len(alpha))
    for m in range(len(alpha)):
        most = alpha[m].max()
        out[m] = most + np.log(np.exp(alpha[m] - most).sum()) if most > -np.inf else most
    return out


@njit(cache=True)
def _advance(
    frame: FloatArray,
    models: ModelStack,
    rows: IntArray,
    first: bool,
    whole: bool,
    alpha: FloatArray,
) -> None:
    log_stay, log_next = models.log_stay, models.log_next
    for m, row in enumerate(rows):
        for n in range(models.n_states[row] - 1, -1, -1):
            if first:
                reached = 0.0 if n == 0 else -np.inf
            else:
                reached = alpha[m, n] + log_stay[row, n]
                if n > 0:
                    reached = log_add(reached, alpha[m, n - 1] + log_next[row, n - 1])
            mean, scale = models.means[row, n], models.scales[row, n]
            if whole:
                density = models.norms[row, n] + _offset(frame, mean, scale)
            else:
                density = _seen_density(frame, mean, scale, models.log_norms[row, n])
            alpha[m, n] = reached + density


@njit(cache=True)
def _offset(frame: FloatArray, mean: FloatArray, scale: FloatArray) -> float:
    """Return the exponent of the density of a frame, in four sums at once."""
    a = b = c = e = 0.0
    whole = len(frame) - len(frame) % 4
    for d in range(0, whole, 4):
        a += scale[d] * (frame[d] - mean[d]) ** 2
        b += scale[d + 1] * (frame[d + 1] - mean[d + 1]) ** 2
        c += scale[d + 2] * (frame[d + 2] - mean[d + 2]) ** 2
        e += scale[d + 3] * (frame[d + 3] - mean[d + 3]) ** 2
    for d in range(whole, len(frame)):
        a += scale[d] * (frame[d] - mean[d]) ** 2
    return float(a + b + c + e)


@njit(cache=True)
def _seen_density(
    frame: FloatArray, mean: FloatArray, scale: FloatArray, norms: FloatArray
) -> float:
    """Return the log-density of the channels of a frame that are not missing."""
    total = 0.0
    for d in range(len(frame)):
        term = norms[d] + scale[d] * (frame[d] - mean[d]) ** 2
        total += term if term == term else 0.0
    return float(total)


def activity(model: LeftRightHMM) -> FloatArray:
    """Return how much each channel takes part in a motion, shape (D,), with a mean of 1.

    The variance of its means over the states, as a share of that of all channels.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> t = np.linspace(0, np.pi, 40)
        >>> model = fit([np.stack((np.sin(t), 0.01 * t), axis=1)], 4, variance_floor=1e-3)
        >>> activity(model).round(1).tolist()  # the first channel does nearly all of it
        [2.0, 0.0]
    """
    spread = model.means.var(axis=0)
    mean = spread.mean()
    return np.asarray(spread / mean) if mean > 0 else np.ones(model.n_channels)

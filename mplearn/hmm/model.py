"""The left-right hidden Markov model of a motion: a chain of key postures [Kulic2012, 2.2]."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import ModelError
from ..recording import FloatArray, IntArray
from . import kernels
from .motion_model import held
from .sequences import as_frames, as_weights


class GaussianStates:
    """States that emit Gaussians: what models of several kinds share.

    Raises:
        ModelError: Shapes disagree, or a value is not finite or not positive.
    """

    means: FloatArray
    variances: FloatArray

    def __post_init__(self) -> None:
        own_arrays(self, "means", "variances")
        _check_gaussians(self.means, self.variances)

    @property
    def n_states(self) -> int:
        """Number of states N."""
        return int(self.means.shape[0])

    @property
    def n_channels(self) -> int:
        """Number of channels D."""
        return int(self.means.shape[1])

    @cached_property
    def log_norms(self) -> FloatArray:
        """Log of each Gaussian's normalisation, -log(2 pi variance) / 2, shape (N, D)."""
        return np.asarray(kernels.log_norms(self.variances))

    @cached_property
    def gaussians(self) -> kernels.Gaussians:
        """What the states emit."""
        return kernels.Gaussians(self.means, self.variances, self.log_norms)


def own_arrays(model: object, *names: str) -> None:
    """Make arrays of a model its own, unchangeable."""
    for name in names:
        array = np.array(getattr(model, name), dtype=np.float64, order="C")
        array.flags.writeable = False
        object.__setattr__(model, name, array)


def _check_gaussians(means: FloatArray, variances: FloatArray) -> None:
    if means.ndim != 2 or 0 in means.shape:
        raise ModelError(f"means must have shape (N, D), N, D >= 1, not {means.shape}")
    if variances.shape != means.shape:
        raise ModelError(f"means {means.shape} need variances of that shape, not {variances.shape}")
    if not np.isfinite(means).all():
        raise ModelError("means must be finite")
    if not (np.isfinite(variances).all() and (variances > 0).all()):
        raise ModelError(f"variances must be positive, not {variances.min()}")


SHORTEST_STAY = 1.05  # frames: a state is never left for certain, or staying were impossible


@dataclass(frozen=True, eq=False)
class LeftRightHMM(GaussianStates):
    """A left-right HMM with diagonal Gaussian emissions and no skips.

    It starts in state 0; from state n it stays or moves to n + 1. The last state is absorbing. By
    default a sequence must be *complete*, that is end in the last state: otherwise every beginning
    of a motion would match the whole.

    Attributes:
        means: Key posture of each state, shape (N, D), in the units of the channels.
        variances: Shape (N, D), positive.
        log_stay: Log-probability of staying for one more frame, shape (N,); the last is 0.

    Raises:
        ModelError: Shapes disagree, or a value is not finite, not positive or no probability.

    Example:
        >>> model = LeftRightHMM([[0.0], [1.0]], [[0.1], [0.1]], [np.log(0.9), 0.0])
        >>> model.durations_frames.round(3).tolist()
        [10.0]
        >>> model.decode(np.array([[0.1], [0.0], [0.9], [1.1]])).tolist()
        [0, 0, 1, 1]
    """

    means: FloatArray
    variances: FloatArray
    log_stay: FloatArray

    def __post_init__(self) -> None:
        super().__post_init__()
        own_arrays(self, "log_stay")
        shape = self.log_stay.shape
        if shape != self.means.shape[:1]:
            raise ModelError(f"log_stay must have shape ({self.n_states},), not {shape}")
        if self.log_stay[-1] != 0.0 or not (self.log_stay[:-1] < 0).all():
            raise ModelError(
                f"log_stay must be negative in every state and 0 in the last, not {self.log_stay}"
            )

    @cached_property
    def log_next(self) -> FloatArray:
        """Log-probability of moving on, shape (N,); the last state has nowhere to go."""
        return np.append(np.log(-np.expm1(self.log_stay[:-1])), -np.inf)

    @property
    def durations_frames(self) -> FloatArray:
        """Expected frames in each state but the last, 1 / (1 - stay), shape (N - 1,)."""
        return np.exp(-self.log_next[:-1])

    def mean_motion(self) -> FloatArray:
        """Return the means of the states, each held for its expected duration, shape (T, D).

        The last state has no duration of its own: it is held as long as the others on average.

        Example:
            >>> import numpy as np
            >>> from mplearn.hmm import fit
            >>> swing = np.sin(np.linspace(0, np.pi, 40))[:, None]
            >>> model = fit([swing], n_states=4, variance_floor=1e-3)
            >>> motion = model.mean_motion()
            >>> motion.shape[1], bool(0.7 < motion.max() < 1.0)
            (1, True)
        """
        return self.means[self.mean_path()]

    def mean_path(self) -> IntArray:
        """Return the state at each frame of `mean_motion`, shape (T,)."""
        last = self.durations_frames.mean() if self.n_states > 1 else 1.0
        return held(np.append(self.durations_frames, last))

    def score(
        self, frames: FloatArray, weights: FloatArray | None = None, *, complete: bool = True
    ) -> float:
        """Return log P(O | model) of a sequence, shape (T, D).

        Args:
            frames: The sequence; a NaN channel is marginalised.
            weights: How much each frame counts, shape (T,); 1 by default.
            complete: Whether the motion must be over. False sums over all last states.

        Returns:
            The log-likelihood; -inf where a complete motion has fewer frames than states.

        Example:
            >>> import numpy as np
            >>> from mplearn.hmm import fit
            >>> swing = np.sin(np.linspace(0, np.pi, 40))[:, None]
            >>> model = fit([swing], n_states=4, variance_floor=1e-3)
            >>> model.score(swing) > model.score(swing[::-1] - 0.2)
            True
        """
        frames = as_frames(frames, self.n_channels)
        weights = as_weights(weights, len(frames))
        steps = self.log_stay, self.log_next
        return float(kernels.score_frames(frames, weights, self.gaussians, *steps, complete))

    def decode(
        self, frames: FloatArray, weights: FloatArray | None = None, *, complete: bool = True
    ) -> IntArray:
        """Return the most probable state of each frame (Viterbi), shape (T,).

        Raises:
            ModelError: A complete sequence has fewer frames than the model has states.
        """
        densities = self._densities(frames, weights)
        self._check_length(densities, complete)
        path, _ = kernels.viterbi(densities, self.log_stay, self.log_next, complete)
        return np.asarray(path, dtype=np.int64)

    def posteriors(
        self, frames: FloatArray, weights: FloatArray | None = None, *, complete: bool = True
    ) -> FloatArray:
        """Return P(s_t = n | O), shape (T, N), by forward-backward.

        Raises:
            ModelError: A complete sequence has fewer frames than the model has states.

        Example:
            >>> import numpy as np
            >>> from mplearn.hmm import fit
            >>> swing = np.sin(np.linspace(0, np.pi, 40))[:, None]
            >>> model = fit([swing], n_states=4, variance_floor=1e-3)
            >>> model.posteriors(swing).sum(axis=1).round(6).tolist()[:3]
            [1.0, 1.0, 1.0]
        """
        densities = self._densities(frames, weights)
        self._check_length(densities, complete)
        alpha = kernels.forward(densities, self.log_stay, self.log_next)
        beta = kernels.backward(densities, self.log_stay, self.log_next, complete)
        joint = alpha + beta
        shares = np.exp(joint - joint.max(axis=1, keepdims=True))
        return np.asarray(shares / shares.sum(axis=1, keepdims=True))

    def forward(self, frames: FloatArray, weights: FloatArray | None = None) -> FloatArray:
        """Return log P(o_1..o_t, s_t = n), shape (T, N): how far a motion has come by frame t."""
        densities = self._densities(frames, weights)
        return np.asarray(kernels.forward(densities, self.log_stay, self.log_next))

    def _densities(self, frames: FloatArray, weights: FloatArray | None) -> FloatArray:
        frames = as_frames(frames, self.n_channels)
        return np.asarray(
            kernels.log_densities(
                np.ascontiguousarray(frames.T),
                as_weights(weights, len(frames)),
                0,
                len(frames),
                self.gaussians,
            )
        )

    def _check_length(self, densities: FloatArray, complete: bool) -> None:
        if complete and densities.shape[1] < self.n_states:
            raise ModelError(
                f"a complete motion through {self.n_states} states has at least as many frames, "
                f"not {densities.shape[1]}"
            )

"""Left-right models with explicit state durations: hidden semi-Markov models.

In a Markov chain the time spent in a state is geometric: one frame is always the likeliest. Here it
is normal, in whole frames from 1 on, so that a motion's timing counts [Levinson1986; Yu2010].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import InvalidValueError, ModelError
from ...recording import FloatArray
from ..em import Emitted, maximise_gaussians
from ..fit import fit
from ..kernels import log_densities
from ..model import SHORTEST_STAY, GaussianStates, LeftRightHMM, own_arrays
from ..motion_model import held
from ..parameters import as_floor
from ..sequences import SequenceBatch, as_frames, as_weights
from . import kernels as kernels

LEAST_SPREAD = 0.7  # frames: below it a normal distribution over whole frames has other moments


@dataclass(frozen=True, eq=False)
class SemiMarkovHMM(GaussianStates):
    """A left-right model whose states last a normally distributed number of frames.

    Attributes:
        means: Key posture of each state, shape (N, D), in the units of the channels.
        variances: Shape (N, D), positive.
        durations_frames: Mean number of frames in each state, shape (N,), at least 1.
        spreads_frames: Its standard deviation, shape (N,), at least `LEAST_SPREAD`.

    Raises:
        ModelError: Shapes disagree, or a value is out of range.

    Example:
        >>> import numpy as np
        >>> means, variances = np.array([[0.0], [1.0]]), np.full((2, 1), 0.1)
        >>> model = SemiMarkovHMM(means, variances, np.array([5.0, 5.0]), np.array([1.0, 1.0]))
        >>> usual, hurried = [0.0] * 5 + [1.0] * 5, [0.0] + [1.0] * 9
        >>> model.score(np.c_[usual]) > model.score(np.c_[hurried])
        True
    """

    means: FloatArray
    variances: FloatArray
    durations_frames: FloatArray
    spreads_frames: FloatArray

    def __post_init__(self) -> None:
        super().__post_init__()
        own_arrays(self, "durations_frames", "spreads_frames")
        for name, least in (("durations_frames", 1.0), ("spreads_frames", LEAST_SPREAD)):
            array = getattr(self, name)
            if array.shape != self.means.shape[:1] or not (array >= least).all():
                raise ModelError(
                    f"{name} must have shape ({self.n_states},) and be at least {least}, "
                    f"not {array}"
                )

    def log_durations(self, longest: int) -> FloatArray:
        """Return the log-probability of each state lasting d frames, d = 0..longest at least.

        Normal over whole frames from 1 on; the rows sum to one, shape (N, longest + 1 or more).
        """
        means, spreads = self.durations_frames[:, None], self.spreads_frames[:, None]
        whole = np.arange(max(longest, int(np.ceil((means + 10 * spreads).max()))) + 1)
        exponents = -0.5 * ((whole - means) / spreads) ** 2
        exponents[:, 0] = -np.inf
        return np.asarray(exponents - np.logaddexp.reduce(exponents, axis=1, keepdims=True))

    def score(
        self, frames: FloatArray, weights: FloatArray | None = None, *, complete: bool = True
    ) -> float:
        """Return log P(O | model) of a sequence, shape (T, D); see `LeftRightHMM.score`."""
        frames = as_frames(frames, self.n_channels)
        longest = len(frames)
        densities = log_densities(
            np.ascontiguousarray(frames.T),
            as_weights(weights, longest),
            0,
            longest,
            self.gaussians,
        )
        durations = self.log_durations(longest)
        survivals = np.ascontiguousarray(
            np.logaddexp.accumulate(durations[:, ::-1], axis=1)[:, ::-1]
        )
        return float(kernels.log_likelihood(densities, durations, survivals, complete))

    def mean_motion(self) -> FloatArray:
        """Return the means of the states, each held for its mean duration, shape (T, D)."""
        return self.means[held(self.durations_frames)]

    def left_right(self) -> LeftRightHMM:
        """Return the left-right HMM of the same states, which last as long on average.

        Its last state has no duration of its own, see `LeftRightHMM.mean_motion`. It is kept and
        generates as any other model; how much durations vary is not in it.
        """
        stays = np.log1p(-1.0 / np.maximum(self.durations_frames, SHORTEST_STAY))
        stays[-1] = 0.0
        return LeftRightHMM(self.means, self.variances, stays)

    def sample(self, rng: np.random.Generator) -> FloatArray:
        """Draw a motion, shape (T, D)."""
        shares = np.exp(self.log_durations(1))
        lengths = [rng.choice(len(row), p=row / row.sum()) for row in shares]
        states = np.repeat(np.arange(self.n_states), lengths)
        return np.asarray(rng.normal(self.means[states], np.sqrt(self.variances[states])))


def fit_semi_markov(
    sequences: Sequence[FloatArray],
    n_states: int = 8,
    *,
    weights: Sequence[FloatArray] | None = None,
    n_steps: int = 5,
    tolerance: float = 1e-4,
    variance_floor: float | FloatArray = 1e-6,
    duration_spread: float = 0.2,
) -> SemiMarkovHMM:
    """Fit a left-right model with explicit durations to demonstrations of one motion, by EM.

    It starts from the left-right HMM of the same size, and whole motions are expected.

    Args:
        sequences: As in `fit`.
        n_states: As in `fit`.
        weights: As in `fit`.
        n_steps: Largest number of EM steps.
        tolerance: EM ends when a step gains less than this log-likelihood per frame [nat].
        variance_floor: As in `fit`.
        duration_spread: Smallest standard deviation of a duration as a share of its mean: few
            demonstrations say little about how durations vary.

    Raises:
        ModelError: As in `fit`.
        InvalidValueError: ``n_states``, ``n_steps`` or ``duration_spread`` is out of range.

    Example:
        >>> import numpy as np
        >>> swing = [np.sin(np.linspace(0, np.pi, n))[:, None] for n in (40, 44, 48)]
        >>> model = fit_semi_markov(swing, n_states=4, variance_floor=1e-3)
        >>> float(model.durations_frames.sum().round(6))
        44.0
    """
    if not duration_spread >= 0:
        raise InvalidValueError(f"duration_spread must be at least 0, not {duration_spread}")
    chain = fit(sequences, n_states, weights=weights, n_steps=1, variance_floor=variance_floor)
    batch = SequenceBatch.of(sequences, weights)
    floor = as_floor(variance_floor, batch.n_channels)
    longest = int(np.diff(batch.offsets).max())
    durations = np.full(n_states, len(batch.frames) / batch.n_sequences / n_states)
    spreads = np.maximum(LEAST_SPREAD, 0.5 * durations)
    model = SemiMarkovHMM(chain.means, chain.variances, np.maximum(durations, 1.0), spreads)
    before = -np.inf
    for _ in range(n_steps):
        sums, times = np.zeros((3, n_states, batch.n_channels)), np.zeros((2, n_states))
        table = model.log_durations(longest)
        emitted = Emitted(*sums)
        statistics = kernels.Statistics(emitted, *times)
        likelihood = kernels.expectation(batch, model.gaussians, table, statistics)
        if not np.isfinite(likelihood):
            raise ModelError("a sequence became impossible: check its values and the floor")
        means, variances = np.empty((2, n_states, batch.n_channels))
        maximise_gaussians(emitted, floor, means, variances)
        mean = times[0] / batch.n_sequences
        variance = times[1] / batch.n_sequences - mean**2
        least = np.maximum(LEAST_SPREAD, duration_spread * mean)
        spread = np.maximum(np.sqrt(np.maximum(variance, 0.0)), least)
        model = SemiMarkovHMM(means, variances, np.maximum(mean, 1.0), spread)
        if likelihood - before < tolerance * len(batch.frames):
            break
        before = likelihood
    return model

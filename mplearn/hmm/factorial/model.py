"""Factorial HMMs: several left-right chains whose outputs add up.

y_t ~ N(sum_m W^m s_t^m, C): each chain m is in one state, and its mean is one term of what is seen
[GhahramaniJordan1997]. Chains with few states each stand for many combinations.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import ModelError
from ...recording import FloatArray, IntArray
from ..model import SHORTEST_STAY, LeftRightHMM
from ..sequences import as_frames, as_weights
from .posterior import Moments, exact_moments, variational_moments
from .product_chain import ProductChain

MOST_COMBINATIONS = 1024  # up to here the E-step is exact


@dataclass(frozen=True, eq=False)
class FactorialHMM:
    """Left-right chains whose means add up to what is seen, with one variance for each channel.

    Attributes:
        means: Output of each chain's states, (N_m, D) each, M of them, in the channels' units.
        log_stays: Log-probability of each chain's states of staying, (N_m,) each; the last is 0.
        variances: Of the sum, shape (D,), positive.

    Raises:
        ModelError: Shapes disagree, or a value is out of range.

    Example:
        >>> import numpy as np
        >>> stays = np.log([0.5, 1.0])  # of each state; the last one stays
        >>> slow, quick = np.array([[0.0], [1.0]]), np.array([[0.0], [0.5]])
        >>> model = FactorialHMM((slow, quick), (stays, stays), np.array([0.1]))
        >>> likely, unlikely = np.array([[0.0], [1.5]]), np.array([[1.5], [0.0]])
        >>> model.score(likely) > model.score(unlikely)
        True
    """

    means: tuple[FloatArray, ...]
    log_stays: tuple[FloatArray, ...]
    variances: FloatArray

    def __post_init__(self) -> None:
        if not self.means or len(self.means) != len(self.log_stays):
            raise ModelError(
                f"{len(self.means)} chains need as many log_stays, not {len(self.log_stays)}"
            )
        variances = np.array(self.variances, dtype=np.float64)
        if variances.ndim != 1:
            raise ModelError(f"variances must have shape (D,), not {variances.shape}")
        chains = [  # the checks of a chain are those of a left-right HMM
            LeftRightHMM(np.asarray(means), np.tile(variances, (len(means), 1)), log_stay)
            for means, log_stay in zip(self.means, self.log_stays, strict=True)
        ]
        variances.flags.writeable = False
        object.__setattr__(self, "variances", variances)
        object.__setattr__(self, "means", tuple(chain.means for chain in chains))
        object.__setattr__(self, "log_stays", tuple(chain.log_stay for chain in chains))
        object.__setattr__(self, "_chains", tuple(chains))

    @property
    def chains(self) -> tuple[LeftRightHMM, ...]:
        """The chains, each as a model of its own, length M."""
        chains: tuple[LeftRightHMM, ...] = self.__dict__["_chains"]
        return chains

    @property
    def n_channels(self) -> int:
        """Number of channels D."""
        return len(self.variances)

    @property
    def n_combinations(self) -> int:
        """Number of combinations of states, K."""
        return int(np.prod([chain.n_states for chain in self.chains]))

    @cached_property
    def product(self) -> ProductChain:
        """The chains as one over all combinations."""
        return ProductChain.of([(chain.log_stay, chain.log_next) for chain in self.chains])

    def moments(
        self,
        frames: FloatArray,
        weights: FloatArray | None = None,
        *,
        complete: bool = True,
        exact: bool | None = None,
    ) -> Moments:
        """Return what is expected of the states, given a sequence: the E-step.

        Args:
            frames: Shape (T, D), NaN where a measurement is missing.
            weights: How much each frame counts, shape (T,); 1 by default.
            complete: Whether all chains must end in their last state.
            exact: Over all combinations, or by the structured variational approximation; by
                default exact for up to `MOST_COMBINATIONS`.

        Raises:
            ModelError: A complete sequence has fewer frames than the longest chain has states.
        """
        frames = as_frames(frames, self.n_channels)
        longest = max(chain.n_states for chain in self.chains)
        if complete and len(frames) < longest:
            raise ModelError(
                f"a complete motion through {longest} states has at least as many frames, "
                f"not {len(frames)}"
            )
        if exact is None:
            exact = self.n_combinations <= MOST_COMBINATIONS
        weights = as_weights(weights, len(frames))
        if exact:
            return exact_moments(self.chains, self.product, frames, weights, complete)
        return variational_moments(self.chains, frames, weights, complete)

    def score(
        self, frames: FloatArray, weights: FloatArray | None = None, *, complete: bool = True
    ) -> float:
        """Return log P(O | model), shape (T, D); a lower bound beyond `MOST_COMBINATIONS`.

        See `LeftRightHMM.score`.
        """
        if complete and len(frames) < max(chain.n_states for chain in self.chains):
            as_frames(frames, self.n_channels)
            return float("-inf")
        return self.moments(frames, weights, complete=complete).log_likelihood

    def explained(self, frames: FloatArray, weights: FloatArray | None = None) -> FloatArray:
        """Return what the chains together expect at each frame of a whole sequence, (T, D)."""
        return self.moments(frames, weights).marginals @ np.concatenate(self.means)

    def mean_motion(self) -> FloatArray:
        """Return the sum of the chains' means, each state held for its duration, shape (T, D).

        A chain that is through stays in its last state until the longest one is.
        """
        path = self._mean_path()
        parts = [means[path[m]] for m, means in enumerate(self.means)]
        return np.asarray(np.sum(parts, axis=0))

    def left_right(self) -> LeftRightHMM:
        """Return one chain through the combinations of states that the mean motion visits.

        It generates and is kept as any other model, with the same mean motion but for rounding.
        """
        path = self._mean_path()
        starts = np.flatnonzero(np.append(True, (np.diff(path, axis=1) != 0).any(axis=0)))
        means = np.sum([own[path[m, starts]] for m, own in enumerate(self.means)], axis=0)
        durations = np.diff(starts) + 0.0
        stays = np.log1p(-1.0 / np.maximum(durations, SHORTEST_STAY))
        return LeftRightHMM(means, np.tile(self.variances, (len(means), 1)), np.append(stays, 0.0))

    def _mean_path(self) -> IntArray:
        """Return each chain's state at each frame of the mean motion, shape (M, T)."""
        paths = [chain.mean_path() for chain in self.chains]
        longest = max(len(path) for path in paths)
        return np.stack([np.pad(path, (0, longest - len(path)), mode="edge") for path in paths])

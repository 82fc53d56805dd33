"""The paper's random walk: the next primitive is drawn as often as the demonstrator chose it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gymnasium.spaces import Discrete

from .base import Policy, transition_prior


class RandomWalk(Policy):
    """Draws from the transition prior ([Kulic2012] section 3).

    The same as ``env.action_space.sample(probability=info["transition_prior"])``, with a
    generator of its own, so that a walk is reproducible whatever else samples from the space.

    Args:
        seed: Seed of the walk; None draws one.

    Example:
        >>> import numpy as np
        >>> legal, prior = np.array([1, 1, 0]), np.array([0.0, 1.0, 0.0])
        >>> RandomWalk(seed=0).act(None, {"action_mask": legal, "transition_prior": prior})
        1
    """

    def __init__(self, seed: int | None = None) -> None:
        self.seed = seed
        self._space: Discrete | None = None

    def reset(self, seed: int | None = None) -> None:
        """Start a new walk; without a seed, the generator goes on."""
        if seed is not None:
            self.seed, self._space = seed, None

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return an action drawn from the prior."""
        prior = transition_prior(info)
        if self._space is None or self._space.n != prior.size:
            self._space = Discrete(prior.size, seed=self.seed)
        # gymnasium annotates int8, as for a mask, but asks for float64 when it runs
        return int(self._space.sample(probability=prior))  # type: ignore[arg-type]

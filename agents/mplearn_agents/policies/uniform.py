"""Any legal primitive, each as likely as the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .base import Policy, legal_actions


class UniformLegal(Policy):
    """Draws evenly among what the mask allows, whatever the demonstrator preferred.

    Args:
        seed: Seed of the walk; None draws one.

    Example:
        >>> import numpy as np
        >>> legal = np.array([0, 0, 1])
        >>> UniformLegal(seed=0).act(None, {"action_mask": legal, "transition_prior": legal / 1.0})
        2
    """

    def __init__(self, seed: int | None = None) -> None:
        self.seed = seed
        self._rng = np.random.default_rng(seed)

    def reset(self, seed: int | None = None) -> None:
        """Start a new walk; without a seed, the generator goes on."""
        if seed is not None:
            self.seed, self._rng = seed, np.random.default_rng(seed)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return one of the legal actions."""
        return int(self._rng.choice(np.flatnonzero(legal_actions(info))))

"""Discounting for learners that know one discount a step, whatever a step's length."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium
import numpy as np

from .random_streams import RandomStreams


class EndInsteadOfDiscount(
    gymnasium.Wrapper[Any, Any, Any, Any], gymnasium.utils.RecordConstructorArgs
):
    """Ends episodes at random, so that a learner that does not discount learns the right thing.

    Macro steps last from half a second to several. A learner with one discount a step, which most
    have, takes a second of holding for as far in the future as ten seconds of wandering: holding
    then beats wandering. What is right is ``info["discount"]``, discount^T. Here an episode
    terminates after each macro step with probability 1 - discount^T instead: the sum of what is
    earned until then is, in expectation, the discounted return. So give the learner a discount of
    1 (``gamma=1``); our own training needs no wrapper.

    ``info["ended"]`` tells such an end from the task's own; returns of single episodes are noisy,
    so evaluate without the wrapper.

    Args:
        env: An environment whose ``info`` has ``discount``.
    """

    ends_instead_of_discount = True

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(self)
        gymnasium.Wrapper.__init__(self, env)
        self._rng: np.random.Generator | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode."""
        if seed is not None or self._rng is None:
            apart = (len(RandomStreams._fields),)  # from the environment's own streams
            self._rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=apart))
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, info | {"ended": False}

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Perform a macro step, after which the episode may end."""
        if self._rng is None:
            raise gymnasium.error.ResetNeeded("the episode has not begun: call reset first")
        observation, reward, terminated, truncated, info = self.env.step(action)
        ended = bool(self._rng.random() >= info["discount"])
        return observation, reward, terminated or ended, truncated, info | {"ended": ended}

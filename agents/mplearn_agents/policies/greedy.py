"""Always what the demonstrator did most often next."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .base import Policy, transition_prior


class Greedy(Policy):
    """Takes the most probable next primitive; of equals, the one with the smallest action.

    Example:
        >>> import numpy as np
        >>> legal, prior = np.array([1, 1, 1]), np.array([0.2, 0.5, 0.3])
        >>> Greedy().act(None, {"action_mask": legal, "transition_prior": prior})
        1
    """

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the mode of the prior."""
        return int(np.argmax(transition_prior(info)))

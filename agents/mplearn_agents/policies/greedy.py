"""Always what the demonstrator did most often next."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .base import Policy, transition_prior


class Greedy(Policy):
    """Takes the most probable next primitive; of equals, the one with the smallest action."""

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the mode of the prior."""
        return int(np.argmax(transition_prior(info)))

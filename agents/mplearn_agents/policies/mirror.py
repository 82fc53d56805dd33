"""Does what the demonstrator is recognised doing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn_envs.skills.action_choices import HOLD

from .base import Policy, legal_actions


class Mirror(Policy):
    """For the task ``follow``: performs the motion recognised last, and holds where it may not.

    It guesses nothing: so it comes late to every motion, and is never led elsewhere.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task="follow", dynamics="kinematic")
        >>> observation, info = env.reset(seed=1)
        >>> bool(info["action_mask"][Mirror().act(observation, info)])
        True
    """

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the motion that is under way, if it is legal and not over; else hold.

        Raises:
            InvalidValueError: The observation is not that of the task ``follow``.
        """
        mask = legal_actions(info)
        seen = observation["task"]
        capacity = (len(seen) - 2) // 3  # the mask has a block of so many for each speed
        if len(seen) != 3 * capacity + 2 or capacity < 2 or mask.size % capacity:
            raise InvalidValueError(
                "this policy needs the task 'follow', which shows 3 C + 2 numbers for C slots, "
                f"not {len(seen)} for {mask.size} actions"
            )
        recognised = seen[:capacity]
        slot = int(np.argmax(recognised))
        under_way = recognised[slot] > 0 and seen[-2] < 1.0
        return slot if under_way and mask[slot] else HOLD

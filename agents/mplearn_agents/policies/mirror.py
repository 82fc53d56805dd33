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
    """

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the motion that is under way, if it is legal and not over; else hold.

        Raises:
            InvalidValueError: The observation is not that of the task ``follow``.
        """
        mask = legal_actions(info)
        seen = observation["task"]
        if len(seen) != 3 * mask.size + 2:
            raise InvalidValueError(
                f"this policy needs the task 'follow', which shows {3 * mask.size + 2} numbers, "
                f"not {len(seen)}"
            )
        recognised = seen[: mask.size]
        slot = int(np.argmax(recognised))
        under_way = recognised[slot] > 0 and seen[-2] < 1.0
        return slot if under_way and mask[slot] else HOLD

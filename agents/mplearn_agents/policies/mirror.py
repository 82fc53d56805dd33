"""Does what the demonstrator most likely does meanwhile."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mplearn.errors import InvalidValueError

from .base import Policy, legal_actions


class Mirror(Policy):
    """For the task ``follow``: weighs what is predicted for now and for next by the time left.

    The demonstrator is tau typical durations into his motion; a primitive begun now agrees with it
    for the rest, and then with the next: P(now) max(1 - tau, 0) + P(next) min(tau, 1).
    """

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the legal action that agrees longest, as far as can be said.

        Raises:
            InvalidValueError: The observation is not that of the task ``follow``.
        """
        mask = legal_actions(info)
        seen = observation["task"]
        if len(seen) != 3 * mask.size + 1:
            raise InvalidValueError(
                f"this policy needs the task 'follow', which shows {3 * mask.size + 1} numbers, "
                f"not {len(seen)}"
            )
        _, now, then = np.split(seen[:-1], 3)
        tau = min(float(seen[-1]), 1.0)
        return int(np.argmax(np.where(mask, now * (1.0 - tau) + then * tau, -1.0)))

"""Makes every action legal, for algorithms that know no mask."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from numpy.typing import ArrayLike


def project(action: int, mask: ArrayLike) -> int:
    """Return a legal action for any action: itself if it is legal.

    The n legal actions share the illegal ones evenly: the k-th illegal action stands for number
    k mod n of them, so that exploring at random among all explores the legal ones evenly, too.

    Args:
        action: Any action.
        mask: Nonzero where an action is legal, shape (A,); at least one is.
    """
    allowed = np.asarray(mask, dtype=bool)
    if allowed[action]:
        return action
    legal = np.flatnonzero(allowed)
    return int(legal[np.count_nonzero(~allowed[:action]) % len(legal)])


class ProjectIllegal(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Replaces illegal actions by legal ones, see `project`; the mask is ``action_masks()``.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = ProjectIllegal(gym.make("mplearn/PrimitiveHumanoid-v0", dynamics="kinematic"))
        >>> observation, info = env.reset(seed=1)
        >>> forbidden = int((info["action_mask"] == 0).nonzero()[0][0])
        >>> observation, reward, terminated, truncated, info = env.step(forbidden)
        >>> info["illegal"], info["action"] != forbidden
        (False, True)
    """

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Perform a legal action; ``info["action"]`` says which."""
        legal = project(int(action), self.env.get_wrapper_attr("action_masks")())
        observation, reward, terminated, truncated, info = self.env.step(legal)
        return observation, reward, terminated, truncated, info | {"action": legal}

"""What every policy is: it looks at an observation and an info, and names the next primitive."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import BoolArray, FloatArray


class Policy(ABC):
    """Chooses one action of an environment over a primitive graph.

    The environment's ``info`` says what is legal (``"action_mask"``, shape (A,)) and how the
    demonstrator went on from here (``"transition_prior"``, shape (A,), which sums to 1 and is 0
    where the mask is 0).

    Example:
        >>> class Shy(Policy):
        ...     def act(self, observation, info):
        ...         return 0
        >>> Shy().act(None, {"action_mask": np.array([1, 1])})
        0
    """

    def reset(self, seed: int | None = None) -> None:  # noqa: B027  (a policy may have no memory)
        """Forget what happened; with a seed, whatever follows is reproducible."""

    @abstractmethod
    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the action to take, one that ``info["action_mask"]`` allows."""


def legal_actions(info: Mapping[str, Any]) -> BoolArray:
    """Return which actions are allowed, shape (A,).

    Raises:
        InvalidValueError: ``info`` has no ``"action_mask"``, or the mask allows nothing.

    Example:
        >>> legal_actions({"action_mask": np.array([1, 0, 1], dtype=np.int8)})
        array([ True, False,  True])
    """
    mask = np.asarray(_entry(info, "action_mask"), dtype=bool)
    if mask.ndim != 1 or not mask.any():
        raise InvalidValueError(f"action_mask must be a vector that allows an action, not {mask}")
    return mask


def transition_prior(info: Mapping[str, Any]) -> FloatArray:
    """Return the probability of each next action, shape (A,), 0 where it is not allowed.

    Raises:
        InvalidValueError: ``info`` has no ``"transition_prior"``, or it is no distribution over
            the allowed actions.

    Example:
        >>> prior = np.array([0.25, 0.0, 0.75])
        >>> transition_prior({"action_mask": np.array([1, 0, 1]), "transition_prior": prior})
        array([0.25, 0.  , 0.75])
    """
    prior = np.asarray(_entry(info, "transition_prior"), dtype=np.float64)
    mask = legal_actions(info)
    if prior.shape != mask.shape or (prior < 0).any() or not np.isclose(prior.sum(), 1.0):
        raise InvalidValueError(
            f"transition_prior must hold {mask.size} probabilities that sum to 1, not {prior}"
        )
    if (prior[~mask] > 0).any():
        raise InvalidValueError(
            f"transition_prior gives weight to masked actions {np.flatnonzero(prior * ~mask)}"
        )
    return prior


def _entry(info: Mapping[str, Any], key: str) -> Any:
    if key not in info:
        raise InvalidValueError(
            f"a policy needs info[{key!r}] from its environment; info has {sorted(info)}"
        )
    return info[key]

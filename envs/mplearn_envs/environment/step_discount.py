"""A warning for learners that discount by steps where steps have lengths."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from types import FrameType
from typing import Any

_NAMES = ("self", "args", "config")  # what a learner's own frames call it, or its settings
_PARTS = ("", "policy", "algorithm", "agents", "agent", "config", "cfg")
_DISCOUNTS = ("gamma", "_gamma", "discount_factor")
_MEMORIES = ("rollout_buffer", "replay_buffer")


class StepDiscountWarning(UserWarning):
    """A learner discounts each macro step alike, whatever its length."""


def warn_of_step_discount(discount: float) -> None:
    """Warn if a learner that is stepping an environment just now discounts by steps.

    Whoever called `step` is looked for among the callers: an object with a discount below 1, as
    Stable-Baselines3, Tianshou, skrl and scripts like CleanRL's have it. A memory that keeps
    ``discounts`` of its own, and `EndInsteadOfDiscount`, do it right. Learners in other processes
    are not seen.

    Args:
        discount: Of the environment, per second.
    """
    for each in _callers(sys._getframe(2)):
        if getattr(each, "ends_instead_of_discount", False):
            return
        if any(hasattr(getattr(each, memory, None), "discounts") for memory in _MEMORIES):
            return
        gamma = _step_discount(each)
        if gamma is not None:
            warnings.warn(
                f"{type(each).__name__} discounts by {gamma} a step, and the steps are macro steps "
                f"of unequal length: a short hold then seems better than it is. What is right is "
                f"info['discount'], {discount:g}^duration: wrap the environment in "
                f"mplearn_envs.environment.ending.EndInsteadOfDiscount and learn with a discount "
                f"of 1, or train with mplearn_agents.rl",
                StepDiscountWarning,
                stacklevel=3,
            )
            return


def _callers(frame: FrameType | None) -> Iterator[Any]:
    """Return the objects that may be learners, the nearest caller's first."""
    while frame is not None:
        for name in _NAMES:
            found = frame.f_locals.get(name)
            if found is not None:
                yield found
        frame = frame.f_back


def _step_discount(learner: Any) -> float | None:
    """Return a learner's discount, if it has one below 1; what is stepped itself is no learner."""
    if hasattr(learner, "step") and hasattr(learner, "reset"):
        return None
    for part in _PARTS:
        owner = getattr(learner, part, None) if part else learner
        for name in _DISCOUNTS:
            value = owner.get(name) if isinstance(owner, dict) else getattr(owner, name, None)
            if isinstance(value, float) and 0.0 < value < 1.0:
                return value
    return None

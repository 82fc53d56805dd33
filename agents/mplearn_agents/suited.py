"""What suits each task: which policies can do it, and how agents are trained for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

#: What the transition prior is to the policy: nothing but a feature (untrained, it waits as often
#: as not, and else draws evenly); its initial logits; or what it is drawn to by a penalty on the
#: divergence from it (instead of the entropy bonus).
PriorUse: TypeAlias = Literal["feature", "logits", "regulariser"]

_PATHS = ("likely-path", "short-path", "quick-path", "pooled-path", "experienced")


@dataclass(frozen=True)
class Suited:
    """What suits a task; the defaults are for one's own.

    Attributes:
        policies: Names of the policies that need it, or one of a few tasks with it.
        foresees: Names of the policies that would know there what nobody may know.
        prior: What the transition prior is to an agent: a feature where it must learn to wait,
            which has prior 0; initial logits else.
        steps: Macro steps of a training: more where more must be found out.
    """

    policies: tuple[str, ...] = ()
    foresees: tuple[str, ...] = ()
    prior: PriorUse = "logits"
    steps: int = 40_000


SUITED = {
    "goal": Suited(_PATHS),
    "follow": Suited(
        ("mirror", "hindsight", "experienced", "oracle"), ("search",), "feature", 80_000
    ),
    "recite": Suited(_PATHS),
    "free": Suited(),
}

#: The policies that need a certain task, and which; the others act in any.
NEEDS_TASK: dict[str, tuple[str, ...]] = {
    policy: tuple(task for task, suited in SUITED.items() if policy in suited.policies)
    for of_task in SUITED.values()
    for policy in of_task.policies
}

#: The policies that must know beforehand what is in which slot, or try it on a twin.
_NOT_ONLINE = ("search", "experienced", "pooled-path")


def plays(policy: str, task: str, env: str) -> bool:
    """Return whether a policy can do a task in a version of the environment, knowing what it may.

    Example:
        >>> plays("oracle", "goal", "online"), plays("oracle", "goal", "v1")
        (True, False)
    """
    if env == "online" and policy == "oracle":
        return True
    if env == "online" and policy in _NOT_ONLINE:
        return False
    return task in NEEDS_TASK.get(policy, (task,)) and policy not in suited(task).foresees


def suited(task: str) -> Suited:
    """Return what suits a task, by its name."""
    return SUITED.get(task, Suited())

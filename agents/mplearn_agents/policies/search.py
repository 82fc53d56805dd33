"""Looks ahead: tries sequences of primitives on a kinematic twin of the environment."""

from __future__ import annotations

import heapq
from collections.abc import Mapping
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError

from .base import Policy, legal_actions, transition_prior


class _Node(NamedTuple):
    """A sequence that was tried.

    Attributes:
        value: Its discounted return, up to the horizon.
        surprise: -log of its probability by the prior [nat]; of equals, the more likely wins.
        first: Its first action.
        discount: Discount of whatever follows.
        time_s: How long it takes [s].
        state: The twin's state at its end; None if nothing follows.
        info: The twin's info there.
    """

    value: float
    surprise: float
    first: int
    discount: float
    time_s: float
    state: Any
    info: Mapping[str, Any]


class Search(Policy):
    """Takes the first action of the best sequence it finds, and then looks again.

    A beam search over sequences that last ``horizon_s``; of those with equally many actions, the
    ``beam`` with the best return per time are continued. What a last action earns counts as far as
    it lies within the horizon. The twin starts from the environment's very state, so whatever the
    task has hidden from the agent there (what the demonstrator of ``follow`` is about to do) is
    foreseen.

    Args:
        env: The environment in which it acts.
        twin: One with the same library, robot and task, in which actions may be tried; kinematic,
            it makes thousands of steps a second.
        horizon_s: How far to look ahead [s].
        beam: How many sequences of each length to go on with.

    Raises:
        InvalidValueError: ``horizon_s`` is not positive, or ``beam`` less than 1.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task="recite", dynamics="kinematic")
        >>> policy = Search.for_env(env, horizon_s=3.0, beam=2)
        >>> observation, info = env.reset(seed=1)
        >>> bool(info["action_mask"][policy.act(observation, info)])
        True
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        twin: gymnasium.Env[Any, Any],
        horizon_s: float = 12.0,
        beam: int = 20,
    ) -> None:
        if not horizon_s > 0 or beam < 1:
            raise InvalidValueError(
                f"horizon_s must be positive and beam at least 1, not {horizon_s} and {beam}"
            )
        self.env, self.twin, self.horizon_s, self.beam = env, twin, horizon_s, beam

    @classmethod
    def for_env(
        cls, env: gymnasium.Env[Any, Any], horizon_s: float = 12.0, beam: int = 20
    ) -> Search:
        """Return the policy for an environment that `gymnasium.make` made.

        Raises:
            InvalidValueError: The environment was made otherwise.
        """
        if env.spec is None:
            raise InvalidValueError("a twin needs env.spec, which gymnasium.make supplies")
        options = {**env.spec.kwargs, "dynamics": "kinematic", "render_mode": None}
        options["body"] = "nominal"  # else it would foresee who falls when
        twin = gymnasium.make(env.spec.id, **options, disable_env_checker=True)
        return cls(env, twin, horizon_s, beam)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the first action of the best sequence; of equals, of the most likely one."""
        here = self.env.unwrapped.state()  # type: ignore[attr-defined]
        going = [_Node(0.0, 0.0, -1, 1.0, 0.0, here, info)]
        ended: list[_Node] = []
        while going:
            tried = [node for parent in going for node in self._continued(parent)]
            ended += [node for node in tried if node.state is None]
            going = [node for node in tried if node.state is not None]
            going = heapq.nsmallest(self.beam, going, key=_per_time)
        return min(ended, key=lambda node: (-node.value, node.surprise)).first

    def _continued(self, parent: _Node) -> list[_Node]:
        prior = transition_prior(parent.info)
        twin: Any = self.twin.unwrapped
        out = []
        for action in np.flatnonzero(legal_actions(parent.info)).tolist():
            twin.load_state(parent.state)
            _, reward, terminated, truncated, info = twin.step(action)
            end_s = parent.time_s + info["duration_s"]
            within = min(1.0, (self.horizon_s - parent.time_s) / info["duration_s"])
            over = terminated or truncated or end_s >= self.horizon_s
            out.append(
                _Node(
                    parent.value + parent.discount * within * float(reward),
                    parent.surprise - float(np.log(max(prior[action], 1e-6))),
                    action if parent.first < 0 else parent.first,
                    parent.discount * info["discount"],
                    end_s,
                    None if over else twin.state(),
                    info,
                )
            )
        return out


def _per_time(node: _Node) -> tuple[float, float]:
    return -node.value / node.time_s, node.surprise

"""Goes on as the demonstrator did after the same few primitives, not after the last one alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import gymnasium
import numpy as np

from mplearn.recording import FloatArray

from .base import Policy, legal_actions, transition_prior


class Forecast(Protocol):
    """What is known of the order of primitives; `mplearn.graph.TransitionGraph` is one."""

    @property
    def ids(self) -> tuple[int, ...]:
        """The primitives."""

    def probabilities(self, history: Any = ()) -> FloatArray:
        """Return how likely each primitive is after a history, shape (n,), as ``ids``."""


class Imitation(Policy):
    """Draws from the demonstrator's statistics of higher order ([Kulic2012] section 3).

    The prior in ``info`` knows the last primitive only; here the history counts as far back as the
    graph's order. Actions that the mask forbids are left out; where the forecast allows nothing
    that is legal (at the start, after a dead end) it draws from the prior.

    Args:
        forecast: Probabilities of the next primitive.
        slots: Action of each primitive.
        seed: Seed of the walk; None draws one.
        renew: Returns forecast and slots of now, where the library may change.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", dynamics="kinematic")
        >>> policy = Imitation.for_env(env)
        >>> policy.reset(seed=1)
        >>> observation, info = env.reset(seed=1)
        >>> bool(info["action_mask"][policy.act(observation, info)])
        True
    """

    def __init__(
        self,
        forecast: Forecast,
        slots: Mapping[int, int],
        seed: int | None = None,
        renew: Callable[[], tuple[Forecast, Mapping[int, int]]] | None = None,
    ) -> None:
        self._learn(forecast, slots)
        self._renew, self._version = renew, ""
        self.seed = seed
        self._rng = np.random.default_rng(seed)
        self._history: list[int] = []

    @classmethod
    def for_env(cls, env: gymnasium.Env[Any, Any]) -> Imitation:
        """Return the policy that imitates whoever an environment's library was learned from."""
        actor: Any = env.unwrapped

        def now() -> tuple[Forecast, Mapping[int, int]]:
            return actor.library.graph, actor.repertoire.slots

        return cls(*now(), None, now)

    def reset(self, seed: int | None = None) -> None:
        """Forget the history; with a seed, start anew."""
        self._history = []
        if seed is not None:
            self.seed, self._rng = seed, np.random.default_rng(seed)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return an action drawn from the forecast."""
        if info["primitive"] < 0:  # at the start, and after a dead end
            self._history = []
        version = info.get("library_version", "")
        if self._renew is not None and version != self._version:
            self._learn(*self._renew())
            self._version = version
        weights = np.zeros(legal_actions(info).size)
        if self._history:
            known = set(self.forecast.ids)
            history = [id if id in known else None for id in self._history]
            weights[self._actions] = self.forecast.probabilities(history)[self._known]
            weights *= legal_actions(info)
        if not weights.any():
            weights = transition_prior(info)
        action = int(self._rng.choice(weights.size, p=weights / weights.sum()))
        if action in self._primitives:
            self._history.append(self._primitives[action])
        return action

    def _learn(self, forecast: Forecast, slots: Mapping[int, int]) -> None:
        """Take what is known by now, and where."""
        self.forecast, self.slots = forecast, dict(slots)
        self._primitives = {slot: id for id, slot in slots.items()}
        self._known = [k for k, id in enumerate(forecast.ids) if id in slots]
        self._actions = [slots[forecast.ids[k]] for k in self._known]

"""Macro steps have durations: each is discounted by its own ``info["discount"]`` [Sutton1999].

The reward of a macro step is discounted inside by the environment; what follows it counts by
discount^duration instead of a constant gamma, in the advantages of PPO and in DQN's targets. So
lambda counts per second, too, see `advantages`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib import MaskablePPO
from sb3_contrib.common.maskable.buffers import MaskableDictRolloutBuffer
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import DictReplayBuffer, DictRolloutBuffer
from stable_baselines3.common.type_aliases import DictReplayBufferSamples

from mplearn.errors import InvalidValueError

from .returns import advantages


def of_steps(infos: Sequence[dict[str, Any]], key: str) -> NDArray[np.float32]:
    """Return "discount" or "duration_s" of each environment's macro step, shape (N,).

    Raises:
        InvalidValueError: An info has none.
    """
    for info in infos:
        if key not in info:
            raise InvalidValueError(
                f"macro steps need info['discount'], discount^duration, and info['duration_s']; "
                f"info has {sorted(info)}"
            )
    return np.array([info[key] for info in infos], np.float32)


class _MacroSteps:
    """A rollout buffer with each step's duration, and the value of what truncation cut off."""

    def reset(self: Any) -> None:
        shape = (self.buffer_size, self.n_envs)
        self.discounts = np.ones(shape, np.float32)
        self.durations_s = np.zeros(shape, np.float32)
        self.cut_off = np.zeros(shape, np.float32)
        super().reset()  # type: ignore[misc]

    def note(self: Any, infos: Sequence[dict[str, Any]], cut_off: NDArray[np.float32]) -> None:
        """Keep what belongs to the step that will be added next."""
        self.discounts[self.pos] = of_steps(infos, "discount")
        self.durations_s[self.pos] = of_steps(infos, "duration_s")
        self.cut_off[self.pos] = cut_off

    def compute_returns_and_advantage(self: Any, last_values: torch.Tensor, dones: Any) -> None:
        """Fill ``advantages`` and ``returns``, see `advantages`."""
        values = np.vstack((self.values, last_values.cpu().numpy().reshape(1, -1)))
        ends = np.vstack((self.episode_starts[1:], np.reshape(dones, (1, -1)))) > 0
        rewards = self.rewards + self.discounts * self.cut_off
        traces = self.gae_lambda**self.durations_s
        self.advantages = advantages(rewards, values, ends, self.discounts, traces)
        self.returns = self.advantages + self.values


class MaskedMacroStepBuffer(_MacroSteps, MaskableDictRolloutBuffer):
    """Rollouts for `MacroMaskablePPO`."""


class MacroStepBuffer(_MacroSteps, DictRolloutBuffer):
    """Rollouts for `MacroPPO`."""


class _MacroStepAlgorithm:
    """An on-policy algorithm that tells its buffer each step's duration."""

    def _update_info_buffer(self: Any, infos: Any, dones: Any = None) -> None:
        super()._update_info_buffer(infos, dones)  # type: ignore[misc]
        cut_off = np.zeros(len(infos), np.float32)
        for k, info in enumerate(infos):
            if dones[k] and info.get("TimeLimit.truncated", False):
                info["TimeLimit.truncated"] = False  # else it is added once more, with gamma
                last = self.policy.obs_to_tensor(info["terminal_observation"])[0]
                with torch.no_grad():
                    cut_off[k] = self.policy.predict_values(last).item()
        self.rollout_buffer.note(infos, cut_off)


class MacroMaskablePPO(_MacroStepAlgorithm, MaskablePPO):
    """MaskablePPO for macro steps; give it ``rollout_buffer_class=MaskedMacroStepBuffer``."""


class MacroPPO(_MacroStepAlgorithm, PPO):
    """PPO for macro steps; give it ``rollout_buffer_class=MacroStepBuffer``."""


class MacroReplayBuffer(DictReplayBuffer):
    """Replays macro steps with their discounts, for DQN on one environment."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        if self.n_envs != 1:
            raise InvalidValueError(f"macro steps are replayed of 1 environment, not {self.n_envs}")
        self.discounts = np.ones(self.buffer_size, np.float32)

    def add(self, obs: Any, next_obs: Any, action: Any, reward: Any, done: Any, infos: Any) -> None:
        """Add a macro step."""
        self.discounts[self.pos] = of_steps(infos, "discount")[0]
        super().add(obs, next_obs, action, reward, done, infos)

    def _get_samples(  # type: ignore[override]
        self, batch_inds: Any, env: Any = None
    ) -> DictReplayBufferSamples:
        samples = super()._get_samples(batch_inds, env)
        return samples._replace(discounts=self.to_torch(self.discounts[batch_inds]).reshape(-1, 1))

"""What the agent sees: the observation space and how it is filled."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces

from mplearn.recording import FloatArray
from mplearn_envs.execution.sensors import Measured
from mplearn_envs.skills.action_choices import Choices

Observation: TypeAlias = Any  # a dict of arrays, or one flat array


class ObservationBuilder:
    """Fills observations.

    Args:
        n_joints: Number of joints.
        capacity: Number of slots.
        task: Bounds of the task's observation; None if it shows nothing.
        flat: Whether an observation is one array, as `gymnasium.spaces.flatten` would make it.
        n_speeds: Number of speeds; each has an action for each slot.

    Attributes:
        space: The observation space.
    """

    def __init__(
        self,
        n_joints: int,
        capacity: int,
        task: spaces.Box | None,
        flat: bool = False,
        n_speeds: int = 1,
    ) -> None:
        n_actions = capacity * n_speeds
        angles = np.full(n_joints, 2 * np.pi)
        self._high = {
            "posture": np.concatenate(([10.0, np.pi / 2, np.pi], angles)),
            "velocity": np.full(6 + n_joints, 100.0),
            "cog": np.full(3, 10.0),
            "support_margin": np.full(1, 10.0),
        }
        self._low = {key: -high for key, high in self._high.items()}
        self._task = task
        parts: dict[str, spaces.Space[Any]] = {
            key: spaces.Box(self._low[key], high, dtype=np.float64)
            for key, high in self._high.items()
        }
        parts["current_primitive"] = spaces.Discrete(capacity)
        parts["action_mask"] = spaces.Box(0, 1, (n_actions,), np.int8)  # all clients know boxes
        parts["transition_prior"] = spaces.Box(0.0, 1.0, (n_actions,), np.float64)
        if task is not None:
            parts["task"] = task
        structured = spaces.Dict(parts)
        self._flat = flat
        self._order = tuple(structured.spaces)
        self._capacity = capacity
        self._n_speeds = n_speeds
        self.space: spaces.Space[Any] = spaces.flatten_space(structured) if flat else structured

    def see(self, measured: Measured, slot: int, choices: Choices, task: FloatArray) -> Observation:
        """Return an observation, every array of it fresh.

        Args:
            measured: How the robot stands.
            slot: Slot that was performed last.
            choices: What may be done next.
            task: What the task shows; it becomes of the kind of number that its bounds have.
        """
        seen: dict[str, Any] = {}
        for key, low in self._low.items():
            seen[key] = np.minimum(np.maximum(getattr(measured, key), low), self._high[key])
        seen["current_primitive"] = np.int64(slot)
        seen["action_mask"] = choices.mask_at(self._n_speeds)
        seen["transition_prior"] = choices.prior_at(self._n_speeds)
        if self._task is not None:
            seen["task"] = np.array(task, dtype=self._task.dtype)
        if not self._flat:
            return seen
        one_hot = np.zeros(self._capacity)
        one_hot[slot] = 1.0
        seen["current_primitive"] = one_hot
        return np.concatenate([seen[key] for key in self._order])

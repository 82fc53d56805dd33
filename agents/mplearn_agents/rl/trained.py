"""A trained agent as a policy, as any other."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn_agents.extras import require
from mplearn_agents.policies import Policy, legal_actions

from .config import TrainingConfig
from .projection import project

POLICY = "policy.zip"
CONFIG = "training.json"


class TrainedPolicy(Policy):
    """Acts as a model of Stable-Baselines3 does, on legal actions only.

    Args:
        model: The model; with masks (sb3-contrib) or without.
        masks: Whether its ``predict`` takes masks; else illegal actions are projected, see
            `mplearn_agents.rl.projection.project`.
        deterministic: Whether to take the best action, or to draw one.
        slots: Slot of each primitive that the model knows, by id; None does not say.
    """

    def __init__(
        self,
        model: Any,
        masks: bool,
        deterministic: bool = True,
        slots: dict[int, int] | None = None,
    ) -> None:
        self.model = model
        self.masks = masks
        self.deterministic = deterministic
        self.slots = slots

    @classmethod
    def load(cls, folder: str | Path, deterministic: bool = True) -> TrainedPolicy:
        """Return the agent that `mplearn_agents.rl.train` left in a folder.

        Raises:
            InvalidValueError: There is none.
            MissingDependencyError: The extra ``rl`` is not installed.
        """
        require("sb3_contrib", "rl")
        from .algorithms import RECIPES, load_model

        folder = Path(folder)
        config, slots = TrainingConfig.load(folder / CONFIG)
        if not (folder / POLICY).is_file():
            raise InvalidValueError(f"{folder} holds no {POLICY}: the training has not ended")
        model = load_model(config.algorithm, folder / POLICY)
        return cls(model, RECIPES[config.algorithm].masks, deterministic, slots)

    def require_fit(self, env: gymnasium.Env[Any, Any]) -> None:
        """Check that an environment's spaces and slots are those the agent was trained on.

        Raises:
            InvalidValueError: They are not; a policy can be taken along by `grow`.
        """
        if (self.model.observation_space, self.model.action_space) != (
            env.observation_space,
            env.action_space,
        ):
            raise InvalidValueError(
                f"the agent was trained for {self.model.action_space} and "
                f"{self.model.observation_space}; this environment has {env.action_space} and "
                f"{env.observation_space}"
            )
        slots = env.unwrapped.repertoire.slots if self.slots is not None else {}  # type: ignore[attr-defined]
        moved = [id for id, slot in slots.items() if (self.slots or {}).get(id) != slot]
        if moved:
            raise InvalidValueError(
                f"the agent does not know the primitives {moved} of this library, or knows them in "
                "other slots: take it along with mplearn_agents.rl.growing.grow"
            )

    def reset(self, seed: int | None = None) -> None:
        """Seed torch, from which a policy that is not deterministic draws."""
        if seed is not None and not self.deterministic:
            require("torch", "rl").manual_seed(seed)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the model's action, a legal one."""
        mask = legal_actions(info)
        kept = {key: np.asarray(value) for key, value in observation.items()}
        given = {"action_masks": mask} if self.masks else {}
        action, _ = self.model.predict(kept, deterministic=self.deterministic, **given)
        return project(int(action), mask)

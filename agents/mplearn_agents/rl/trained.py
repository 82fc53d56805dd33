"""A trained agent as a policy, as any other."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.extras import require
from mplearn.recording import IntArray
from mplearn_agents.policies import Policy, legal_actions
from mplearn_envs.skills.repertoire import ENTRY_GAP

from .config import Course, TrainingConfig
from .encoding import Scaling
from .projection import project

POLICY = "policy.zip"
CONFIG = "training.json"
_POSTURES = 5  # of a motion


class TrainedPolicy(Policy):
    """Acts as a model of Stable-Baselines3 does, on legal actions only.

    Args:
        model: The model of Stable-Baselines3.
        config: How it is trained.
        slots: Slot of each primitive that it knows, by id.
        deterministic: Whether to take the best action, or to draw one.
        courses: How the motion of each primitive that it knows goes, see `courses_of`; None where
            that is not known.
    """

    def __init__(
        self,
        model: Any,
        config: TrainingConfig,
        slots: Mapping[int, int],
        deterministic: bool = True,
        courses: Mapping[int, Course] | None = None,
    ) -> None:
        self.model = model
        self.config = config
        self.slots = dict(slots)
        self.deterministic = deterministic
        self.courses = dict(courses or {})

    @classmethod
    def load(cls, folder: str | Path, deterministic: bool = True) -> TrainedPolicy:
        """Return the agent that `mplearn_agents.rl.train.train` left in a folder.

        Raises:
            InvalidValueError: There is none.
            MissingDependencyError: The extra ``rl`` is not installed.
        """
        require("sb3_contrib", "rl")
        from .algorithms import load_model

        folder = Path(folder)
        config, slots, courses = TrainingConfig.load(folder / CONFIG)
        if not (folder / POLICY).is_file():
            raise InvalidValueError(f"{folder} holds no {POLICY}: the training has not ended")
        model = load_model(config.algorithm, folder / POLICY)
        return cls(model, config, slots, deterministic, courses)

    @property
    def scaling(self) -> Scaling:
        """How it scales what it sees."""
        return self.model.policy_kwargs["features_extractor_kwargs"]["scaling"]  # type: ignore[no-any-return]

    def require_fit(self, env: gymnasium.Env[Any, Any]) -> None:
        """Check that an environment shows what the agent was trained on, in the same slots.

        Raises:
            InvalidValueError: It does not; an agent can be taken along by `grow`.
        """
        ours = self.model.observation_space, self.model.action_space
        if ours != (env.observation_space, env.action_space):
            raise InvalidValueError(
                f"the agent was trained for another task, robot or capacity: {ours[1]}, "
                f"{ours[0]}; here are {env.action_space}, {env.observation_space}"
            )
        slots = env.unwrapped.repertoire.slots  # type: ignore[attr-defined]
        if slots != self.slots:
            other = sorted({id for id, _ in slots.items() ^ self.slots.items()})
            raise InvalidValueError(
                f"the agent was trained on another library: the primitives {other} are new, gone, "
                "or in other slots; take it along with mplearn_agents.rl.growing.grow"
            )
        here = courses_of(env)
        moved = [id for id, course in self.courses.items() if not same_motion(course, here[id])]
        if moved:
            raise InvalidValueError(
                f"the agent was trained on another library: the primitives {moved} have the same "
                "ids here, but lead through other postures; train an agent on this one"
            )

    def reset(self, seed: int | None = None) -> None:
        """Seed torch, from which a policy that is not deterministic draws."""
        if seed is not None and not self.deterministic:
            require("torch", "rl").manual_seed(seed)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the model's action, a legal one."""
        mask = legal_actions(info)
        kept = {key: np.asarray(value) for key, value in observation.items()}
        given = {"action_masks": mask} if self.config.algorithm == "maskable-ppo" else {}
        action, _ = self.model.predict(kept, deterministic=self.deterministic, **given)
        return project(int(action), mask)


def courses_of(env: gymnasium.Env[Any, Any]) -> dict[int, Course]:
    """Return how the motion of each primitive of an environment goes, by id.

    Where it begins, a quarter, half and three quarters later, and where it ends.
    """
    repertoire = env.unwrapped.repertoire  # type: ignore[attr-defined]
    motions = {id: repertoire.skills[id].motion.frames for id in repertoire.ids}
    return {
        id: frames[_at(len(frames), _POSTURES)].round(3).tolist() for id, frames in motions.items()
    }


def same_motion(ours: Course, theirs: Course) -> bool:
    """Return whether two motions lead through about the same postures.

    Of a motion of which less is known, those that are.
    """
    few = min(len(ours), len(theirs))
    some, others = (np.asarray(each)[_at(len(each), few)] for each in (ours, theirs))
    return bool(np.abs(some - others).max() <= ENTRY_GAP)


def _at(length: int, count: int) -> IntArray:
    """Return so many places, evenly from the first to the last."""
    return np.rint(np.linspace(0, length - 1, count)).astype(np.int64)

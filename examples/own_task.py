"""Reward what one likes: here motions that end with the hands up.

python examples/own_task.py
"""

from dataclasses import dataclass
from typing import ClassVar

import gymnasium as gym
import numpy as np

import mplearn_envs  # noqa: F401  (registers the environments)
from mplearn.recording import FloatArray
from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.tasks import Choice, Scene, Task


@dataclass
class HandsUp(Task):
    """Pays 1 for each macro step that lifts the arms."""

    terms: ClassVar[tuple[str, ...]] = ("hands_up",)

    def bonuses(self, choice: Choice) -> dict[str, float]:
        return {}

    def rates(self, report: TrackingReport) -> dict[str, FloatArray]:
        return {}

    def arrive(self, scene: Scene) -> dict[str, float]:
        name = "" if scene.current is None else scene.repertoire.library[scene.current].name
        return {"hands_up": float("arm" in name and name.endswith("raise"))}


env = gym.make("mplearn/PrimitiveHumanoid-v0", task=HandsUp(), dynamics="kinematic")
observation, info = env.reset(seed=1)
rng = np.random.default_rng(1)
earned = 0.0
for _ in range(30):
    action = int(rng.choice(len(info["transition_prior"]), p=info["transition_prior"]))
    observation, reward, terminated, truncated, info = env.step(action)
    earned += float(reward)
print(f"the random walk earns {earned:.2f} in 30 steps")
env.close()

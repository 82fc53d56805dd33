"""Gymnasium environments whose actions are motion primitives.

``gym.make("mplearn/PrimitiveHumanoid-v1")`` (many primitives of several people; ``-v0``: 22 of one)
and ``gym.make("mplearn/OnlinePrimitiveHumanoid-v0")``, after ``import mplearn_envs``, or as
``gym.make("mplearn_envs:mplearn/PrimitiveHumanoid-v1")``.
"""

import warnings

from gymnasium.envs.registration import register

# both versions are kept: v0 is another library, no older code
warnings.filterwarnings("ignore", r".*mplearn/PrimitiveHumanoid-v0 is out of date")

register(
    id="mplearn/PrimitiveHumanoid-v0",
    entry_point="mplearn_envs.environment.primitive_humanoid:PrimitiveHumanoidEnv",
    max_episode_steps=100,
    vector_entry_point="mplearn_envs.environment.vector:PrimitiveHumanoidVectorEnv",
)
register(
    id="mplearn/PrimitiveHumanoid-v1",
    entry_point="mplearn_envs.environment.varied_humanoid:VariedHumanoidEnv",
    max_episode_steps=200,
    vector_entry_point="mplearn_envs.environment.vector:VariedHumanoidVectorEnv",
)
register(
    id="mplearn/OnlinePrimitiveHumanoid-v0",
    entry_point="mplearn_envs.environment.online:OnlinePrimitiveHumanoidEnv",
    max_episode_steps=100,
)

"""Gymnasium environments whose actions are motion primitives.

``gym.make("mplearn/PrimitiveHumanoid-v0")`` and ``gym.make("mplearn/OnlinePrimitiveHumanoid-v0")``,
after ``import mplearn_envs``, or as ``gym.make("mplearn_envs:mplearn/PrimitiveHumanoid-v0")``.
"""

from gymnasium.envs.registration import register

register(
    id="mplearn/PrimitiveHumanoid-v0",
    entry_point="mplearn_envs.environment.primitive_humanoid:PrimitiveHumanoidEnv",
    max_episode_steps=100,
    vector_entry_point="mplearn_envs.environment.vector:PrimitiveHumanoidVectorEnv",
)
register(
    id="mplearn/OnlinePrimitiveHumanoid-v0",
    entry_point="mplearn_envs.environment.online:OnlinePrimitiveHumanoidEnv",
    max_episode_steps=100,
)

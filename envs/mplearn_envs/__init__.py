"""Gymnasium environments whose actions are motion primitives.

``gym.make("mplearn/PrimitiveHumanoid-v0")``, after ``import mplearn_envs``.
"""

from gymnasium.envs.registration import register

register(
    id="mplearn/PrimitiveHumanoid-v0",
    entry_point="mplearn_envs.primitive_humanoid:PrimitiveHumanoidEnv",
)

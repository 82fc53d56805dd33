"""The environment on the standing library, and a walk in it."""

import gymnasium
import numpy as np
from standing_library import MOTIONS, standing_library

import mplearn_envs  # noqa: F401  (registers the environment)

ID = "mplearn/PrimitiveHumanoid-v0"
SLOT = {motion[0]: slot for slot, motion in enumerate(MOTIONS, start=1)}


def make(names=None, **options):
    return gymnasium.make(ID, library=standing_library(names), **options)


def walk(env, n, seed):
    """Return what a random walk by the prior sees: rewards, postures and actions."""
    _, info = env.reset(seed=seed)
    env.action_space.seed(seed)
    seen = []
    for _ in range(n):
        action = env.action_space.sample(probability=info["transition_prior"])
        observation, reward, terminated, truncated, info = env.step(action)
        assert not terminated
        seen.append((int(action), float(reward), observation["posture"].tobytes(), truncated))
    return seen


def legal(info):
    return np.flatnonzero(info["action_mask"]).tolist()

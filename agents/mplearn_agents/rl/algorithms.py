"""The algorithms, each with what it needs for masks, priors and macro steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from stable_baselines3 import DQN
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from .config import AlgorithmName, TrainingConfig
from .encoding import Scaling
from .features import PrimitiveFeatures
from .networks import MaskedPriorPolicy, PriorPolicy
from .semi_markov import (
    MacroMaskablePPO,
    MacroPPO,
    MacroReplayBuffer,
    MacroStepBuffer,
    MaskedMacroStepBuffer,
)

ON_POLICY = {
    "n_steps": 128,
    "batch_size": 256,
    "n_epochs": 6,
    "learning_rate": 7e-4,
    "gae_lambda": 0.97,  # per second
    "ent_coef": 0.06,
}
OFF_POLICY = {
    "learning_rate": 5e-4,
    "buffer_size": 50_000,
    "learning_starts": 500,
    "batch_size": 128,
    "train_freq": 2,
    "target_update_interval": 250,
    "exploration_fraction": 1.0,  # of each round
    "exploration_final_eps": 0.05,
}


class Recipe(NamedTuple):
    """How an algorithm is used here.

    Attributes:
        cls: Its class.
        policy: The class, or name, of its network.
        buffer: Keyword and class of its memory.
        n_envs: How many environments it learns from at once, unless told otherwise.
        settings: Its hyperparameters.
    """

    cls: type[BaseAlgorithm]
    policy: Any
    buffer: dict[str, Any]
    n_envs: int
    settings: dict[str, Any]


RECIPES: dict[AlgorithmName, Recipe] = {
    "maskable-ppo": Recipe(
        MacroMaskablePPO,
        MaskedPriorPolicy,
        {"rollout_buffer_class": MaskedMacroStepBuffer},
        16,
        ON_POLICY,
    ),
    "ppo": Recipe(MacroPPO, PriorPolicy, {"rollout_buffer_class": MacroStepBuffer}, 16, ON_POLICY),
    "dqn": Recipe(
        DQN, "MultiInputPolicy", {"replay_buffer_class": MacroReplayBuffer}, 1, OFF_POLICY
    ),
}


def n_envs(config: TrainingConfig) -> int:
    """Return from how many environments a training learns at once."""
    return RECIPES[config.algorithm].n_envs if config.n_envs is None else config.n_envs


def rollout_steps(config: TrainingConfig) -> int:
    """Return how many macro steps a training makes before it may stop."""
    return int(RECIPES[config.algorithm].settings.get("n_steps", 1)) * n_envs(config)


def new_model(config: TrainingConfig, envs: VecEnv, scaling: Scaling) -> BaseAlgorithm:
    """Return an untrained model, which scales what it sees."""
    recipe = RECIPES[config.algorithm]
    network: dict[str, Any] = {
        "net_arch": list(config.network),
        "features_extractor_class": PrimitiveFeatures,
        "features_extractor_kwargs": {"scaling": scaling},
    }
    if config.algorithm != "dqn":
        network |= {"activation_fn": nn.Tanh, "prior": config.prior}
    settings = dict(recipe.settings)
    if config.learning_rate is not None:
        settings["learning_rate"] = config.learning_rate
    return recipe.cls(
        recipe.policy,
        envs,
        policy_kwargs=network,
        seed=config.seed,
        device="cpu",
        **recipe.buffer,
        **settings,
    )


def load_model(algorithm: AlgorithmName, path: Path, envs: VecEnv | None = None) -> BaseAlgorithm:
    """Return a model that was saved, to go on in these environments, or only to act."""
    return RECIPES[algorithm].cls.load(path, env=envs, device="cpu")

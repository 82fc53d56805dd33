"""Trains an agent in rounds, with checkpoints, evaluations and a log; goes on where it stopped.

As a program: ``mplearn train --task goal --out out/goal``. In Python::

    policy = train(TrainingConfig(task="goal", steps=60_000), "out/goal")
    action = policy.act(observation, info)
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.extras import require

from .config import TrainingConfig
from .encoding import measure_scaling
from .projection import ProjectIllegal
from .trained import CONFIG, POLICY, TrainedPolicy, courses_of

if TYPE_CHECKING:
    from rich.console import Console

_CHECKPOINT = "checkpoint-{:09d}.zip"


def make_environment(config: TrainingConfig) -> gymnasium.Env[Any, Any]:
    """Return an environment of a training, with illegal actions as the environment has them."""
    import mplearn_envs  # noqa: F401  (registers the environment)

    name = f"mplearn/PrimitiveHumanoid-{config.env}"
    return gymnasium.make(name, disable_env_checker=True, **config.options)


def train(
    config: TrainingConfig,
    out: str | Path,
    *,
    resume: bool = False,
    start: TrainedPolicy | None = None,
    console: Console | None = None,
) -> TrainedPolicy:
    """Train an agent.

    Writes into a folder: ``training.json``, ``checkpoint-*.zip`` after each round, ``policy.zip``
    at the end (for `TrainedPolicy.load`), ``evaluation.csv``, and ``log/`` (CSV and TensorBoard).

    Args:
        config: What to train.
        out: The folder; it is made.
        resume: Whether to go on from the folder's last checkpoint; ``config`` may ask for more
            steps than before, nothing else may differ.
        start: An agent for this very environment, to go on from its weights, see
            `mplearn_agents.rl.growing.grow`; None starts untrained.
        console: Where to show progress; None is silent.

    Returns:
        The trained agent.

    Raises:
        InvalidValueError: The folder holds a training and ``resume`` is not set, or the other way
            round, or another training; or ``start`` is for another environment.
        MissingDependencyError: The extra ``rl`` is not installed.
    """
    for module in ("torch", "sb3_contrib", "tensorboard"):
        require(module, "rl")
    import torch
    from stable_baselines3.common.logger import configure
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.utils import set_random_seed
    from stable_baselines3.common.vec_env import DummyVecEnv

    from .algorithms import load_model, n_envs, new_model, rollout_steps
    from .callbacks import Evaluation, ShowProgress

    out = Path(out)
    done = _steps_done(config, out, resume)

    def make() -> gymnasium.Env[Any, Any]:
        env = make_environment(config)
        return Monitor(env if config.algorithm == "maskable-ppo" else ProjectIllegal(env))

    torch.set_num_threads(1)  # these networks are small: threads cost more than they bring
    envs = DummyVecEnv([make] * n_envs(config))
    tested = make_environment(config)
    inner: Any = tested.unwrapped
    slots = dict(inner.repertoire.slots)
    out.mkdir(parents=True, exist_ok=True)
    courses = courses_of(tested)
    config.save(out / CONFIG, slots, courses)
    if done:
        model = load_model(config.algorithm, out / _CHECKPOINT.format(done), envs)
    else:
        scaling = measure_scaling(tested) if start is None else start.scaling
        model = new_model(config, envs, scaling)
        if start is not None:
            start.require_fit(tested)
            model.policy.load_state_dict(start.model.policy.state_dict())
    model.set_logger(configure(str(out / "log" / f"from-{done:09d}"), ["csv", "tensorboard"]))
    policy = TrainedPolicy(model, config, slots, courses=courses)
    progress = ShowProgress(config, console)
    evaluation = Evaluation(policy, tested, config, out / "evaluation.csv")
    rollout = rollout_steps(config)
    round_steps = -(-config.round_steps // rollout) * rollout
    with progress.shown():
        while done < config.steps:
            seed = int(np.random.SeedSequence([config.seed, done]).generate_state(1)[0] >> 1)
            set_random_seed(seed)
            envs.seed(seed)
            model.set_env(envs, force_reset=True)
            model.learn(round_steps, callback=[progress, evaluation], reset_num_timesteps=False)
            done = model.num_timesteps
            model.save(out / _CHECKPOINT.format(done))
    model.save(out / POLICY)
    model.logger.close()
    envs.close()
    tested.close()
    return policy


def _steps_done(config: TrainingConfig, out: Path, resume: bool) -> int:
    """Return how many steps the last checkpoint of a folder has; 0 if it holds no training."""
    if not (out / CONFIG).exists():
        if resume:
            raise InvalidValueError(f"{out} holds no training to resume")
        return 0
    if not resume:
        raise InvalidValueError(f"{out} holds a training: resume it, or take another folder")
    before, *_ = TrainingConfig.load(out / CONFIG)
    if replace(before, steps=config.steps) != config:
        raise InvalidValueError(f"{out} holds another training, {before}, not {config}")
    found = sorted(out.glob("checkpoint-*.zip"))
    return int(found[-1].stem.removeprefix("checkpoint-")) if found else 0

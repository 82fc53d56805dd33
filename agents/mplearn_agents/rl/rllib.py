"""Trains with masks and macro steps on Ray RLlib: on one machine, or on any cluster.

RLlib pins an older Gymnasium, so it wants a virtual environment of its own:
``pip install 'mplearn[cluster]'``. Then, on one machine with two workers::

    python -m mplearn_agents.rl.rllib --task goal --workers 2 --steps 50000 --out out/rllib

and on a cluster the same with ``--address auto`` on its head node, the package installed on all.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from ray.rllib.algorithms.algorithm import Algorithm
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.algorithms.ppo.torch.ppo_torch_learner import PPOTorchLearner
from ray.rllib.connectors.connector_v2 import ConnectorV2
from ray.rllib.connectors.learner import GeneralAdvantageEstimation
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.apis.value_function_api import ValueFunctionAPI
from ray.rllib.core.rl_module.rl_module import RLModuleSpec
from ray.rllib.core.rl_module.torch import TorchRLModule
from ray.rllib.evaluation.postprocessing import Postprocessing
from ray.tune.registry import register_env
from torch import nn

from mplearn_agents.episodes import play
from mplearn_agents.policies import Policy

from .encoding import FAR, LEAST_PRIOR, PRIOR, measure_scaling
from .returns import advantages

NAME = "mplearn-flat"
MASK = "action_mask"
DISCOUNT, DURATION = "discount", "duration_s"
WIDTH = 128
GAE_LAMBDA = 0.97  # per second


class FlatObservation(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Shows an observation as one vector: all scaled numbers, then log prior and mask (A each).

    Of ``info`` it keeps the duration only: infos travel between the machines.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        parts = dict(env.observation_space.spaces)  # type: ignore[attr-defined]
        self._parts, self._scaling = parts, measure_scaling(env)
        n = int(env.action_space.n)  # type: ignore[attr-defined]
        width = sum(spaces.flatdim(part) for part in parts.values()) + 2 * n
        self.observation_space = spaces.Box(-np.inf, np.inf, (width,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode."""
        observation, _ = self.env.reset(seed=seed, options=options)
        return self.flat(observation), {}

    def step(
        self, action: Any
    ) -> tuple[NDArray[np.float32], SupportsFloat, bool, bool, dict[str, Any]]:
        """Perform a macro step."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        kept = {key: info[key] for key in (DISCOUNT, DURATION)}
        return self.flat(observation), reward, terminated, truncated, kept

    def flat(self, observation: Mapping[str, Any]) -> NDArray[np.float32]:
        """Return the vector."""
        blocks = []
        for key, part in self._parts.items():
            values = np.array(spaces.flatten(part, observation[key]), np.float32)
            if key in self._scaling:
                mean, factor = self._scaling[key]
                rest = values[-len(mean) :]
                rest[:] = np.clip((rest - mean) * factor, -FAR, FAR)
            blocks.append(values)
        log_prior = np.log(np.maximum(observation[PRIOR] / LEAST_PRIOR, 1.0))
        return np.concatenate((*blocks, log_prior, observation[MASK])).astype(np.float32)


class MaskedModule(TorchRLModule, ValueFunctionAPI):  # type: ignore[misc]
    """Actor and critic whose logits start as the log prior, and are the least where masked."""

    def setup(self) -> None:
        """Build the networks."""
        self.n = int(self.action_space.n)
        n_inputs = int(self.observation_space.shape[0]) - 2 * self.n

        def perceptron(n_outputs: int, gain: float) -> nn.Sequential:
            last = nn.Linear(WIDTH, n_outputs)
            nn.init.orthogonal_(last.weight, gain)
            nn.init.zeros_(last.bias)
            layers = (nn.Linear(n_inputs, WIDTH), nn.Tanh(), nn.Linear(WIDTH, WIDTH), nn.Tanh())
            return nn.Sequential(*layers, last)

        self.actor, self.critic = perceptron(self.n, 0.01), perceptron(1, 1.0)

    def _forward(self, batch: dict[str, Any], **kwargs: Any) -> dict[str, Any]:
        seen, log_prior, mask = self._split(batch)
        logits = self.actor(seen) + log_prior
        least = torch.finfo(logits.dtype).min / 2
        return {Columns.ACTION_DIST_INPUTS: torch.where(mask > 0, logits, least)}

    def compute_values(self, batch: dict[str, Any], embeddings: Any = None) -> torch.Tensor:
        """Return the values, shape (B,)."""
        out: torch.Tensor = self.critic(self._split(batch)[0]).squeeze(-1)
        return out

    def _split(self, batch: dict[str, Any]) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        seen = batch[Columns.OBS]
        return seen[..., : -2 * self.n], seen[..., -2 * self.n : -self.n], seen[..., -self.n :]


class MacroStepAdvantages(ConnectorV2):  # type: ignore[misc]
    """Puts advantages into the batch as RLlib's own does, with each step's own discount."""

    def __call__(
        self, *, rl_module: Any, batch: dict[str, Any], episodes: list[Any], **kwargs: Any
    ) -> Any:
        """Fill in advantages and value targets of the one module."""
        ((name, columns),) = batch.items()
        with torch.no_grad():
            values = rl_module[name].compute_values(columns).cpu().numpy()
        gains, start = np.zeros_like(values), 0
        for episode in episodes:  # each with one step more than were made, for the last value
            n = len(episode) - 1
            rewards = np.asarray(episode.get_rewards(), np.float32)[:n]
            infos = episode.get_infos()[1 : n + 1]
            discounts = np.array([info[DISCOUNT] for info in infos], np.float32)
            durations_s = np.array([info[DURATION] for info in infos], np.float32)
            ends = np.zeros(n, np.bool_)
            ends[-1] = episode.is_terminated
            found = advantages(
                rewards[:, None],
                values[start : start + n + 1, None],
                ends[:, None],
                discounts[:, None],
                GAE_LAMBDA ** durations_s[:, None],
            )
            gains[start : start + n] = found[:, 0]
            start += n + 1
        columns[Postprocessing.VALUE_TARGETS] = torch.as_tensor(gains + values)
        scale = max(1e-4, float(gains.std()))
        columns[Postprocessing.ADVANTAGES] = torch.as_tensor((gains - gains.mean()) / scale)
        return batch


class MacroStepLearner(PPOTorchLearner):  # type: ignore[misc]
    """PPO's learner, for macro steps."""

    def build(self) -> None:
        """Build, and replace the advantages."""
        super().build()
        self._learner_connector.remove(GeneralAdvantageEstimation)
        self._learner_connector.append(MacroStepAdvantages())


class ClusterPolicy(Policy):
    """What was trained, as a policy for an environment that is not flattened.

    Args:
        module: The trained module.
        env: Any environment of the same task and library; its spaces are used.
    """

    def __init__(self, module: Any, env: gymnasium.Env[Any, Any]) -> None:
        self.module = module
        self._flat = FlatObservation(env)

    def act(self, observation: Any, info: Mapping[str, Any]) -> int:
        """Return the best action; the module never names one that is masked."""
        seen = torch.as_tensor(self._flat.flat(observation))[None]
        with torch.no_grad():
            logits = self.module.forward_inference({Columns.OBS: seen})[Columns.ACTION_DIST_INPUTS]
        return int(torch.argmax(logits))


def make_environment(options: Mapping[str, Any]) -> gymnasium.Env[Any, Any]:
    """Return a primitive environment, as it is."""
    import mplearn_envs  # noqa: F401  (registers the environment)

    return gymnasium.make("mplearn/PrimitiveHumanoid-v0", disable_env_checker=True, **options)


def algorithm(options: Mapping[str, Any], workers: int = 2, seed: int = 0) -> Algorithm:
    """Return PPO with masks and macro steps.

    Args:
        options: Arguments of ``mplearn/PrimitiveHumanoid-v0``.
        workers: Processes that collect steps; 0 collects in this one.
        seed: Of everything.
    """
    register_env(NAME, lambda given: FlatObservation(make_environment(given)))
    config = (
        PPOConfig()
        .environment(NAME, env_config=dict(options))
        .env_runners(num_env_runners=workers, num_envs_per_env_runner=4)
        .learners(num_learners=0, learner_class=MacroStepLearner)
        .rl_module(rl_module_spec=RLModuleSpec(module_class=MaskedModule))
        .training(
            lr=7e-4,
            train_batch_size_per_learner=2048,
            minibatch_size=256,
            num_epochs=6,
            entropy_coeff=0.03,
            vf_clip_param=np.inf,
        )
        .debugging(seed=seed, log_level="ERROR")
    )
    return config.build_algo()


def main(argv: Sequence[str] | None = None) -> int:
    """Train, evaluate, and save a checkpoint."""
    import ray

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--task", default="goal")
    parser.add_argument("--library", help="library file (default: the built-in one)")
    parser.add_argument("--dynamics", default="kinematic", choices=["kinematic", "simulated"])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--steps", type=int, default=50_000)
    parser.add_argument("--episodes", type=int, default=50, help="episodes of the evaluation")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--address", help="of the cluster (default: this machine alone)")
    parser.add_argument("--out", type=Path, help="folder for the checkpoint")
    args = parser.parse_args(argv)
    options = {"task": args.task, "library": args.library, "dynamics": args.dynamics}
    ray.init(address=args.address, include_dashboard=False, log_to_driver=False)
    trained = algorithm(options, args.workers, args.seed)
    steps = 0
    while steps < args.steps:
        result = trained.train()
        steps = int(result["num_env_steps_sampled_lifetime"])
        mean = result["env_runners"].get("episode_return_mean", np.nan)
        print(f"{steps:8d} steps, mean of the sums of rewards {mean:.3f}", flush=True)
    env = make_environment(options)
    episodes = play(env, ClusterPolicy(trained.get_module(), env), args.episodes, args.seed)
    print(
        f"return {np.mean([e.return_ for e in episodes]):.3f}, "
        f"success {100 * np.mean([e.success for e in episodes]):.0f} %, "
        f"illegal actions {sum(e.illegal for e in episodes)}"
    )
    if args.out is not None:
        args.out.mkdir(parents=True, exist_ok=True)
        print(f"checkpoint in {trained.save_to_path(str(args.out.resolve()))}")
    trained.stop()
    env.close()
    ray.shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())

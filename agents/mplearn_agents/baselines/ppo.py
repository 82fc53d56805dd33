"""PPO with action masks and a semi-Markov discount, all in one file, after [Schulman2017].

    python -m mplearn_agents.baselines.ppo --env v1 --task goal --steps 200000

What differs from the PPO that one knows is marked by (1) to (3): masked actions are never drawn
(1); the prior of the environment is the untrained policy (2); what follows a macro step counts by
that step's own ``info["discount"]``, discount^duration, and so does the trace of the advantages
(3) [Sutton1999]. Our full training (`mplearn_agents.rl`) has checkpoints, evaluations and a network
that knows slots; here is as little as learns. It needs the extra ``rl`` for torch.
"""

from __future__ import annotations

import argparse
import sys
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn
from torch.distributions import Categorical

import mplearn_envs  # noqa: F401  (registers the environments)

NEVER = -1e9  # logit of an action that is masked
LEAST_PRIOR = 0.01  # of actions that the demonstrator never chose here, so that they are tried too


class Agent(nn.Module):
    """Actor and critic, two perceptrons of two layers each."""

    def __init__(self, n_inputs: int, n_actions: int, width: int = 128) -> None:
        super().__init__()
        self.actor = self._perceptron(n_inputs, width, n_actions, 0.01)
        self.critic = self._perceptron(n_inputs, width, 1, 1.0)

    @staticmethod
    def _perceptron(n_inputs: int, width: int, n_outputs: int, gain: float) -> nn.Sequential:
        last = nn.Linear(width, n_outputs)
        nn.init.orthogonal_(last.weight, gain)
        nn.init.zeros_(last.bias)
        layers = (nn.Linear(n_inputs, width), nn.Tanh(), nn.Linear(width, width), nn.Tanh())
        return nn.Sequential(*layers, last)

    def policy(self, seen: torch.Tensor, prior: torch.Tensor, mask: torch.Tensor) -> Any:
        """Return the distribution over actions, (N, A) each."""
        logits = self.actor(seen) + torch.log(torch.clamp(prior, min=LEAST_PRIOR))  # (2)
        return Categorical(logits=torch.where(mask > 0, logits, NEVER))  # (1)

    def value(self, seen: torch.Tensor) -> torch.Tensor:
        """Return how much is still to come, shape (N,)."""
        out: torch.Tensor = self.critic(seen).squeeze(-1)
        return out


class Vectors:
    """Turns dicts of arrays into vectors of like size: means and deviations are those seen so far.

    Args:
        space: Of one environment's observations.
    """

    def __init__(self, space: gymnasium.spaces.Dict) -> None:
        self.space = space
        self.width = gymnasium.spaces.flatdim(space)
        self.n, self.mean, self.square = 0, np.zeros(self.width), np.zeros(self.width)

    def __call__(self, observations: dict[str, Any]) -> torch.Tensor:
        """Return an array of shape (N, width)."""
        n = len(observations["action_mask"])
        rows = []
        for k in range(n):
            one = {key: values[k] for key, values in observations.items()}
            rows.append(gymnasium.spaces.flatten(self.space, one))
        flat = np.array(rows, dtype=np.float64)
        self.n += n
        self.mean += (flat - self.mean).sum(axis=0) / self.n
        self.square += (flat**2 - self.square).sum(axis=0) / self.n
        deviation = np.sqrt(np.maximum(self.square - self.mean**2, 1e-4))
        return torch.as_tensor(np.clip((flat - self.mean) / deviation, -5, 5), dtype=torch.float32)


def advantages(
    rewards: NDArray[np.float64],
    values: NDArray[np.float64],
    ends: NDArray[np.bool_],
    discounts: NDArray[np.float64],
    durations_s: NDArray[np.float64],
    gae_lambda: float,
) -> NDArray[np.float64]:
    """Return how much better each step was than expected, shape (T, N).

    Args:
        rewards: Of each step, discounted inside, (T, N).
        values: Before each step, and after the last, (T + 1, N).
        ends: Whether an episode ended with the step, (T, N).
        discounts: Of what follows each step, (T, N).
        durations_s: How long each took [s], (T, N).
        gae_lambda: Trace per second.
    """
    out, later = np.zeros_like(rewards), np.zeros(rewards.shape[1])
    for t in reversed(range(len(rewards))):
        goes_on = discounts[t] * ~ends[t]  # (3)
        delta = rewards[t] + goes_on * values[t + 1] - values[t]
        later = delta + goes_on * gae_lambda ** durations_s[t] * later
        out[t] = later
    return out


def train(args: argparse.Namespace) -> Iterator[dict[str, float]]:
    """Train, and yield after each rollout how many steps were made and what episodes came to."""
    torch.manual_seed(args.seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(args.seed)
    options = {"task": args.task, "dynamics": args.dynamics}
    envs = gymnasium.make_vec(
        f"mplearn/PrimitiveHumanoid-{args.env}",
        num_envs=args.envs,
        autoreset_mode=gymnasium.vector.AutoresetMode.SAME_STEP,
        **options,
    )
    vectors = Vectors(envs.single_observation_space)  # type: ignore[arg-type]
    n_actions = int(envs.single_action_space.n)  # type: ignore[attr-defined]
    agent = Agent(vectors.width, n_actions)
    optimiser = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)
    shape = (args.rollout, args.envs)
    observation, _ = envs.reset(seed=args.seed)
    solved: deque[float] = deque(maxlen=100)
    illegal = 0
    for done in range(0, args.steps, args.rollout * args.envs):
        seen = torch.zeros((*shape, vectors.width))
        mask, prior = torch.zeros((*shape, n_actions)), torch.zeros((*shape, n_actions))
        actions, log_p = torch.zeros(shape, dtype=torch.long), torch.zeros(shape)
        rewards, discounts, durations_s = np.zeros(shape), np.ones(shape), np.zeros(shape)
        values, ends = np.zeros((args.rollout + 1, args.envs)), np.zeros(shape, np.bool_)
        for t in range(args.rollout):
            seen[t] = vectors(observation)
            mask[t] = torch.as_tensor(observation["action_mask"])
            prior[t] = torch.as_tensor(observation["transition_prior"])
            with torch.no_grad():
                policy = agent.policy(seen[t], prior[t], mask[t])
                actions[t] = policy.sample()
                log_p[t], values[t] = policy.log_prob(actions[t]), agent.value(seen[t]).numpy()
            observation, reward, terminated, truncated, info = envs.step(actions[t].numpy())
            last = info.get("final_info", info)
            over = terminated | truncated
            for key, into in (("discount", discounts), ("duration_s", durations_s)):
                into[t] = np.where(over, last[key], info[key]) if over.any() else info[key]
            rewards[t], ends[t] = reward, over
            illegal += int(np.where(over, last["illegal"], info["illegal"]).sum())
            for k in np.flatnonzero(over):
                solved.append(float(last["is_success"][k]) if "is_success" in last else np.nan)
                if truncated[k]:  # what was cut off is worth what it is thought to be
                    final = {key: part[None] for key, part in info["final_obs"][k].items()}
                    with torch.no_grad():
                        rewards[t, k] += discounts[t, k] * float(agent.value(vectors(final)))
        with torch.no_grad():
            values[-1] = agent.value(vectors(observation)).numpy()
        gains = advantages(rewards, values, ends, discounts, durations_s, args.gae_lambda)
        returns = torch.as_tensor(gains + values[:-1], dtype=torch.float32).flatten()
        gain = torch.as_tensor(gains, dtype=torch.float32).flatten()
        flat = [part.flatten(0, 1) for part in (seen, prior, mask, actions, log_p)]
        for _ in range(args.epochs):
            for batch in np.array_split(rng.permutation(len(gain)), args.batches):
                pick = torch.as_tensor(batch)
                seen_, prior_, mask_, actions_, log_p_ = (part[pick] for part in flat)
                policy = agent.policy(seen_, prior_, mask_)
                ratio = torch.exp(policy.log_prob(actions_) - log_p_)
                better = (gain[pick] - gain[pick].mean()) / (gain[pick].std() + 1e-8)
                clipped = torch.clamp(ratio, 1 - args.clip, 1 + args.clip)
                loss = -torch.min(ratio * better, clipped * better).mean()
                loss = loss + 0.5 * (agent.value(seen_) - returns[pick]).square().mean()
                loss = loss - args.entropy * policy.entropy().mean()
                optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
                optimiser.step()
        yield {
            "steps": done + args.rollout * args.envs,
            "success": float(np.mean(solved)) if solved else np.nan,
            "illegal": illegal,
        }
    envs.close()


def settings(argv: Sequence[str] | None = None) -> argparse.Namespace:
    """Return what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--env", default="v1", choices=["v0", "v1"])
    parser.add_argument("--task", default="goal")
    parser.add_argument("--dynamics", default="kinematic", choices=["kinematic", "simulated"])
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--envs", type=int, default=16)
    parser.add_argument("--rollout", type=int, default=128, help="steps of each environment")
    parser.add_argument("--epochs", type=int, default=6)
    parser.add_argument("--batches", type=int, default=8)
    parser.add_argument("--learning-rate", type=float, default=7e-4)
    parser.add_argument("--gae-lambda", type=float, default=0.97, help="per second")
    parser.add_argument("--clip", type=float, default=0.2)
    parser.add_argument("--entropy", type=float, default=0.03)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Train, and say how it goes."""
    for row in train(settings(argv)):
        print(
            f"{row['steps']:9.0f} steps, {100 * row['success']:5.1f} % of the last 100 episodes "
            f"solved, {row['illegal']:.0f} illegal actions",
            flush=True,
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())

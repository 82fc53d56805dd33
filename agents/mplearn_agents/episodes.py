"""Whole episodes: a policy acts from reset to the end, and what came of it is counted."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn_agents.policies import Policy


@dataclass(frozen=True)
class Episode:
    """What came of an episode.

    Attributes:
        return_: Semi-Markov return from its start: each macro step's reward (which is discounted
            inside), discounted by the time before it.
        success: Whether the task was solved; NaN if the task does not say.
        fallen: Whether the robot fell.
        duration_s: How long it took [s].
        steps: Number of macro steps.
        illegal: How many of them were illegal.
        share: How good the return is: 0 what holding earns, 1 the best that is possible; NaN if the
            task does not say.
        wall_s: How long it took to play, thinking included [s of the clock on the wall].
    """

    return_: float
    success: float
    fallen: bool
    duration_s: float
    steps: int
    illegal: int
    share: float = np.nan
    wall_s: float = field(default=np.nan, compare=False)


def play(
    env: gymnasium.Env[Any, Any],
    policy: Policy,
    episodes: int,
    seed: int,
    *,
    show: Callable[[int], None] = lambda done: None,
) -> list[Episode]:
    """Play episodes; the same seed gives the same ones, whoever acts.

    Args:
        env: A primitive environment.
        policy: Who chooses.
        episodes: How many.
        seed: From which each episode's seed is drawn.
        show: Called after each episode with how many are done.

    Raises:
        InvalidValueError: ``episodes`` is less than 1.
    """
    if episodes < 1:
        raise InvalidValueError(f"there is at least 1 episode to play, not {episodes}")
    seeds = np.random.SeedSequence(seed).generate_state(episodes)
    policy.reset(seed)
    played = []
    for each in seeds:
        played.append(_episode(env, policy, int(each)))
        show(len(played))
    return played


def _episode(env: gymnasium.Env[Any, Any], policy: Policy, seed: int) -> Episode:
    observation, info = env.reset(seed=seed)
    policy.reset()
    began_s = time.perf_counter()
    scale = info.get("task", {})
    total, discount, duration_s, steps, illegal = 0.0, 1.0, 0.0, 0, 0
    over = fallen = False
    while not over:
        action = policy.act(observation, info)
        observation, reward, terminated, truncated, info = env.step(action)
        total += discount * float(reward)
        discount *= info["discount"]
        duration_s += info["duration_s"]
        steps += 1
        illegal += bool(info["illegal"])
        fallen = bool(info["fallen"])
        over = terminated or truncated
    success = float(info.get("is_success", np.nan))
    best, idle = (float(scale.get(f"{which}_return", np.nan)) for which in ("best", "idle"))
    share = (total - idle) / (best - idle)
    wall_s = time.perf_counter() - began_s
    return Episode(total, success, fallen, duration_s, steps, illegal, share, wall_s)

"""How an observation becomes numbers of like size for a network."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from mplearn_agents.policies import RandomWalk

PRIOR = "transition_prior"
LEAST_PRIOR = 0.01  # of actions that the demonstrator never chose here, so that they are tried too
MEASURED_STEPS = 256
FAR = 5.0  # numbers are cut off at so many standard deviations


class Scale(NamedTuple):
    """What makes numbers of mean 0 and deviation 1.

    Attributes:
        mean: Shape (D,).
        factor: Inverse of the standard deviation, shape (D,).
    """

    mean: NDArray[np.float32]
    factor: NDArray[np.float32]


#: Of each part of an observation that holds other numbers than slots': how those are scaled.
Scaling: TypeAlias = Mapping[str, Scale]


def capacity_of(observation_space: spaces.Dict) -> int:
    """Return the number of slots; there are as many actions at each speed."""
    return int(observation_space["current_primitive"].n)  # type: ignore[attr-defined]


def width_of_slots(part: spaces.Space[Any], capacity: int) -> int:
    """Return how many of a part's numbers are about slots; they come first.

    A part is about slots if it is ``Discrete(capacity)`` or begins with blocks of ``capacity``
    numbers within [0, 1].
    """
    width = spaces.flatdim(part)
    if isinstance(part, spaces.Box):
        outside = ~((part.low >= 0.0) & (part.high <= 1.0)).ravel()
        width = int(np.argmax(outside)) if outside.any() else width
    return width // capacity * capacity


def measure_scaling(
    env: gymnasium.Env[Any, Any], steps: int = MEASURED_STEPS, seed: int = 0
) -> Scaling:
    """Return means and deviations of what an environment shows on random walks by its prior.

    Args:
        env: A primitive environment; it is reset.
        steps: How many macro steps to look at.
        seed: Of the walks.
    """
    parts: dict[str, spaces.Space[Any]] = dict(env.observation_space.spaces)  # type: ignore[attr-defined]
    capacity = capacity_of(env.observation_space)  # type: ignore[arg-type]
    first = {key: width_of_slots(part, capacity) for key, part in parts.items()}
    seen: dict[str, list[NDArray[np.float64]]] = {
        key: [] for key, part in parts.items() if spaces.flatdim(part) > first[key]
    }
    walk = RandomWalk(seed)
    observation, info = env.reset(seed=seed)
    for _ in range(steps):
        for key, values in seen.items():
            values.append(np.ravel(observation[key])[first[key] :])
        observation, _, terminated, truncated, info = env.step(walk.act(observation, info))
        if terminated or truncated:
            observation, info = env.reset()
    out = {}
    for key, values in seen.items():
        numbers = np.array(values)
        factor = 1.0 / np.maximum(numbers.std(axis=0), 1e-3)
        out[key] = Scale(numbers.mean(axis=0).astype(np.float32), factor.astype(np.float32))
    return out

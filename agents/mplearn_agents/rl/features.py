"""What a network sees of an observation: numbers of like size, and the logarithm of the prior."""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from .encoding import FAR, LEAST_PRIOR, PRIOR, Scaling, capacity_of, width_of_slots

LEGAL, LOG_PRIOR = "action_mask 0", "log prior"  # parts, see `Feature`
LARGEST = -math.log(LEAST_PRIOR)  # log prior, see `log_prior`


class PrimitiveFeatures(BaseFeaturesExtractor):
    """Flattens an observation of a primitive environment, key by key in the order of the space.

    Slots become one-hot vectors, other numbers are scaled, and the logarithm of the prior comes
    last, shape (N, capacity), see `log_prior`. Of actions there are a block of ``capacity`` for
    each speed.

    Args:
        observation_space: A Dict with ``"transition_prior"``; of Discrete, MultiBinary and Box.
        scaling: How numbers are scaled that are not about slots, see `measure_scaling`.
    """

    def __init__(self, observation_space: spaces.Dict, scaling: Scaling) -> None:
        parts = observation_space.spaces
        widths = {key: spaces.flatdim(part) for key, part in parts.items()}
        self._capacity = capacity_of(observation_space)
        super().__init__(observation_space, sum(widths.values()) + self._capacity)
        self._keys = tuple(parts)
        self._scaled = tuple(key for key in parts if key in scaling)
        for key in self._scaled:
            self.register_buffer(f"mean_{key}", torch.as_tensor(scaling[key].mean))
            self.register_buffer(f"factor_{key}", torch.as_tensor(scaling[key].factor))

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Return the features, shape (N, F)."""
        blocks = [self._block(key, torch.flatten(observations[key], 1)) for key in self._keys]
        return torch.cat((*blocks, log_prior(observations, self._capacity)), dim=1)

    def _block(self, key: str, values: torch.Tensor) -> torch.Tensor:
        if key not in self._scaled:
            return values
        mean, factor = self.get_buffer(f"mean_{key}"), self.get_buffer(f"factor_{key}")
        slots = values.shape[1] - len(mean)
        scaled = torch.clamp((values[:, slots:] - mean) * factor, -FAR, FAR)
        return torch.cat((values[:, :slots], scaled), dim=1)


def log_prior(observations: dict[str, torch.Tensor], capacity: int) -> torch.Tensor:
    """Return log max(prior / ``LEAST_PRIOR``, 1), shape (N, capacity): 0 for all that is unlikely.

    As logits this is the prior itself; and a slot that is free is as if it were not there. The
    prior is that of the first speed: it says nothing of how fast.
    """
    prior = observations[PRIOR][:, :capacity]
    return torch.log(torch.clamp(prior.float() / LEAST_PRIOR, min=1.0))


class Feature(NamedTuple):
    """What one of `PrimitiveFeatures` is.

    Attributes:
        part: Key of the observation, and which of its blocks of slots.
        place: Place in the part; None where there is a slot.
        slot: Slot that it is about, or None.
    """

    part: str
    place: int | None
    slot: int | None


def features_of(observation_space: spaces.Dict) -> list[Feature]:
    """Return what each of `PrimitiveFeatures` is, in their order."""
    out: list[Feature] = []
    capacity = capacity_of(observation_space)
    for key, part in observation_space.spaces.items():
        n_slots = width_of_slots(part, capacity)
        out += [Feature(f"{key} {k // capacity}", None, k % capacity) for k in range(n_slots)]
        out += [Feature(key, k, None) for k in range(spaces.flatdim(part) - n_slots)]
    return out + [Feature(LOG_PRIOR, None, slot) for slot in range(capacity)]


def blocks_of(observation_space: spaces.Dict) -> dict[str, list[int]]:
    """Return the places of each block of slots, but for the log prior, by part."""
    blocks: dict[str, list[int]] = {}
    for place, feature in enumerate(features_of(observation_space)):
        if feature.slot is not None:
            blocks.setdefault(feature.part, []).append(place)
    del blocks[LOG_PRIOR]
    return blocks

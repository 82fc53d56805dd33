"""What a network sees of an observation: numbers of like size, and the logarithm of the prior."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from .encoding import LEAST_PRIOR, PRIOR, scale_of


class PrimitiveFeatures(BaseFeaturesExtractor):
    """Flattens an observation of a primitive environment, key by key in the order of the space.

    Slots become one-hot vectors, measurements are scaled, and the logarithm of the prior comes
    last, shape (N, capacity), see `log_prior`.

    Args:
        observation_space: A Dict with ``"transition_prior"``; of Discrete, MultiBinary and Box.
    """

    def __init__(self, observation_space: spaces.Dict) -> None:
        parts = observation_space.spaces
        widths = [spaces.flatdim(part) for part in parts.values()]
        super().__init__(observation_space, sum(widths) + spaces.flatdim(parts[PRIOR]))
        self._keys = tuple(parts)
        for key, part in parts.items():
            self.register_buffer(f"scale_{key}", torch.as_tensor(scale_of(key, part)))

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Return the features, shape (N, F)."""
        blocks = [
            torch.flatten(observations[key], 1) * self.get_buffer(f"scale_{key}")
            for key in self._keys
        ]
        return torch.cat((*blocks, log_prior(observations)), dim=1)


def log_prior(observations: dict[str, torch.Tensor]) -> torch.Tensor:
    """Return log max(prior / ``LEAST_PRIOR``, 1), shape (N, capacity): 0 for all that is unlikely.

    As logits this is the prior itself; and a slot that is free is as if it were not there.
    """
    return torch.log(torch.clamp(observations[PRIOR].float() / LEAST_PRIOR, min=1.0))


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


def features_of(observation_space: spaces.Dict, capacity: int) -> list[Feature]:
    """Return what each of `PrimitiveFeatures` is, in their order.

    A part of the observation is about slots if it is ``Discrete(capacity)`` or begins with blocks
    of ``capacity`` numbers within [0, 1].
    """
    out: list[Feature] = []
    for key, part in observation_space.spaces.items():
        width = spaces.flatdim(part)
        within = width
        if isinstance(part, spaces.Box):
            outside = ~((part.low >= 0.0) & (part.high <= 1.0)).ravel()
            within = int(np.argmax(outside)) if outside.any() else width
        n_slots = within // capacity * capacity
        out += [Feature(f"{key} {k // capacity}", None, k % capacity) for k in range(n_slots)]
        out += [Feature(key, k, None) for k in range(width - n_slots)]
    return out + [Feature("log prior", None, slot) for slot in range(capacity)]

"""What may be done next: which actions are legal, and how likely the demonstrator makes each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mplearn.recording import FloatArray

HOLD = 0


class Choices(NamedTuple):
    """What may be done next.

    Attributes:
        mask: 1 where an action is legal, shape (capacity,).
        prior: How likely the demonstrator makes each legal choice, shape (capacity,); sums to 1.
        novel: 1 where an action is legal though the demonstrator never did it here, (capacity,).
        refused: Slots that the demonstrator might choose and the robot cannot perform, and why.
        dead_end: Whether the demonstrator leaves nothing but holding.
    """

    mask: NDArray[np.int8]
    prior: FloatArray
    novel: NDArray[np.int8]
    refused: dict[int, tuple[str, ...]]
    dead_end: bool

    def mask_at(self, n_speeds: int) -> NDArray[np.int8]:
        """Return the mask of actions at so many speeds, a block each, fresh."""
        return self.mask.copy() if n_speeds == 1 else np.concatenate([self.mask] * n_speeds)

    def prior_at(self, n_speeds: int) -> FloatArray:
        """Return the prior of actions at so many speeds: that of the first, fresh."""
        if n_speeds == 1:
            return self.prior.copy()
        return np.concatenate((self.prior, np.zeros((n_speeds - 1) * len(self.prior))))

    def infeasible(self) -> NDArray[np.int8]:
        """Return 1 where a slot is refused, shape (capacity,), fresh."""
        infeasible = np.zeros(len(self.mask), np.int8)
        for slot in self.refused:
            infeasible[slot] = 1
        return infeasible


def drawn_slot(weights: FloatArray, rng: np.random.Generator) -> int:
    """Return a slot, drawn by weights of any sum above 0, shape (capacity,)."""
    total = np.cumsum(weights)
    slot = int(np.searchsorted(total, rng.random() * total[-1], side="right"))
    return min(slot, int(np.flatnonzero(weights)[-1]))


def choose_among(
    weights: Mapping[int, float],
    refused: Mapping[int, tuple[str, ...]],
    novel: tuple[int, ...],
    capacity: int,
) -> Choices:
    """Return the choices of a place in the graph; hold is always one.

    Args:
        weights: Slots that are observed and feasible, and how often they were chosen.
        refused: Slots that are observed and not feasible, and why.
        novel: Slots that are allowed though they were not observed here.
        capacity: Number of slots.
    """
    mask, unseen = np.zeros(capacity, np.int8), np.zeros(capacity, np.int8)
    prior = np.zeros(capacity)
    mask[HOLD] = 1
    for slot, weight in weights.items():
        mask[slot] = 1
        prior[slot] = weight
    for slot in novel:
        if not mask[slot]:
            mask[slot] = unseen[slot] = 1
    total = prior.sum()
    if total > 0:
        prior /= total
    else:
        prior[HOLD] = 1.0
    return Choices(mask, prior, unseen, dict(refused), bool(total == 0))

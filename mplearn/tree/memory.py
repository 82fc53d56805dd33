"""The segments that a tree remembers, and how much all motion varies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..recording import FloatArray, IntArray
from . import form
from .bank import ExemplarBank
from .config import TreeConfig
from .spread import ChannelSpread, DistanceSample

_RESCALE = 1.5  # models are made again when the variance of all motion has changed by this factor


class SegmentMemory:
    """Segments by number: frames, points and model; each is kept as long as something holds it.

    Args:
        config: Rules of the tree.
        groups: Group of each channel, shape (D,); a group shares one variance.

    Attributes:
        bank: Models of the segments, and the distances between them.
        frames: The segments as they came, shape (L, D) each.
    """

    def __init__(self, config: TreeConfig, groups: IntArray) -> None:
        self.config = config
        self.bank = ExemplarBank(config, len(groups), np.ones(len(groups)))
        self.frames: dict[int, FloatArray] = {}
        self._spread = ChannelSpread(groups)
        self._sample = DistanceSample(config.n_sampled, config.seed)
        self._holds: Counter[int] = Counter()

    def remember(self, number: int, frames: FloatArray) -> None:
        """Take up a segment, shape (L, D), held once."""
        points = form.points_of(frames, self.config.form)
        self._spread.update(points)
        if not self._sample.numbers:
            self.rescale()
        seen = form.centred(points, self.config.form)
        self.bank.add(number, self.bank.model(seen, len(frames)))
        self.frames[number] = frames
        self.hold(number)
        place = self._sample.place_for(number)
        if place is not None:
            self.hold(number)
            gone = self._sample.put(number, place, self.bank)
            if gone is not None:
                self.release(gone)

    def hold(self, *numbers: int) -> None:
        """Keep segments until they are released as often as they were held."""
        self._holds.update(numbers)

    def release(self, *numbers: int) -> None:
        """Let segments go; what nothing holds is forgotten."""
        self._holds.subtract(numbers)
        for number in numbers:
            if self._holds[number] == 0:
                del self._holds[number], self.frames[number]
                self.bank.drop(number)

    def rescale(self) -> bool:
        """Model all segments again where the variance of all motion has changed much.

        Returns:
            Whether that was done: distances among them have changed then.
        """
        floor = self.config.variance_floor**2 * self._spread.variances()
        change = floor / self.bank.floor
        if change.max() <= _RESCALE and change.min() >= 1 / _RESCALE:
            return False
        self.bank.refit(floor)
        self._sample.measure(self.bank)
        return True

    def scale(self) -> float:
        """Return the largest distance expected between executions of one motion."""
        return self._sample.scale(self.config.spread, self.config.mean_share)

    def variances(self) -> FloatArray:
        """Return the variance of each channel over all motion, shape (D,)."""
        return self._spread.own_variances()

    def state(self) -> dict[str, Any]:
        """Return everything as plain values and arrays, but for who holds what."""
        return {
            "spread": self._spread.state(),
            "sample": self._sample.state(),
            "bank": self.bank.state(),
            "frames": [self.frames[number].copy() for number in self.bank.numbers()],
        }

    def load_state(self, state: dict[str, Any], held: Iterable[int]) -> None:
        """Resume from what `state` returned; ``held`` are all numbers that are held, with repeats.

        The sample's own are added.
        """
        self._spread.load_state(state["spread"])
        self._sample.load_state(state["sample"])
        self.bank = ExemplarBank.from_state(self.config, state["bank"])
        self.frames = {
            number: np.array(frames, dtype=np.float64)
            for number, frames in zip(self.bank.numbers(), state["frames"], strict=True)
        }
        self._holds = Counter([*self._sample.numbers, *held])

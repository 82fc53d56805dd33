"""Models and distances of all segments made again, a little with each frame, beside those in use.

Where the variance of all motion has changed much, every model that the tree holds is to be made
again. With a thousand primitives that takes a second; no frame may wait for it. So the new models
and distances grow beside the old ones, and take their place at once at a frame that is fixed when
they are begun.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...recording import FloatArray
from ...state import Array, Range, State
from .bank import ExemplarBank

EFFORT = 120  # a frame's part of the work, in distances; about a millisecond
LATER = 6  # frames that a segment puts the end off for, which comes meanwhile
_MODEL = 20  # what a model costs, in distances


@dataclass(frozen=True, eq=False)
class RenewalState(State):
    """What is being made again: it follows from the segments.

    Attributes:
        floor: Smallest variance of each channel in the new models, shape (D,).
        frames_left: Frames until they take their place.
    """

    floor: Annotated[FloatArray, Array("d", low=1e-30)]
    frames_left: Annotated[int, Range(1)]


class Renewal:
    """New models and distances on their way.

    Args:
        bank: The models in use.
        floor: Smallest variance of each channel in the new ones, shape (D,).
        groups: Numbers of the segments among which distances are needed, by the group's key.
        frames_left: Frames until they take their place; as many as the work needs by default.
    """

    def __init__(
        self,
        bank: ExemplarBank,
        floor: FloatArray,
        groups: Mapping[int, Sequence[int]],
        frames_left: int | None = None,
    ) -> None:
        self.bank = ExemplarBank(bank.config, bank.n_channels, floor)
        self._old = bank
        self._waiting = bank.numbers()
        self._known: dict[int, tuple[list[int], FloatArray]] = {}
        self._behind = list(groups)  # groups that were not looked at yet, the last first
        rows = sum(len(numbers) for numbers in groups.values())
        pairs = sum(len(numbers) ** 2 for numbers in groups.values()) / 2
        work = _MODEL * len(self._waiting) + rows + pairs
        self.frames_left = frames_left or int(np.ceil(work / EFFORT)) + 1

    def add(self, number: int) -> None:
        """Take note of a segment that is remembered from now on."""
        self._waiting.append(number)
        self.frames_left += LATER

    def drop(self, number: int) -> None:
        """Take note of a segment that is forgotten."""
        if number in self.bank:
            self.bank.drop(number)
        else:
            self._waiting.remove(number)

    def work(self, groups: Mapping[int, Sequence[int]], effort: float = np.inf) -> None:
        """Do a part of the work, in distances."""
        while effort > 0:
            if self._waiting:
                self._model(self._waiting.pop())
                effort -= _MODEL
                continue
            if not self._behind:
                self._behind = self._changed(groups)
            if not self._behind:
                return
            effort -= self._measure(groups)

    def finish(self, groups: Mapping[int, Sequence[int]]) -> dict[int, FloatArray]:
        """Do what is left, let the new models be those in use, and return all distances."""
        self._behind = self._changed(groups)
        self.work(groups)
        self._old.take_over(self.bank)
        return {key: self._of(key, numbers) for key, numbers in groups.items()}

    def _changed(self, groups: Mapping[int, Sequence[int]]) -> list[int]:
        """Return the keys of groups in which a segment is not measured yet."""
        return [
            key
            for key, numbers in groups.items()
            if not set(numbers).issubset(self._known[key][0] if key in self._known else ())
        ]

    def _model(self, number: int) -> None:
        exemplar = self._old[number]
        new = self.bank.model(exemplar.columns.T, float(exemplar.duration))
        self.bank.add(number, new)

    def _measure(self, groups: Mapping[int, Sequence[int]]) -> float:
        """Measure the distances from one segment to others of its group; return how many."""
        key = self._behind[-1]
        numbers, matrix = self._known.get(key, ([], np.zeros((0, 0))))
        missing = _first_not_in(groups.get(key, ()), numbers)
        if missing is None:
            self._behind.pop()
            return 1.0
        kept = [i for i, number in enumerate(numbers) if number in self.bank]
        numbers = [numbers[i] for i in kept]
        row = self.bank.distances(self.bank[missing], numbers, without_tempo=key == SAMPLE)
        grown = np.zeros((len(numbers) + 1, len(numbers) + 1))
        grown[:-1, :-1] = matrix[np.ix_(kept, kept)]
        grown[-1, :-1] = grown[:-1, -1] = row
        self._known[key] = [*numbers, missing], grown
        return 1.0 + len(numbers)

    def _of(self, key: int, numbers: Sequence[int]) -> FloatArray:
        known, matrix = self._known.get(key, ([], np.zeros((0, 0))))
        if known == list(numbers):
            return matrix
        places = [known.index(number) for number in numbers]
        return np.asarray(matrix[np.ix_(places, places)])


SAMPLE = -1  # key of the sample of all motion, whose distances are those of forms


def _first_not_in(numbers: Iterable[int], known: Sequence[int]) -> int | None:
    return next((number for number in numbers if number not in known), None)

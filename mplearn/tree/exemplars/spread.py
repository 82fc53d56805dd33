"""Running statistics of all motion ever seen, in bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...maths.compiling import njit
from ...recording import FloatArray, IntArray
from ...state import Array, Blob, SharedState, State, require
from ..config import TreeConfig
from .bank import ExemplarBank

_COPY = 0.01  # over the mean distance: who comes as near plays back; people do not


@dataclass(frozen=True, eq=False)
class SpreadState(State):
    """Values seen in each channel, their mean, and the squares of their deviations, shape (D,)."""

    count: Annotated[FloatArray, Array("d", low=0.0)]
    mean: Annotated[FloatArray, Array("d")]
    squares: Annotated[FloatArray, Array("d", low=0.0)]


@dataclass(frozen=True, eq=False)
class SampleState(SharedState):
    """A sample of the segments, and the distances among them.

    Attributes:
        numbers: Their numbers, shape (n,).
        frames: The segments as they came, shape (L, D) each.
        matrix: The distances, shape (n, n).
    """

    numbers: Annotated[IntArray, Array("n", low=0)]
    frames: tuple[Annotated[Blob, Array(None, "d", nan=True)], ...]
    matrix: Annotated[FloatArray, Array("n", "n", low=0.0)]

    def check(self) -> None:
        """Check that each segment is there once, with its frames."""
        require(len(set(self.numbers.tolist())) == len(self.numbers), "numbers", "must differ")
        require(
            len(self.frames) == len(self.numbers), "frames", f"must be {len(self.numbers)} segments"
        )
        require(np.array_equal(self.matrix, self.matrix.T), "matrix", "must be symmetric")


class ChannelSpread:
    """Running variance of each channel over the points of all segments.

    Args:
        groups: Group of each channel, shape (D,); a group shares one variance.
    """

    def __init__(self, groups: IntArray) -> None:
        self.groups = groups
        self._count = np.zeros(len(groups))
        self._mean = np.zeros(len(groups))
        self._squares = np.zeros(len(groups))

    def update(self, points: FloatArray) -> None:
        """Take the points of a segment, shape (P, D); NaN counts for nothing."""
        _update(points, self._count, self._mean, self._squares)

    def own_variances(self) -> FloatArray:
        """Return each channel's own variance, shape (D,)."""
        variance = self._squares / np.maximum(self._count, 1)
        return np.asarray(np.maximum(variance, max(1e-6 * float(variance.max()), 1e-18)))

    def variances(self) -> FloatArray:
        """Return the mean variance of each channel's group, shape (D,)."""
        variance = self._squares / np.maximum(self._count, 1)
        shared = np.bincount(self.groups, variance) / np.maximum(np.bincount(self.groups), 1)
        return np.asarray(np.maximum(shared[self.groups], 1e-18))

    def state(self) -> SpreadState:
        """Return everything."""
        return SpreadState(self._count.copy(), self._mean.copy(), self._squares.copy())

    def load_state(self, state: SpreadState) -> None:
        """Resume from what `state` returned."""
        self._count, self._mean = state.count.copy(), state.mean.copy()
        self._squares = state.squares.copy()


class DistanceSample:
    """A uniform sample of all segments ever seen, and the distances among them.

    Args:
        size: Segments in the sample.
        seed: Seed of the choice.
    """

    def __init__(self, size: int, seed: int) -> None:
        self.size = size
        self.seed = seed
        self.numbers: list[int] = []
        self._matrix = np.zeros((size, size))
        self._next: tuple[int, int | None] = 0, 0
        self._forget()

    def _forget(self) -> None:
        """Let go of what follows from the distances, which have changed."""
        self._state: SampleState | None = None
        self._mean: float | None = None
        self._scale: tuple[TreeConfig, float] | None = None

    def place_for(self, n_seen: int) -> int | None:
        """Return where in the sample the segment after ``n_seen`` others goes; None: nowhere.

        Whoever asks before the segment is there has it at once then.
        """
        if len(self.numbers) < self.size:
            return len(self.numbers)
        if self._next[0] != n_seen:
            place = int(np.random.default_rng((self.seed, n_seen)).integers(n_seen + 1))
            self._next = n_seen, place if place < self.size else None
        return self._next[1]

    def put(self, number: int, place: int, bank: ExemplarBank) -> int | None:
        """Put a segment at a place; return the number of the one that goes."""
        gone = self.numbers[place] if place < len(self.numbers) else None
        if gone is None:
            self.numbers.append(number)
        else:
            self.numbers[place] = number
        row = bank.distances(bank[number], self.numbers, without_tempo=True)
        row[place] = 0.0
        self._matrix[place, : len(row)] = self._matrix[: len(row), place] = row
        self._forget()
        return gone

    def measure(self, bank: ExemplarBank) -> None:
        """Measure all distances again."""
        self._matrix[: len(self.numbers), : len(self.numbers)] = bank.matrix(
            self.numbers, without_tempo=True
        )
        self._forget()

    def remeasured(self, matrix: FloatArray) -> None:
        """Take over distances that were measured again, shape (n, n)."""
        self._matrix[: len(matrix), : len(matrix)] = matrix
        self._forget()

    def mean(self) -> float:
        """Return the mean distance; 0 where there is none."""
        if self._mean is None:
            n = len(self.numbers)
            self._mean = float(self._matrix[:n, :n].sum() / max(n * (n - 1), 1))
        return self._mean

    def scale(self, config: TreeConfig) -> float:
        """Return the largest distance expected between executions of one motion.

        Once motions recur, most segments have another of their kind for a nearest neighbour.

        A motion's executions lie about as far apart as nearest neighbours do; where those are very
        near, as in a recording played twice, or far, as in a person's free motion, the scale
        follows with a power below 1.
        """
        if self._scale is None or self._scale[0] is not config:
            self._scale = config, self._measured_scale(config)
        return self._scale[1]

    def _measured_scale(self, config: TreeConfig) -> float:
        n = len(self.numbers)
        matrix, mean = self._matrix[:n, :n], self.mean()
        apart = np.where(matrix > _COPY * mean, matrix, np.inf)
        nearest = apart.min(axis=1, initial=np.inf)
        nearest = nearest[np.isfinite(nearest)]
        if not len(nearest):
            return 0.0
        quartile = float(np.percentile(nearest, 25))
        likeness = max(quartile / mean, config.scale_floor)
        share = config.scale_share * likeness**config.scale_power
        return float(min(config.spread * quartile, min(share, config.mean_share) * mean))

    def state(self, blob_of: Callable[[int], Blob]) -> SampleState:
        """Return everything, with the frames of the segments."""
        if self._state is None:
            n = len(self.numbers)
            self._state = SampleState(
                np.array(self.numbers, np.int64),
                tuple(map(blob_of, self.numbers)),
                self._matrix[:n, :n].copy(),
            )
        return self._state

    def load_state(self, state: SampleState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: The sample is larger than this one may be.
        """
        n = len(state.numbers)
        require(n <= self.size, "numbers", f"must be at most {self.size}, not {n}")
        self.numbers = state.numbers.tolist()
        self._matrix = np.zeros((self.size, self.size))
        self._matrix[:n, :n] = state.matrix
        self._forget()
        self._state = state


@njit(cache=True)
def _update(points: FloatArray, count: FloatArray, mean: FloatArray, squares: FloatArray) -> None:
    """Take points, shape (P, D), into counts, means and squared deviations, shape (D,) each."""
    for d in range(len(count)):
        n, total = 0, 0.0
        for value in points[:, d]:
            if value == value:
                n += 1
                total += value
        if not n:
            continue
        new, deviations = total / n, 0.0
        for value in points[:, d]:
            if value == value:
                deviations += (value - new) * (value - new)
        step, share = new - mean[d], n / (count[d] + n)
        squares[d] += deviations + step * step * count[d] * share
        mean[d] += step * share
        count[d] += n


def moments(matrix: FloatArray) -> tuple[float, float]:
    """Return mean and standard deviation of the distances in a matrix; NaN where there are none."""
    distances = pairs(matrix)
    if not len(distances):
        return float("nan"), float("nan")
    return float(distances.mean()), float(distances.std())


def pairs(matrix: FloatArray) -> FloatArray:
    """Return the distances of a symmetric matrix once each, as scipy's condensed form."""
    return np.asarray(matrix[np.triu_indices(len(matrix), 1)])


def without(matrix: FloatArray, gone: Sequence[int]) -> FloatArray:
    """Return a matrix without some of its rows and columns."""
    kept = [i for i in range(len(matrix)) if i not in gone]
    return np.asarray(matrix.take(kept, axis=0).take(kept, axis=1))

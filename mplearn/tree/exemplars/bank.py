"""The segments that the tree remembers, each with its model, and the distances between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...hmm import fit
from ...hmm.em import Parameters, em_of_each
from ...hmm.kernels import log_norms
from ...recording import FloatArray, IntArray
from ...state import Array, State, require
from ..config import TreeConfig
from ..distance import Exemplar, make_distance, own_scores
from . import normalisation
from .slot_arrays import SlotArrays

AT_ONCE = 128  # segments that are modelled together

_PRIOR = 1.0  # transitions of either kind added to each state's count
_STEEPNESS = 4.0  # a segment twice as long, as two motions in one are, is three times as far
_KNOWN = 16384  # divergences among exemplars of leaves that are kept to be asked for again


@dataclass(frozen=True, eq=False)
class BankState(State):
    """Exemplars by number: what is compared; models follow from it.

    Attributes:
        floor: Smallest variance of each channel, shape (D,).
        numbers: Their numbers, shape (n,).
        columns: Their points, shape (n, D, P).
        duration: How long each lasted [frame], shape (n,).
    """

    floor: Annotated[FloatArray, Array("d", low=1e-30)]
    numbers: Annotated[IntArray, Array("n", low=0)]
    columns: Annotated[FloatArray, Array("n", "d", None, nan=True)]
    duration: Annotated[FloatArray, Array("n", low=1e-6)]

    def check(self) -> None:
        """Check that no number comes twice."""
        require(len(set(self.numbers.tolist())) == len(self.numbers), "numbers", "must differ")


class ExemplarBank:
    """Exemplars by number: points and a model each.

    Args:
        config: Rules of the tree.
        n_channels: D.
        floor: Smallest variance of each channel, shape (D,).

    Attributes:
        distance: How far exemplars are apart.
        floor: Those variances; another array takes their place, they are not written to.
    """

    def __init__(self, config: TreeConfig, n_channels: int, floor: FloatArray) -> None:
        self.config = config
        self.n_channels = n_channels
        self.floor = np.array(floor, dtype=np.float64)
        self.distance = make_distance(config)
        self._weights = normalisation.weights(config.normalisation)
        self._roots = np.sqrt(self._weights)
        self._slots: dict[int, int] = {}
        self._latest: tuple[int, Exemplar | None] = -1, None
        self._levelled: tuple[FloatArray, FloatArray] | None = None
        self._met = np.zeros(0)  # divergences of the latest from what is in each slot, NaN: unknown
        self._among: dict[tuple[int, int], float] = {}  # divergences by numbers, see `across`
        per_state, per_transition = (config.n_states, n_channels), (config.n_states,)
        self._arrays = SlotArrays(
            (n_channels, config.normalisation.n_points),
            *(per_state, per_state),
            *(per_transition, per_transition, per_transition),
            *((), (), ()),
        )

    def __contains__(self, number: int) -> bool:
        """Whether the exemplar is remembered."""
        return number in self._slots

    def numbers(self) -> list[int]:
        """Return the numbers of all exemplars, in the order of their arrival."""
        return sorted(self._slots)

    def __getitem__(self, number: int) -> Exemplar:
        """Return an exemplar."""
        number_of_latest, latest = self._latest
        if number == number_of_latest and latest is not None:
            return latest
        return Exemplar(*self._arrays.read(self._slots[number]))

    def model(self, points: FloatArray, duration: float = 1.0) -> Exemplar:
        """Model the points of a segment, shape (P, D); the bank does not remember it.

        Its duration may be in any unit; by default all last equally long.

        They are rounded to single precision first, so that a stored recogniser is small and yet
        decides as the tree does.

        Raises:
            ModelError: A channel is missing throughout.
        """
        return self.models([points], [duration])[0]

    def models(self, points: Sequence[FloatArray], durations: Sequence[float]) -> list[Exemplar]:
        """Model the points of some segments, shape (P, D) each, as `model` does; quicker at once.

        Raises:
            ModelError: A channel of one is missing throughout.
        """
        if not points:
            return []
        found = self._models(np.stack(points), np.array(durations))
        return [Exemplar(*(part[k, ...] for part in found)) for k in range(len(points))]

    def _models(self, points: FloatArray, durations: FloatArray) -> Exemplar:
        """Model many segments at once, shapes (n, P, D) and (n,), stacked; see above."""
        points = points.astype(np.float32, order="C").astype(np.float64)
        if not np.isfinite(self.config.extent_share):  # nothing asks for it
            return self._modelled(points, durations)
        n = len(points)
        postures = normalisation.mean_postures(points, self.config.normalisation)
        still = np.broadcast_to(postures[:, None], points.shape)
        both = self._modelled(np.concatenate([points, still]), np.tile(durations, 2))
        own, held = (Exemplar(*(part[at] for part in both)) for at in (slice(n), slice(n, None)))
        own.extent[:] = self.distance.length(self.distance.pairwise(own, held, self._weights))
        return own

    def _modelled(self, points: FloatArray, durations: FloatArray) -> Exemplar:
        """Model points as they are; how far they are from standing still is not known yet.

        As `fit` in one step does, but for its checks, which take longer than the kernels.
        """
        n, n_states, weights = len(points), self.config.n_states, self._weights
        points, columns = np.ascontiguousarray(points), points.transpose(0, 2, 1).copy()
        shapes = (n, n_states, self.n_channels), (n, n_states)
        models = Parameters(*(np.zeros(shapes[k]) for k in (0, 0, 1, 1)))
        likelihoods = em_of_each(points, columns, weights, self.floor, _PRIOR, models)
        for k in np.flatnonzero(~np.isfinite(likelihoods + models.means[:, 0].sum(axis=1))):
            floor = self.floor  # says what is wrong
            fit([points[k]], n_states, weights=[weights], n_steps=1, variance_floor=floor)
        models.log_next[:, :-1] = np.log(-np.expm1(models.log_stay[:, :-1]))
        variances = models.variances.reshape(-1, self.n_channels)
        norms = log_norms(variances).sum(axis=1).reshape(n, n_states)
        gaussians = models.means, models.variances, norms
        chains = models.log_stay, models.log_next
        rest = np.zeros(n), durations.astype(np.float64), np.full(n, np.inf)
        exemplars = Exemplar(columns, *gaussians, *chains, *rest)
        return exemplars._replace(own=own_scores(exemplars, weights))

    def prepare(self) -> None:
        """Have memory for an exemplar more."""
        self._arrays.prepare()

    def add(self, number: int, exemplar: Exemplar) -> None:
        """Remember an exemplar."""
        self._slots[number] = self._arrays.take()
        self._arrays.write(self._slots[number], exemplar)
        self._latest = -1, None
        self._latest = number, self[number]
        self._met = np.full(self._arrays.n_slots, np.nan)

    def add_modelled(
        self, numbers: Sequence[int], points: FloatArray, durations: FloatArray
    ) -> None:
        """Model many segments, shapes (n, P, D) and (n,), as `model` does, and remember them.

        Raises:
            ModelError: A channel of one is missing throughout; none is remembered.
        """
        exemplars = self._models(points, durations)
        slots = [self._arrays.take() for _ in numbers]
        self._slots |= zip(numbers, slots, strict=True)
        self._arrays.write_all(np.array(slots, np.int64), exemplars)
        self._latest = -1, None

    def drop(self, number: int) -> None:
        """Forget an exemplar."""
        slot = self._slots.pop(number)
        self._arrays.release(slot)
        if slot < len(self._met):
            self._met[slot] = np.nan
        if number == self._latest[0]:
            self._latest = -1, None

    def take_over(self, other: ExemplarBank) -> None:
        """Hold what another bank holds, from now on instead of it."""
        self.floor, self._slots, self._arrays = other.floor, other._slots, other._arrays
        self._latest, self._among = (-1, None), {}

    def profile(self, exemplar: Exemplar) -> FloatArray:
        """Return the points times the root of their weights, shape (D * P,); 0 where missing."""
        columns = exemplar.columns
        if np.isnan(columns.sum()):
            columns = np.nan_to_num(columns)
        return np.asarray((columns * self._roots).ravel())

    def mean_profile(self, numbers: Sequence[int]) -> FloatArray:
        """Return the mean profile of some exemplars, shape (D * P,)."""
        columns = self._arrays.gather(self._slots_of(numbers), _COLUMNS)
        mean = columns.mean(axis=0)
        if np.isnan(mean.sum()):
            mean = np.nan_to_num(columns).mean(axis=0)
        return np.asarray((mean * self._roots).ravel())

    def distances(
        self, exemplar: Exemplar, others: Sequence[int], *, without_tempo: bool = False
    ) -> FloatArray:
        """Return how far an exemplar is from others of the bank, shape (k,).

        It is the length of their distance (`Distance.length`); it grows where one lasts longer than
        the other by more than motions do, unless tempo does not count. What was measured of the
        latest that came is not measured again.
        """
        slots = self._slots_of(others)
        raw = self._raw(exemplar, slots)
        return self._lengths(raw, exemplar.duration, slots, without_tempo=without_tempo)

    def across(
        self, numbers: Sequence[int], others: Sequence[int], *, without_tempo: bool = False
    ) -> FloatArray:
        """Return the `distances` of exemplars from others, shape (k, l).

        What leaves are judged by is asked for again whenever one more comes to them: what was
        measured then is not measured again.
        """
        slots = self._slots_of(others)
        rows = [self._divergences_of(number, others) for number in numbers]
        durations = self._arrays.gather(self._slots_of(numbers), _DURATION)
        return self._lengths(np.array(rows), durations[:, None], slots, without_tempo=without_tempo)

    def _divergences_of(self, number: int, others: Sequence[int]) -> list[float]:
        """Return the divergences of an exemplar from others, shape (l,), some of them known."""
        pairs = [(min(number, other), max(number, other)) for other in others]
        missing = [k for k, pair in enumerate(pairs) if pair not in self._among]
        if missing:
            if len(self._among) > _KNOWN:
                self._among = {}
                missing = list(range(len(pairs)))
            found = self._raw(self[number], self._slots_of([others[k] for k in missing]))
            self._among.update(zip((pairs[k] for k in missing), found.tolist(), strict=True))
        return [self._among[pair] for pair in pairs]

    def _lengths(
        self, raw: FloatArray, duration: FloatArray, slots: IntArray, *, without_tempo: bool
    ) -> FloatArray:
        """Return divergences as distances, which grow where durations differ by much."""
        distances = self.distance.length(raw)
        if not without_tempo and np.isfinite(self.config.tempo):
            other = self._arrays.gather(slots, _DURATION)
            beyond = np.maximum(duration, other) / np.minimum(duration, other) / self.config.tempo
            distances *= np.maximum(beyond, 1.0) ** _STEEPNESS
        return np.asarray(distances)

    def _raw(self, exemplar: Exemplar, slots: IntArray) -> FloatArray:
        """Return divergences, shape (k,); those of the latest as far as they are known."""
        if exemplar is not self._latest[1]:
            return self._divergences(exemplar, slots)
        unknown = slots[np.isnan(self._met[slots])]
        if len(unknown):
            self._met[unknown] = self._divergences(exemplar, unknown)
        return np.asarray(self._met[slots])

    def _divergences(self, exemplar: Exemplar, slots: IntArray) -> FloatArray:
        found = np.empty(len(slots))
        for arrays, rows, here in self._arrays.parted(slots):
            found[here] = self.distance.divergence(exemplar, Exemplar(*arrays), rows, self._weights)
        return found

    def without_tempo(self, numbers: Sequence[int], matrix: FloatArray) -> FloatArray:
        """Return the distances that exemplars have without tempo, given those with it, (k, k).

        What was asked last is known; distances that change are another matrix.
        """
        if self._levelled is None or self._levelled[0] is not matrix:
            self._levelled = matrix, self._without_tempo(numbers, matrix)
        return self._levelled[1]

    def _without_tempo(self, numbers: Sequence[int], matrix: FloatArray) -> FloatArray:
        durations = self._arrays.gather(self._slots_of(numbers), _DURATION)
        beyond = np.maximum.outer(durations, durations) / np.minimum.outer(durations, durations)
        rows, others = np.nonzero(np.triu(beyond / self.config.tempo > 1.0))
        if len(rows):
            matrix = matrix.copy()
        for i in np.unique(rows).tolist():
            group = others[rows == i]
            row = self.across([numbers[i]], [numbers[j] for j in group], without_tempo=True)
            matrix[i, group] = matrix[group, i] = row[0]
        return matrix

    def matrix(self, numbers: Sequence[int], *, without_tempo: bool = False) -> FloatArray:
        """Return the distances among exemplars, shape (k, k)."""
        matrix = np.zeros((len(numbers), len(numbers)))
        for i, number in enumerate(numbers[1:], start=1):
            row = self.distances(self[number], numbers[:i], without_tempo=without_tempo)
            matrix[i, :i] = matrix[:i, i] = row
        return matrix

    def extents(self, numbers: Sequence[int]) -> FloatArray:
        """Return how far exemplars are from standing still, shape (k,)."""
        return self._arrays.gather(self._slots_of(numbers), _EXTENT)

    def fork(self) -> ExemplarBank:
        """Return a bank that holds the same, and goes on apart; what neither changes is shared."""
        twin = copy(self)
        twin._slots, twin._arrays = dict(self._slots), self._arrays.fork()
        twin._latest, twin._among = (-1, None), {}
        return twin

    def state(self, numbers: Iterable[int]) -> BankState:
        """Return some of the exemplars."""
        numbers = sorted(numbers)
        slots = self._slots_of(numbers)
        return BankState(
            self.floor.copy(),
            np.array(numbers, np.int64),
            self._arrays.gather(slots, _COLUMNS),
            self._arrays.gather(slots, _DURATION),
        )

    @classmethod
    def from_state(cls, config: TreeConfig, state: BankState) -> ExemplarBank:
        """Return the bank that `state` described.

        Raises:
            ModelError: A channel of an exemplar is missing throughout.
        """
        bank = cls(config, len(state.floor), state.floor)
        numbers, points = state.numbers.tolist(), state.columns.transpose(0, 2, 1)
        for k in range(0, len(numbers), AT_ONCE):
            here = slice(k, k + AT_ONCE)
            bank.add_modelled(numbers[here], points[here], state.duration[here])
        return bank

    def _slots_of(self, numbers: Sequence[int]) -> IntArray:
        return np.array([self._slots[number] for number in numbers], dtype=np.int64)


_COLUMNS = Exemplar._fields.index("columns")
_DURATION = Exemplar._fields.index("duration")
_EXTENT = Exemplar._fields.index("extent")

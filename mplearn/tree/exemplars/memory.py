"""The segments that a tree remembers, and how much all motion varies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ...errors import ModelError
from ...recording import FloatArray, IntArray
from ...state import Blob, within
from ..config import TreeConfig
from . import normalisation
from .bank import AT_ONCE, ExemplarBank
from .neighbours import Neighbours
from .renewal import EFFORT, SAMPLE, Renewal, RenewalState
from .spread import ChannelSpread, DistanceSample, SampleState, SpreadState

FOLLOWING = 512  # segments of which it is known: by default 200 wait

_RESCALE = 1.5  # models are made again when the variance of all motion has changed by this factor


class SegmentMemory:
    """Segments by number: frames, points and model; each is kept as long as something holds it.

    Args:
        config: Rules of the tree.
        groups: Group of each channel, shape (D,); a group shares one variance.

    Attributes:
        bank: Models of the segments, and the distances between them.
        frames: The segments as they came, shape (L, D) each.
        neighbours: How near new segments come to known ones.
        renewal: The models on their way that will take the place of these; None for none.
        follows: Numbers of the latest segments that began where the one before them ended, rising.
    """

    def __init__(self, config: TreeConfig, groups: IntArray) -> None:
        self.config = config
        self.bank = ExemplarBank(config, len(groups), np.ones(len(groups)))
        self.frames: dict[int, FloatArray] = {}
        self._blobs: dict[int, Blob] = {}
        self._spread = ChannelSpread(groups)
        self._sample = DistanceSample(config.n_sampled, config.seed)
        self._holds: Counter[int] = Counter()
        self.neighbours = Neighbours()
        self.renewal: Renewal | None = None
        self.follows: list[int] = []

    def remember(self, number: int, frames: FloatArray, *, follows: bool = False) -> None:
        """Take up a segment, shape (L, D), held once; it is not written to from now on.

        It may begin where the one before it ended.
        """
        if follows:
            self.follows = [*self.follows[1 - FOLLOWING :], number]
        points = normalisation.points_of(frames, self.config.normalisation)
        self._spread.update(points)
        if not self._sample.numbers:
            floor = self.updated_floor()
            self.bank.floor = self.bank.floor if floor is None else floor
        seen = normalisation.centred(points, self.config.normalisation)
        self.bank.add(number, self.bank.model(seen, len(frames)))
        if self.renewal is not None:
            self.renewal.add(number)
        self.frames[number] = frames
        self.hold(number)
        place = self._sample.place_for(number)
        if place is not None:
            self.hold(number)
            gone = self._sample.put(number, place, self.bank)
            if gone is not None:
                self.release(gone)

    def prepare(self, number: int) -> None:
        """Do what takes long and can be done before a segment is there."""
        self._sample.place_for(number)
        self.bank.prepare()

    def goes_on(self, number: int) -> bool:
        """Return whether a segment and the next are held, and that began where this one ended."""
        return {number, number + 1} <= self.frames.keys() and number + 1 in self.follows

    def recall(self, number: int, frames: Blob) -> None:
        """Take up a segment again that may be forgotten by now, held once."""
        if number not in self.frames:
            self._model(number, frames.array)
            self._blobs[number] = frames
            if self.renewal is not None:
                self.renewal.add(number)
        self.hold(number)

    def hold(self, *numbers: int) -> None:
        """Keep segments until they are released as often as they were held."""
        self._holds.update(numbers)

    def release(self, *numbers: int) -> None:
        """Let segments go; what nothing holds is forgotten."""
        self._holds.subtract(numbers)
        for number in dict.fromkeys(numbers):
            if self._holds[number] == 0:
                del self._holds[number], self.frames[number]
                self._blobs.pop(number, None)
                self.bank.drop(number)
                if self.renewal is not None:
                    self.renewal.drop(number)

    def updated_floor(self) -> FloatArray | None:
        """Return the variance floor of new models, if that of all motion has changed much."""
        floor = self.config.variance_floor**2 * self._spread.variances()
        change = floor / self.bank.floor
        if change.max() <= _RESCALE and change.min() >= 1 / _RESCALE:
            return None
        return floor

    def renew(self, floor: FloatArray, groups: Mapping[int, Sequence[int]]) -> None:
        """Begin to make all models and distances again.

        Args:
            floor: Smallest variance of each channel in them, shape (D,).
            groups: Numbers of the segments in each node, by its id.
        """
        self.renewal = Renewal(self.bank, floor, self._all(groups))

    def get_on(self, groups: Mapping[int, Sequence[int]]) -> dict[int, FloatArray] | None:
        """Do a frame's part of that; return the new distances in each node once all is ready."""
        assert self.renewal is not None
        self.renewal.frames_left -= 1
        if self.renewal.frames_left > 0:
            self.renewal.work(self._all(groups), EFFORT)
            return None
        return self.get_done(groups)

    def get_done(self, groups: Mapping[int, Sequence[int]]) -> dict[int, FloatArray]:
        """Do all that is left of it now."""
        assert self.renewal is not None
        matrices = self.renewal.finish(self._all(groups))
        self._sample.remeasured(matrices.pop(SAMPLE))
        self.renewal = None
        return matrices

    def _all(self, groups: Mapping[int, Sequence[int]]) -> dict[int, Sequence[int]]:
        return {SAMPLE: self._sample.numbers, **groups}

    def measure(self) -> None:
        """Measure the distances in the sample again."""
        self._sample.measure(self.bank)

    def scale(self) -> float:
        """Return the largest distance expected between executions of one motion."""
        return min(self._sample.scale(self.config), self.valley())

    def valley(self) -> float:
        """Return the distance at which other motions begin; inf where that is not asked for."""
        rise = self.config.rise
        return self.neighbours.valley(rise) * self._sample.mean() if np.isfinite(rise) else np.inf

    def meet(self, distances: FloatArray) -> None:
        """Take note of how far a new segment is from known ones, shape (k,)."""
        mean = self._sample.mean()
        if mean > 0:
            self.neighbours.update(distances / mean)

    def variances(self) -> FloatArray:
        """Return the variance of each channel over all motion, shape (D,)."""
        return self._spread.own_variances()

    def blob(self, number: int) -> Blob:
        """Return the frames of a segment as a part that is kept once, by its content."""
        if number not in self._blobs:
            self._blobs[number] = Blob(self.frames[number])
        return self._blobs[number]

    def spread(self) -> SpreadState:
        """Return the state of the running statistics."""
        return self._spread.state()

    def sample(self) -> SampleState:
        """Return the state of the sample of all segments."""
        return self._sample.state(self.blob)

    def renewal_state(self) -> RenewalState | None:
        """Return the state of the models on their way."""
        if self.renewal is None:
            return None
        return RenewalState(self.renewal.bank.floor.copy(), self.renewal.frames_left)

    def load_renewal(self, state: RenewalState, groups: Mapping[int, Sequence[int]]) -> None:
        """Resume what `renewal_state` returned, after `load`."""
        self.renewal = Renewal(self.bank, state.floor, self._all(groups), state.frames_left)

    def load(
        self,
        floor: FloatArray,
        spread: SpreadState,
        sample: SampleState,
        held: Iterable[tuple[int, Blob]],
    ) -> None:
        """Remember what was remembered before; models follow from the frames and the floor.

        Args:
            floor: Smallest variance of each channel, shape (D,).
            spread: The running statistics.
            sample: The sample; its segments are held, too.
            held: Numbers and frames of all that others hold, with repeats.

        Raises:
            StateError: A segment cannot be modelled.
        """
        self._spread.load_state(spread)
        with within("sample"):
            self._sample.load_state(sample)
        held = [*zip(self._sample.numbers, sample.frames, strict=True), *held]
        self._holds = Counter(number for number, _ in held)
        self._blobs = dict(sorted(dict(held).items()))
        self.frames = {}
        self.bank = ExemplarBank(self.config, len(floor), floor)
        known = [(number, blob.array) for number, blob in self._blobs.items()]
        for k in range(0, len(known), AT_ONCE):
            self._model_all(known[k : k + AT_ONCE])

    def _model_all(self, segments: Sequence[tuple[int, FloatArray]]) -> None:
        """Model many segments at once, which is quicker."""
        config = self.config.normalisation
        points = normalisation.points_of_each([frames for _, frames in segments], config)
        lengths = np.array([len(frames) for _, frames in segments])
        seen = normalisation.centred(points, config)
        try:
            self.bank.add_modelled([number for number, _ in segments], seen, lengths)
        except ModelError:
            for number, frames in segments:
                with within(f"segment {number}"):  # says which
                    self._model(number, frames)
            raise
        self.frames |= segments

    def _model(self, number: int, frames: FloatArray) -> None:
        seen = normalisation.normalised(frames, self.config.normalisation)
        self.bank.add(number, self.bank.model(seen, len(frames)))
        self.frames[number] = frames

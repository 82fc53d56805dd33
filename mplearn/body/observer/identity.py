"""Who stands there: people are told apart by distances within their own bodies.

The distances between markers on one segment (`rigid`) hardly change while a person moves, and
differ from one person to the next by millimetres to centimetres; in a frame where another body
stands there, most of them change at once. That raises a doubt. What is seen over the next tenth of
a second is then held against what could explain it: nothing has changed; it is somebody known; it
is somebody new; it is no body at all. How much the distances vary with
posture is learned from the people themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import BoolArray, FloatArray
from mplearn.state import Count, Range, State, require, within

from ..inverse_kinematics.first_posture import LARGEST, SMALLEST
from ..marker_sets.rigid import (
    ABSENT,
    FULL,
    IN_DOUBT,
    NOISE,
    SHAKE,
    Memory,
    Rules,
    distances_of,
    follow_steadily,
    goes_on,
    jumped,
    middle_of,
    rigid_pairs,
    usual_distances,
)
from .known_bodies import BodiesState, KnownBodies
from .known_bodies import IdentityConfig as IdentityConfig


@dataclass(frozen=True, eq=False)
class IdentityState(State):
    """Who stands there, and who is known.

    Attributes:
        person: Number of the person, -1 before anybody came.
        strikes: Blocks in a row that fitted somebody else better.
        memory: What was seen lately.
        bodies: What is known of people.
    """

    person: Annotated[int, Range(-1)]
    strikes: Count
    memory: Memory
    bodies: BodiesState

    def check(self) -> None:
        """Check that the person is known."""
        n = self.bodies.n_people
        require(self.person < n or self.person < 0, "person", f"must be below {n}")


class BodyIdentity:
    """Tells people apart by their bodies, and remembers them.

    Args:
        marker_names: Names of the M markers of every frame, of a known set.
        rate_hz: Frames per second [1/s].
        config: What is assumed.

    Attributes:
        person: Number of the person who stands there, 0, 1, ... in the order of their coming; -1
            before anybody came.
        bodies: What is known of people.

    Raises:
        BodyError: The markers belong to no known set.
    """

    def __init__(
        self, marker_names: Sequence[str], rate_hz: float, config: IdentityConfig | None = None
    ) -> None:
        self.config = config or IdentityConfig()
        self.rate_hz = float(rate_hz)
        self._pairs, give = rigid_pairs(marker_names)
        self._usual = usual_distances(marker_names, self._pairs)
        self._n_markers = len(marker_names)
        self.person = -1
        self.bodies = KnownBodies(give, self.config)
        self._rules = Rules(
            quick=1.0 - float(np.exp(-1.0 / (self.config.memory_s * rate_hz))),
            slow=1.0 - float(np.exp(-1.0 / (2.0 * rate_hz))),
            reach_m=self.config.fastest_m_s / rate_hz,
            absent_frames=self.config.absent_s * rate_hz,
            block_frames=self.config.block_s * rate_hz,
        )
        self.leave()

    @property
    def n_people(self) -> int:
        """How many people are known."""
        return self.bodies.n_people

    @property
    def look_frames(self) -> int:
        """Frames of a doubt, before it is decided."""
        return max(4, round(self.config.look_s * self.rate_hz))

    @property
    def places(self) -> FloatArray:
        """Each marker as last seen without doubt, shape (M, 3) [m]; NaN where never."""
        return self._memory.places

    def leave(self) -> None:
        """Forget what stands there now, but nobody who was known."""
        self.person = -1
        self._memory = Memory.empty(self._n_markers, len(self._pairs))
        self._strikes = 0

    def follow(self, frames: FloatArray) -> int:
        """Take frames, shape (T, M, 3), up to the first in which another body may stand there.

        Returns:
            How many frames were taken; the next one, if there is one, is in doubt, and was not.
        """
        done = 0
        while done < len(frames):
            n, why = follow_steadily(frames[done:], self._pairs, self._memory, self._rules)
            done += n
            if why == IN_DOUBT:
                break
            if why == FULL and self._fits_another():
                return done - 1
        return done

    def returned(self, frames: FloatArray) -> bool:
        """Say whether frames in doubt, shape (k, M, 3), end as what came before them went on."""
        last = max(2, round(self.config.back_s * self.rate_hz))
        return len(frames) > last and all(
            goes_on(frames[k], self._pairs, self._memory, self._rules, k, 0.25)
            for k in range(len(frames) - last, len(frames))
        )

    def went_on(self, frames: FloatArray) -> bool:
        """Say whether most frames, shape (k, M, 3), go on from what came before them."""
        rules = self._pairs, self._memory, self._rules
        return 2 * sum(goes_on(each, *rules, k, 0.5) for k, each in enumerate(frames)) > len(frames)

    def decide(self, frames: FloatArray) -> int | None:
        """Say who stands there after a doubt.

        Args:
            frames: What was seen since, shape (k, M, 3) [m].

        Returns:
            The number of a known person; `n_people` for somebody new; `NOBODY` where no body is
            seen; None if too little is seen.
        """
        seen = self._distances(frames)
        if 3 * np.count_nonzero((seen == seen).any(axis=0)) < seen.shape[1]:
            return None
        middle = middle_of(seen)
        noise = 0.5 * np.pi * _variance(seen, middle) / np.maximum((seen == seen).sum(axis=0), 1)
        scores = self.bodies.scores(middle, noise)
        if self.person >= 0:
            own = max(scores[self.person], self._unchanged(seen, middle))
            scores[self.person] = own + self.config.loyalty
        scores[-1] += self.config.caution
        found = int(scores.argmax())
        if found < self.n_people:
            return found
        if not self._is_body(seen, middle):
            return NOBODY
        return found if self.n_people < self.bodies.room else int(scores[:-1].argmax())

    def misfits(self, frames: FloatArray, back: bool, like: int | None = None) -> BoolArray:
        """Say which frames show something else than most do, or than what came before.

        Args:
            frames: Shape (k, M, 3) [m].
            back: Whether they end as what came before them went on: they are held against that.
            like: Held against only so many of the last; all where not given.
        """
        if not len(frames):
            return np.zeros(0, dtype=np.bool_)
        seen = self._distances(frames)
        middle = self._memory.near if back else middle_of(seen[-(like or len(seen)) :])
        off = np.abs(seen - middle) > self.config.unlike * middle + 10 * NOISE
        known = np.maximum((np.isfinite(seen) & np.isfinite(middle)).sum(axis=1), 1)
        wrong: BoolArray = 2 * off.sum(axis=1) > known
        if back and np.isfinite(middle).any():
            rules = self._pairs, self._memory, self._rules
            for k in np.flatnonzero(~wrong):
                wrong[k] = not goes_on(frames[k], *rules, int(k), 1.0)
        elif not back:
            places = middle_of(frames.reshape(len(frames), -1)).reshape(frames.shape[1:])
            way = middle_of(np.linalg.norm(frames - places, axis=2).T)
            wrong |= way > self._rules.reach_m * len(frames) + SHAKE
        return wrong

    def shows_body(self, frames: FloatArray) -> BoolArray:
        """Say which frames, shape (k, M, 3), show what can be a person's body."""
        return np.array([self._is_body(each[None], each) for each in self._distances(frames)])

    @property
    def absent(self) -> bool:
        """Whether nobody was in sight for so long that it may be anybody by now."""
        return bool(self._memory.counts[ABSENT] > self._rules.absent_frames)

    @property
    def newcomer(self) -> int:
        """Number of the next person who is new, or the last of those who can be told apart."""
        return min(self.n_people, self.bodies.room - 1)

    def skip(self, frames: int) -> None:
        """Let frames pass in which nothing was seen."""
        self._memory.counts[ABSENT] += frames
        self._memory.unseen[:] += frames
        if self.absent:
            self._memory.forget_distances()

    def joins(self, frames: FloatArray) -> bool:
        """Say whether frames, shape (k, M, 3), begin where the same person was before."""
        if not len(frames):
            return True
        return not (self.absent or jumped(frames[0], self._memory, self._rules.reach_m, 0))

    def about_there(self, frame: FloatArray) -> bool:
        """Say whether a frame in doubt, shape (M, 3), is in the place and unit of those before."""
        size = _median(distances_of(frame, self._pairs) / np.maximum(self._memory.near, NOISE))
        jump = jumped(frame, self._memory, self._rules.reach_m, 0)
        return bool(0.5 < size < 2.0 and not jump)

    def stay(self, frames: FloatArray) -> None:
        """Go on with the same person after a doubt, from the frames of it, shape (k, M, 3).

        Where these are in doubt among themselves, the distances vary more than was known, as with
        noise in the markers. It is learned from them: else every frame would raise a doubt again.
        """
        memory = self._memory
        self._strikes = 0
        memory.begin_block()
        for _ in range(2):
            memory.forget_distances()
            memory.places[:] = np.nan
            memory.counts[ABSENT] = 0
            if follow_steadily(frames, self._pairs, memory, self._rules)[0] == len(frames):
                break
            seen = self._distances(frames)
            np.fmax(memory.spread, _variance(seen, middle_of(seen)), out=memory.spread)
            frames = frames[:0]
        memory.begin_block()

    def meet(self, person: int) -> None:
        """Go on with another person, or the first; somebody new has the number `n_people`."""
        if not 0 <= person <= self.newcomer:
            raise InvalidValueError(f"person must lie in [0, {self.newcomer}], not {person}")
        self.leave()
        self.person = person
        self.bodies.n_people = max(self.n_people, person + 1)

    def _distances(self, frames: FloatArray) -> FloatArray:
        return np.array([distances_of(markers, self._pairs) for markers in frames])

    def _is_body(self, seen: FloatArray, middle: FloatArray) -> bool:
        """Say whether distances, shape (k, K) and their medians, can be those of one body."""
        if np.count_nonzero(middle == middle) < max(4, len(middle) / 3):
            return True  # for all that is seen
        ratio = np.maximum(middle, NOISE) / self._usual
        size = _median(ratio)
        shape = _median(np.abs(np.log(ratio / size)))
        swing = middle_of(np.abs(seen - middle)) / np.maximum(middle, 10 * NOISE)
        return (
            SMALLEST < size < LARGEST
            and shape < self.config.misshapen
            and _median(swing) < self.config.unlike
        )

    def _unchanged(self, seen: FloatArray, middle: FloatArray) -> float:
        """Return how well it explains frames in doubt that nothing has changed, shape (k, K).

        Either the distances are what they were, at the median, or they go on from where they were:
        bodies that are replaced jump.
        """
        memory, rules = self._memory, self._rules
        noise = memory.spread * (1.0 / len(seen) + 0.5 * rules.quick) + NOISE**2
        glide = memory.steps + (self.config.glide_m_s / self.rate_hz) ** 2
        return max(
            self.bodies.fit(middle, memory.near, noise, self.config.slips),
            self.bodies.fit(seen[0], memory.last, glide, self.config.slips),
        )

    def _fits_another(self) -> bool:
        """Learn from a block of time; say instead whether blocks fit somebody else by now."""
        memory = self._memory
        if self.person < 0:
            return False
        mean = np.where(memory.seen > 0, memory.total / np.maximum(memory.seen, 1), np.nan)
        memory.begin_block()
        if self.bodies.blocks[self.person] >= 4 and self.n_people > 1:
            scores = self.bodies.scores(mean)[: self.n_people]
            scores[self.person] += self.config.loyalty
            self._strikes = 0 if scores.argmax() == self.person else self._strikes + 1
            if self._strikes:
                if self._strikes < self.config.strikes:
                    return False
                memory.forget_distances()
                return True
        self.bodies.learn(self.person, mean)
        return False

    def state(self) -> IdentityState:
        """Return everything."""
        memory = self._memory.copied()
        return IdentityState(self.person, self._strikes, memory, self.bodies.state())

    def load_state(self, state: IdentityState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: It is of other markers.
        """
        for name, own, value in zip(Memory._fields, self._memory, state.memory, strict=True):
            require(value.shape == own.shape, f"memory.{name}", f"must have shape {own.shape}")
        with within("bodies"):
            self.bodies.load_state(state.bodies)
        self.person, self._strikes = state.person, state.strikes
        self._memory = state.memory.copied()


NOBODY = -2


def _variance(seen: FloatArray, middle: FloatArray) -> FloatArray:
    """Return the variance of distances, shape (k, K), about their medians, but for outliers."""
    return np.asarray((1.4826 * middle_of(np.abs(seen - middle))) ** 2)


def _median(values: FloatArray) -> float:
    return float(middle_of(values[:, None])[0])

"""Who stands there: people are told apart by distances within their own bodies.

The distances between markers on one segment (`rigid`) hardly change while a person moves, and
differ from one person to the next by millimetres to centimetres; in a frame where another body
stands there, most of them change at once. That raises a doubt. What is seen over the next tenth of
a second is then held against what could explain it: nothing has changed; it is somebody known; it
is somebody new. How much the distances vary with posture is learned from the people themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray

from .rigid import NOISE, distances_of, follow_steadily, rigid_pairs


@dataclass(frozen=True)
class IdentityConfig:
    """What is assumed of people and markers.

    Attributes:
        max_people: People told apart; one more is taken for the nearest of them.
        look_s: How long a doubt lasts before it is decided [s].
        absent_s: After so long out of sight it may be anybody [s].
        memory_s: Over which the short memory of the distances reaches [s].
        block_s: Time over which distances are averaged for the long memory [s].
        strikes: Blocks in a row that fit somebody else better before that is believed.
        people_differ: How much people differ, as a share of each distance.
        given_s: Motion that the assumed variation with posture is worth [s].
        loyalty: By how much somebody else must fit better than who was there [nat a distance].
        caution: By how much somebody known must fit better than somebody new [nat a distance].
        slips: Share of a known person's distances that may differ as people do: markers slip, or
            are attached anew.
        glide_m_s: How fast skin and straps let distances change [m/s]; another body's jump.
    """

    max_people: int = 32
    look_s: float = 0.1
    absent_s: float = 0.3
    memory_s: float = 0.05
    block_s: float = 0.25
    strikes: int = 6
    people_differ: float = 0.04
    given_s: float = 5.0
    loyalty: float = 0.25
    caution: float = 0.4
    slips: float = 0.03
    glide_m_s: float = 0.15

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InvalidValueError(f"{name} must be positive, not {value}")


class BodyIdentity:
    """Tells people apart by their bodies, and remembers them.

    Args:
        marker_names: Names of the M markers of every frame, of a known set.
        rate_hz: Frames per second [1/s].
        config: What is assumed.

    Attributes:
        person: Number of the person who stands there, 0, 1, ... in the order of their coming; -1
            before anybody came.
        n_people: How many people are known.

    Raises:
        BodyError: The markers belong to no known set.
    """

    def __init__(
        self, marker_names: Sequence[str], rate_hz: float, config: IdentityConfig | None = None
    ) -> None:
        self.config = config or IdentityConfig()
        self.rate_hz = float(rate_hz)
        self._pairs, give = rigid_pairs(marker_names)
        self.person = -1
        self.n_people = 0
        n_pairs = len(self._pairs)
        self._means = np.full((self.config.max_people, n_pairs), np.nan)
        self._blocks = np.zeros(self.config.max_people)
        given = self.config.given_s / self.config.block_s
        self._squares = given * give**2  # deviations of blocks from their person's mean
        self._counts = np.full(n_pairs, given)
        self._quick = 1.0 - float(np.exp(-1.0 / (self.config.memory_s * rate_hz)))
        self._slow = 1.0 - float(np.exp(-1.0 / (2.0 * rate_hz)))
        self.leave()

    @property
    def look_frames(self) -> int:
        """Frames of a doubt, before it is decided."""
        return max(4, round(self.config.look_s * self.rate_hz))

    def leave(self) -> None:
        """Forget what stands there now, but nobody who was known."""
        n_pairs = len(self._pairs)
        self.person = -1
        self._near, self._last = np.full((2, n_pairs), np.nan)
        self._steps, self._spread = np.full((2, n_pairs), (4 * NOISE) ** 2)
        self._unseen = 0
        self._sum, self._seen = np.zeros(n_pairs), np.zeros(n_pairs)
        self._frames = self._strikes = 0

    def doubts(self, markers: FloatArray) -> bool:
        """Take one frame, shape (M, 3); return whether another body may stand there.

        A frame in doubt is not taken up.
        """
        seen = distances_of(markers, self._pairs)
        visible = np.count_nonzero(seen == seen)
        if 3 * visible < len(seen):
            self._unseen += 1
            return False
        if self._unseen > self.config.absent_s * self.rate_hz:
            self._near[:] = np.nan
            return True
        memory = self._last, self._near, self._steps, self._spread
        if follow_steadily(seen, *memory, self._quick, self._slow):
            return True
        self._unseen = 0
        return self._remember(seen)

    def decide(self, frames: FloatArray) -> int | None:
        """Say who stands there after a doubt.

        Args:
            frames: What was seen since, shape (k, M, 3) [m].

        Returns:
            The number of a known person; `n_people` for somebody new; None if too little is seen.
        """
        seen = np.array([distances_of(markers, self._pairs) for markers in frames])
        count = (seen == seen).sum(axis=0)
        if 3 * np.count_nonzero(count) < len(count):
            return None
        mean = _mean(seen)
        scores = self._scores(mean)
        if self.person >= 0:
            own = max(scores[self.person], self._unchanged(seen))
            scores[self.person] = own + self.config.loyalty
        scores[-1] += self.config.caution
        if self.n_people >= self.config.max_people:
            scores = scores[: self.n_people]
        return int(scores.argmax())

    def stay(self) -> None:
        """Go on with the same person after a doubt."""
        self._near[:] = np.nan
        self._unseen = self._frames = self._strikes = 0
        self._sum[:], self._seen[:] = 0.0, 0.0

    def meet(self, person: int) -> None:
        """Go on with another person, or the first; somebody new has the number `n_people`."""
        if not 0 <= person <= min(self.n_people, self.config.max_people - 1):
            raise InvalidValueError(f"person must lie in [0, {self.n_people}], not {person}")
        self.leave()
        self.person = person
        self.n_people = max(self.n_people, person + 1)

    def _unchanged(self, seen: FloatArray) -> float:
        """Return how well it explains frames in doubt that nothing has changed, shape (k, K).

        Either the distances are what they were, on average, or they go on from where they were:
        bodies that are replaced jump.
        """
        noise = self._spread * (1.0 / len(seen) + 0.5 * self._quick) + NOISE**2
        glide = self._steps + (self.config.glide_m_s / self.rate_hz) ** 2
        return max(
            self._fit(_mean(seen), self._near, noise, self.config.slips),
            self._fit(seen[0], self._last, glide, self.config.slips),
        )

    def _remember(self, seen: FloatArray) -> bool:
        """Take a frame into the current block; say whether blocks fit somebody else."""
        known = seen == seen
        self._sum += np.where(known, seen, 0.0)
        self._seen += known
        self._frames += 1
        if self._frames < self.config.block_s * self.rate_hz or self.person < 0:
            return False
        mean = np.where(self._seen > 0, self._sum / np.maximum(self._seen, 1), np.nan)
        self._sum[:], self._seen[:], self._frames = 0.0, 0.0, 0
        if self._blocks[self.person] >= 4 and self.n_people > 1:
            scores = self._scores(mean)[: self.n_people]
            scores[self.person] += self.config.loyalty
            self._strikes = 0 if scores.argmax() == self.person else self._strikes + 1
            if self._strikes:
                if self._strikes < self.config.strikes:
                    return False
                self._near[:] = np.nan
                return True
        self._learn(mean)
        return False

    def _learn(self, mean: FloatArray) -> None:
        """Take a block into the person's means, and into how much all vary with posture."""
        known = mean == mean
        own, blocks = self._means[self.person], self._blocks[self.person]
        first = known & np.isnan(own)
        own[first] = mean[first]
        step = np.where(known, mean - own, 0.0)
        share = 1.0 / (min(blocks, 1000.0) + 1.0)
        self._squares += (1.0 - share) * step**2
        self._counts += known
        own += share * step
        self._blocks[self.person] += 1

    def _scores(self, mean: FloatArray) -> FloatArray:
        """Return how well each known person, and last somebody new, explains what is seen."""
        scores = np.zeros(self.n_people + 1)
        variance = self._squares / self._counts
        for person in range(self.n_people):
            doubt = 1.0 + 4.0 / max(self._blocks[person], 1.0)
            scores[person] = self._fit(
                mean, self._means[person], doubt * variance, self.config.slips
            )
        people = self._means[: self.n_people]
        usual = np.nanmean(people, axis=0) if self.n_people else mean
        scores[-1] = self._fit(
            mean, usual, (self.config.people_differ * usual) ** 2 + variance, 0.5
        )
        return scores

    def _fit(
        self, seen: FloatArray, expected: FloatArray, variance: FloatArray, share: float
    ) -> float:
        """Return the mean log-density of what is seen, a share of it differing as people do."""
        squares = (seen - expected) ** 2
        known = squares == squares
        if not known.any():
            return -np.inf
        squares, narrow = squares[known], variance[known]
        wide = narrow + (2.5 * self.config.people_differ * expected[known]) ** 2
        return float(
            np.mean(
                np.logaddexp(
                    np.log(1 - share) - 0.5 * (squares / narrow + np.log(narrow)),
                    np.log(share) - 0.5 * (np.minimum(squares / wide, 9.0) + np.log(wide)),
                )
            )
        )

    def state(self) -> dict[str, Any]:
        """Return everything as plain values and arrays."""
        return {name: getattr(self, name) for name in _PLAIN} | {
            name: getattr(self, name).copy() for name in _ARRAYS
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned."""
        for name in _PLAIN:
            setattr(self, name, int(state[name]))
        for name in _ARRAYS:
            setattr(self, name, np.array(state[name], dtype=np.float64))


_PLAIN = ("person", "n_people", "_unseen", "_frames", "_strikes")
_ARRAYS = (
    "_means",
    "_blocks",
    "_squares",
    "_counts",
    "_near",
    "_last",
    "_steps",
    "_spread",
    "_sum",
    "_seen",
)


def _mean(seen: FloatArray) -> FloatArray:
    """Return the mean over frames, shape (k, K) to (K,); NaN where nothing is seen."""
    count = (seen == seen).sum(axis=0)
    return np.where(count > 0, np.nan_to_num(seen).sum(axis=0) / np.maximum(count, 1), np.nan)

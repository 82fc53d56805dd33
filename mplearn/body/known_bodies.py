"""Bodies that are known by distances within them, and how well they explain what is seen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray


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
        fastest_m_s: No part of a person is faster [m/s].
        back_s: For how long frames must go on from what was seen before, for a doubt to be over
            [s].
        unlike: By how much, as a share, a distance differs in a frame that shows something else.
        misshapen: Median deviation of the logarithms of distances from those usual in people, at
            which they are no person's.
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
    fastest_m_s: float = 15.0
    back_s: float = 0.03
    unlike: float = 0.1
    misshapen: float = 0.35

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InvalidValueError(f"{name} must be positive, not {value}")


class KnownBodies:
    """Means of the distances within each known person's body, and how much they vary with posture.

    Args:
        give: How much each distance is assumed to vary, shape (K,) [m].
        config: What is assumed.

    Attributes:
        n_people: How many people are known.
        blocks: Blocks of time learned of each person, shape (max_people,).
    """

    def __init__(self, give: FloatArray, config: IdentityConfig) -> None:
        self.config = config
        self.n_people = 0
        self.blocks = np.zeros(config.max_people)
        self._means = np.full((config.max_people, len(give)), np.nan)
        given = config.given_s / config.block_s
        self._squares = given * give**2  # deviations of blocks from their person's mean
        self._counts = np.full(len(give), given)
        self._given = self._squares.copy(), self._counts.copy()

    def learn(self, person: int, mean: FloatArray) -> None:
        """Take a block into the person's means, and into how much all vary with posture."""
        known = mean == mean
        own, blocks = self._means[person], self.blocks[person]
        first = known & np.isnan(own)
        own[first] = mean[first]
        step = np.where(known, mean - own, 0.0)
        share = 1.0 / (min(blocks, 1000.0) + 1.0)
        self._squares += (1.0 - share) * step**2
        self._counts += known
        own += share * step
        self.blocks[person] += 1

    def scores(self, mean: FloatArray) -> FloatArray:
        """Return how well each known person, and last somebody new, explains what is seen."""
        scores = np.zeros(self.n_people + 1)
        variance = self._squares / self._counts
        for person in range(self.n_people):
            doubt = 1.0 + 4.0 / max(self.blocks[person], 1.0)
            scores[person] = self.fit(
                mean, self._means[person], doubt * variance, self.config.slips
            )
        people = self._means[: self.n_people]
        usual = np.nanmean(people, axis=0) if self.n_people else mean
        scores[-1] = self.fit(mean, usual, self._anybody(usual) + variance, 0.5)
        return scores

    def fit(
        self, seen: FloatArray, expected: FloatArray, variance: FloatArray, share: float
    ) -> float:
        """Return the mean log-density of what is seen, a share of it differing as people do."""
        squares = (seen - expected) ** 2
        known = squares == squares
        if not known.any():
            return -math.inf
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

    def unite(self, other: KnownBodies) -> dict[int, int]:
        """Take over the people whom another has known; return their numbers here.

        Who is the same is found one to one, the surest first; all others are new here, as long as
        there is room, and then the nearest.
        """
        pairs = [
            (self._likeness(other, i, j), i, j)
            for i in range(self.n_people)
            for j in range(other.n_people)
        ]
        numbers: dict[int, int] = {}
        for likeness, i, j in sorted(pairs, reverse=True):
            if likeness > self.config.caution and j not in numbers and i not in numbers.values():
                numbers[j] = i
        for j in range(other.n_people):
            if j in numbers:
                continue
            if self.n_people < self.config.max_people:
                numbers[j] = self.n_people
                self.n_people += 1
            else:
                numbers[j] = max(pair for pair in pairs if pair[2] == j)[1]
        self._squares += other._squares - other._given[0]
        self._counts += other._counts - other._given[1]
        for j, i in numbers.items():
            self._add(i, other._means[j], float(other.blocks[j]))
        return numbers

    def _likeness(self, other: KnownBodies, i: int, j: int) -> float:
        """Return how much better one body than two explains what was seen here and there [nat]."""
        mine, theirs = self._means[i], other._means[j]
        squares = self._squares + other._squares - other._given[0]
        variance = squares / (self._counts + other._counts - other._given[1])
        doubt = 1.0 + 4.0 / max(self.blocks[i], 1.0) + 4.0 / max(other.blocks[j], 1.0)
        people = np.concatenate((self._means[: self.n_people], other._means[: other.n_people]))
        usual = np.nanmean(people, axis=0)
        anybody = self._anybody(usual) + variance
        same = [
            self.fit(one, two, doubt * variance, self.config.slips)
            for one, two in ((mine, theirs), (theirs, mine))
        ]
        new = [self.fit(one, usual, anybody, 0.5) for one in (mine, theirs)]
        return 0.5 * (sum(same) - sum(new))

    def _add(self, person: int, mean: FloatArray, blocks: float) -> None:
        """Take over another's mean of the same person."""
        own, before = self._means[person], self.blocks[person]
        both = (own == own) & (mean == mean) & (before > 0) & (blocks > 0)
        share = blocks / max(before + blocks, 1.0)
        step = np.where(both, mean - own, 0.0)
        self._squares += step**2 * before * share
        self._means[person] = np.where(np.isnan(own), mean, own + share * step)
        self.blocks[person] = before + blocks

    def _anybody(self, usual: FloatArray) -> FloatArray:
        return np.asarray((self.config.people_differ * usual) ** 2)

    def state(self) -> dict[str, Any]:
        """Return everything as plain values and arrays."""
        return {
            "n_people": self.n_people,
            "means": self._means.copy(),
            "blocks": self.blocks.copy(),
            "squares": self._squares.copy(),
            "counts": self._counts.copy(),
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned."""
        self.n_people = int(state["n_people"])
        self._means, self.blocks, self._squares, self._counts = (
            np.array(state[name], dtype=np.float64)
            for name in ("means", "blocks", "squares", "counts")
        )

"""Bodies that are known by distances within them, and how well they explain what is seen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn.state import Array, Count, State, require


@dataclass(frozen=True)
class IdentityConfig:
    """What is assumed of people and markers.

    Attributes:
        max_people: People told apart in streams; one more is taken for the nearest of them. Where
            what several learners know is merged, more may be known.
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


@dataclass(frozen=True, eq=False)
class BodiesState(State):
    """Known bodies.

    Attributes:
        n_people: How many people are known.
        means: Mean of each distance within each person's body, shape (P, K), P people at most [m].
        blocks: Blocks of time learned of each person, shape (P,).
        squares: Squares of the deviations of blocks from their person's mean, shape (K,) [m^2].
        counts: How many blocks those are, shape (K,).
    """

    n_people: Count
    means: Annotated[FloatArray, Array("p", "k", low=0.0, high=1e3, nan=True)]
    blocks: Annotated[FloatArray, Array("p", low=0.0)]
    squares: Annotated[FloatArray, Array("k", low=1e-30)]
    counts: Annotated[FloatArray, Array("k", low=1e-30)]

    def check(self) -> None:
        """Check that there is room for all people."""
        most = len(self.means)
        require(self.n_people <= most, "n_people", f"must be at most {most}, not {self.n_people}")


class KnownBodies:
    """Means of the distances within each known person's body, and how much they vary with posture.

    Args:
        give: How much each distance is assumed to vary, shape (K,) [m].
        config: What is assumed.

    Attributes:
        n_people: How many people are known.
        blocks: Blocks of time learned of each person, shape (P,).
        given: Squares and counts that are assumed before anything was seen, shape (K,) each.
    """

    def __init__(self, give: FloatArray, config: IdentityConfig) -> None:
        self.config = config
        self.n_people = 0
        self.blocks = np.zeros(config.max_people)
        self._means = np.full((config.max_people, len(give)), np.nan)
        given = config.given_s / config.block_s
        self._squares = given * give**2  # deviations of blocks from their person's mean
        self._counts = np.full(len(give), given)
        self.given = self._squares.copy(), self._counts.copy()

    @property
    def room(self) -> int:
        """How many people can be known, shape P of what is known of them."""
        return len(self.blocks)

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

    def scores(self, mean: FloatArray, noise: FloatArray | float = 0.0) -> FloatArray:
        """Return how well each known person, and last somebody new, explains what is seen.

        Args:
            mean: Distances, shape (K,) [m].
            noise: How much they vary because of what measured them, shape (K,) [m^2].
        """
        scores = np.zeros(self.n_people + 1)
        variance = self._squares / self._counts
        for person in range(self.n_people):
            doubt = 1.0 + 4.0 / max(self.blocks[person], 1.0)
            scores[person] = self.fit(
                mean, self._means[person], doubt * variance + noise, self.config.slips
            )
        people = self._means[: self.n_people]
        usual = _mean(people) if self.n_people else mean
        scores[-1] = self.fit(mean, usual, self.anybody(usual) + variance + noise, 0.5)
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

    def anybody(self, usual: FloatArray) -> FloatArray:
        """Return how much a distance varies from person to person, squared, shape (K,) [m^2]."""
        return np.asarray((self.config.people_differ * usual) ** 2)

    def state(self) -> BodiesState:
        """Return all that is known."""
        arrays = self._means, self.blocks, self._squares, self._counts
        return BodiesState(self.n_people, *(array.copy() for array in arrays))

    def load_state(self, state: BodiesState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: It is of other markers, or has room for fewer people.
        """
        least, width = self.config.max_people, self._means.shape[1]
        fits = len(state.means) >= least and state.means.shape[1] == width
        require(fits, "means", f"must have shape ({least} or more, {width})")
        self.n_people = state.n_people
        self._means, self.blocks = state.means.copy(), state.blocks.copy()
        self._squares, self._counts = state.squares.copy(), state.counts.copy()


def _mean(people: FloatArray) -> FloatArray:
    """Return the mean over people, shape (P, K) to (K,); NaN where nobody's is known."""
    known = np.isfinite(people)
    count = known.sum(axis=0)
    mean = np.where(known, people, 0.0).sum(axis=0) / np.maximum(count, 1)
    return np.where(count > 0, mean, np.nan)

"""Who stands there: people are told apart by distances within their own bodies.

The distances between markers on one segment (`rigid`) hardly change while a person moves, and
differ from one person to the next by millimetres to centimetres; in a frame where another body
stands there, most of them change at once. That raises a doubt. What is seen over the next tenth of
a second is then held against what could explain it: nothing has changed; it is somebody known; it
is somebody new. How much the distances vary with posture is learned from the people themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray

from .known_bodies import IdentityConfig as IdentityConfig
from .known_bodies import KnownBodies
from .rigid import NOISE, distances_of, follow_steadily, rigid_pairs


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
        self.person = -1
        self.bodies = KnownBodies(give, self.config)
        self._quick = 1.0 - float(np.exp(-1.0 / (self.config.memory_s * rate_hz)))
        self._slow = 1.0 - float(np.exp(-1.0 / (2.0 * rate_hz)))
        self.leave()

    @property
    def n_people(self) -> int:
        """How many people are known."""
        return self.bodies.n_people

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
        scores = self.bodies.scores(mean)
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
        self.bodies.n_people = max(self.n_people, person + 1)

    def _unchanged(self, seen: FloatArray) -> float:
        """Return how well it explains frames in doubt that nothing has changed, shape (k, K).

        Either the distances are what they were, on average, or they go on from where they were:
        bodies that are replaced jump.
        """
        noise = self._spread * (1.0 / len(seen) + 0.5 * self._quick) + NOISE**2
        glide = self._steps + (self.config.glide_m_s / self.rate_hz) ** 2
        return max(
            self.bodies.fit(_mean(seen), self._near, noise, self.config.slips),
            self.bodies.fit(seen[0], self._last, glide, self.config.slips),
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
        if self.bodies.blocks[self.person] >= 4 and self.n_people > 1:
            scores = self.bodies.scores(mean)[: self.n_people]
            scores[self.person] += self.config.loyalty
            self._strikes = 0 if scores.argmax() == self.person else self._strikes + 1
            if self._strikes:
                if self._strikes < self.config.strikes:
                    return False
                self._near[:] = np.nan
                return True
        self.bodies.learn(self.person, mean)
        return False

    def state(self) -> dict[str, Any]:
        """Return everything as plain values and arrays."""
        plain = {name: getattr(self, name) for name in _PLAIN}
        arrays = {name: getattr(self, name).copy() for name in _ARRAYS}
        return plain | arrays | {"bodies": self.bodies.state()}

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned."""
        for name in _PLAIN:
            setattr(self, name, int(state[name]))
        for name in _ARRAYS:
            setattr(self, name, np.array(state[name], dtype=np.float64))
        self.bodies.load_state(state["bodies"])


_PLAIN = ("person", "_unseen", "_frames", "_strikes")
_ARRAYS = ("_near", "_last", "_steps", "_spread", "_sum", "_seen")


def _mean(seen: FloatArray) -> FloatArray:
    """Return the mean over frames, shape (k, K) to (K,); NaN where nothing is seen."""
    count = (seen == seen).sum(axis=0)
    return np.where(count > 0, np.nan_to_num(seen).sum(axis=0) / np.maximum(count, 1), np.nan)

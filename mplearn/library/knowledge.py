"""What a library says about motion that it is shown; saying it changes nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..body import view_of
from ..errors import InvalidValueError
from ..graph import History, Prediction
from ..recording import FloatArray
from .holdings import Holdings, Key
from .novelty import AnomalyScore, MotionNovelty, novelty_of

if TYPE_CHECKING:
    from ..tree import Recogniser, Recognition


@dataclass(frozen=True, eq=False)
class Knowledge(Holdings):
    """Holdings that recognise, predict and tell what is out of the ordinary."""

    def recognise(self, frames: FloatArray) -> Recognition:
        """Recognise a segment, shape (T, D).

        Raises:
            InvalidValueError: The library was made without a recogniser, or the segment has other
                channels.
        """
        recogniser = self._recogniser
        frames = np.asarray(frames, dtype=np.float64)
        if frames.ndim != 2 or frames.shape[1] != len(self.channels):
            raise InvalidValueError(
                f"a segment must have shape (T, {len(self.channels)}), not {frames.shape}"
            )
        return recogniser.recognise(view_of(self.channels).see(frames))

    def score_motion(self, frames: FloatArray) -> AnomalyScore:
        """Return how unlike every known primitive a segment is, shape (T, D), see `MotionNovelty`.

        Raises:
            InvalidValueError: As `recognise`.
        """
        length = self._recogniser.distance.length
        matches = self.recognise(frames).alternatives
        return self._novelty.score((match.node, float(length(match.distance))) for match in matches)

    def score_order(self, sequence: Sequence[Key | None]) -> tuple[AnomalyScore, ...]:
        """Return how unusual each primitive of a sequence is after those before it.

        Args:
            sequence: Primitives in the order they were performed; None where one was not
                recognised.

        Returns:
            A score for each but the first, see `TransitionGraph.surprises` and `p_values`;
            NaN where it or the one before it was not recognised.
        """
        known = self._known(sequence)
        scores, shares = self.graph.surprises(known), self.graph.p_values(known)
        return tuple(map(AnomalyScore, scores.tolist(), shares.tolist()))

    def predict_next(self, history: Sequence[Key | None], k: int = 3) -> tuple[Prediction, ...]:
        """Return the ``k`` primitives most likely to come next, see `TransitionGraph.predict`.

        Args:
            history: The latest primitives, oldest first; None where one was not recognised.
            k: How many to return at most.
        """
        return self.graph.predict(self._known(history), k)

    @property
    def _recogniser(self) -> Recogniser:
        if self.recogniser is None:
            raise InvalidValueError("this library holds no recogniser")
        return self.recogniser

    @cached_property
    def _novelty(self) -> MotionNovelty:
        return novelty_of(self._recogniser)

    def _known(self, sequence: Sequence[Key | None]) -> History:
        return [None if key is None else self[key].id for key in sequence]

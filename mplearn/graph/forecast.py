"""What the counts say about what comes next, and how unusual what came was."""

from __future__ import annotations

import math

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray, IntArray
from .counts import TransitionCounts
from .expected import left_out_surprises
from .prediction import History, Prediction, backed_off, most_likely, surprise, usable_context
from .walks import stationary


class Forecast(TransitionCounts):
    """Counts that predict; nothing here changes them."""

    _usual: dict[int, FloatArray]

    def prior(self, id: int) -> FloatArray:
        """Return the observed transition probabilities from a primitive, shape (n,), as `ids`.

        Exactly 0 where a transition has never been seen; all 0 at a dead end.
        """
        self._require(id)
        row = self.followers((id,))
        row /= max(row.sum(), 1.0)
        return row

    def probabilities(self, history: History = (), *, smoothing: float | None = None) -> FloatArray:
        """Return how likely each primitive is to come next, shape (n,), as `ids`.

        Args:
            history: The latest primitives, oldest first; None is a segment that was not
                recognised: nothing before it is used.
            smoothing: Weight of shorter histories, see `concentration`, which is the default.
                With 0 the longest history that has been seen decides alone.

        Raises:
            UnknownPrimitiveError: The history names something that is not a node.
            InvalidValueError: ``smoothing`` is negative or not finite.
        """
        mass = self.concentration if smoothing is None else smoothing
        if not (mass >= 0 and math.isfinite(mass)):
            raise InvalidValueError(f"smoothing must be at least 0 and finite, not {smoothing}")
        context = usable_context(history, self.order)
        self._require(*context)
        return backed_off(self, context, mass)

    def predict(self, history: History, k: int = 3) -> tuple[Prediction, ...]:
        """Return the ``k`` primitives most likely to come next, the most likely first."""
        last = usable_context(history, 1)
        p = self.probabilities(history)
        return most_likely(self.ids, p, k, lambda id: self.time_s(last, id))

    def surprises(self, sequence: History) -> FloatArray:
        """Return -log P(x_t | what came before) [nat], t = 1, 2, ..., shape (len(sequence) - 1,).

        The score of anomalies in the order of primitives: large where one comes that seldom or
        never came there. NaN where a segment or the one before it was not recognised (None): that
        is an anomaly of the motion, not of the order.
        """
        self._require(*(id for id in sequence if id is not None))
        return surprise(self, sequence)

    def p_values(self, sequence: History) -> FloatArray:
        """Return which share of transitions is at least as surprising, shape (len(sequence) - 1,).

        Conformal [Vovk2005]: where a transition comes from the same source as those counted, the
        chance of a value of at most a is at most a, so that alarms below a are false at that rate.
        It is held against all transitions counted after as many known primitives, each left out of
        what it is scored by. In (0, 1]; NaN where `surprises` is.
        """
        scores = self.surprises(sequence)
        shares = np.full(len(scores), np.nan)
        for t in np.flatnonzero(~np.isnan(scores)).tolist():
            usual = self._surprises_after(len(usable_context(sequence[: t + 1], self.order)))
            reached = np.searchsorted(usual, scores[t] * (1 - 1e-12), side="left")
            shares[t] = (1 + len(usual) - reached) / (1 + len(usual))
        return shares

    def time_s(self, last: tuple[int, ...], next_id: int) -> tuple[float, float]:
        """Return mean and standard deviation of the time until a primitive starts [s].

        Args:
            last: The primitive before it, from whose start time is counted; empty where nothing is
                known of it.
            next_id: The primitive; where it never followed, whatever did stands in for it.
        """
        if not last:
            return math.nan, math.nan
        return self._edges.time_s(last[0], next_id if (last[0], next_id) in self._edges else None)

    def stationary(self, restart: float = 0.01) -> FloatArray:
        """Return how often an endless walk is at each primitive, shape (n,), as `ids`.

        The walk follows `prior`; at a dead end, and with probability ``restart`` anywhere, it
        goes on at a primitive drawn uniformly, which makes the answer unique on every graph
        (PageRank with damping 1 - restart).
        """
        if not 1e-4 <= restart <= 1:
            raise InvalidValueError(f"restart must lie in [0.0001, 1], not {restart}")
        return stationary(*self._indexed_edges(), len(self), restart)

    # ---- inside

    def _before_change(self) -> None:
        super()._before_change()
        self._usual = {}

    def _surprises_after(self, length: int) -> FloatArray:
        if length not in self._usual:
            self._usual[length] = left_out_surprises(self, length)
        return self._usual[length]

    def _indexed_edges(self) -> tuple[IntArray, IntArray, IntArray]:
        edges = self._edges
        return self._indices(edges.sources), self._indices(edges.targets), edges.counts

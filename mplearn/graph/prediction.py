"""What comes next: counts of every order, each smoothed by what the next lower one predicts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray, IntArray

History: TypeAlias = Sequence[int | None]


@dataclass(frozen=True)
class Prediction:
    """A primitive that may come next, how likely, and when.

    Attributes:
        id: The primitive.
        probability: How likely it is, in [0, 1].
        duration_s: Mean time from the start of the last primitive of the history until this one
            starts [s]. Where this transition has never been seen, that until whatever followed;
            NaN where nothing ever did.
        duration_std_s: Standard deviation of that time [s].

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> graph = TransitionGraph()
        >>> for id in (1, 2):
        ...     graph.add_node(id)
        >>> for duration_s in (0.8, 1.0, 1.2):
        ...     graph.observe(1, 2, duration_s)
        >>> coming = graph.predict([1], k=1)[0]
        >>> coming.id, round(coming.duration_s, 3)
        (2, 1.0)
    """

    id: int
    probability: float
    duration_s: float
    duration_std_s: float


class Followers(Protocol):
    """What followed what, how often."""

    def __len__(self) -> int:
        """Number of nodes n."""

    def followers(self, context: tuple[int, ...]) -> FloatArray:
        """How often each node followed a context (the empty one too), shape (n,)."""


class Counts(Followers, Protocol):
    """All that was counted; see `TransitionGraph`, which is one."""

    @property
    def order(self) -> int:
        """Longest history that is looked at."""

    @property
    def concentration(self) -> float:
        """Weight of what a shorter history predicts."""

    @property
    def ids(self) -> tuple[int, ...]:
        """The nodes."""

    def tally(self, context: tuple[int, ...], next_id: int) -> tuple[int, int, int]:
        """How often a primitive, any primitive, and how many of them followed a context."""

    def edge_rows(self) -> IntArray:
        """Return the edges, shape (E, 5): source, target, count, total [ms], squares [ms^2]."""

    def histories(self) -> Iterator[tuple[tuple[int, ...], int, int]]:
        """Yield (context, next, count) of the contexts longer than one node."""


def usable_context(history: History, order: int) -> tuple[int, ...]:
    """Return the latest primitives, at most ``order``, that no unrecognised segment breaks off."""
    latest = tuple(history[max(len(history) - order, 0) :])
    after_gap = max((t + 1 for t, id in enumerate(latest) if id is None), default=0)
    return tuple(id for id in latest[after_gap:] if id is not None)


def backed_off(counts: Followers, context: tuple[int, ...], mass: float) -> FloatArray:
    """Return p(next | context), shape (n,), interpolated over the orders [Witten1991].

    ``p_k(x) = (c(h_k, x) + m d(h_k) p_{k-1}(x)) / (c(h_k) + m d(h_k))`` from equal shares upwards,
    where h_0 is the empty history and d(h) the number of different primitives that followed h:
    what has always had one follower is soon sure of it, what has had many keeps an open mind. With
    m = 0 the longest history that has been seen decides alone.
    """
    n = len(counts)
    p = np.full(n, 1.0 / n) if n else np.zeros(0)
    for length in range(len(context) + 1):
        seen = counts.followers(context[len(context) - length :])
        if seen.any():
            weight = mass * np.count_nonzero(seen)
            p = (seen + weight * p) / (seen.sum() + weight)
    return p


def most_likely(
    ids: Sequence[int], p: FloatArray, k: int, time_s: Callable[[int], tuple[float, float]]
) -> tuple[Prediction, ...]:
    """Return the ``k`` nodes of the largest probability, the most likely first.

    Args:
        ids: The nodes.
        p: Their probabilities, shape (n,).
        k: How many to return at most.
        time_s: Returns mean and standard deviation of the time until a node starts [s].

    Raises:
        InvalidValueError: ``k`` is not positive.
    """
    if k < 1:
        raise InvalidValueError(f"k must be at least 1, not {k}")
    best = np.argsort(-p, kind="stable")[:k]
    return tuple(Prediction(ids[i], float(p[i]), *time_s(ids[i])) for i in best)


def surprise(counts: Counts, sequence: History) -> FloatArray:
    """Return -log p(x_t | x_1..x_{t-1}) [nat], shape (len(sequence) - 1,); NaN where x_t is None.

    NaN too where nothing is known of what came before x_t: that is no order.
    """
    scores = np.full(max(len(sequence) - 1, 0), np.nan)
    for t, next_id in enumerate(sequence[1:], start=1):
        context = usable_context(sequence[max(t - counts.order, 0) : t], counts.order)
        if next_id is not None and context:
            scores[t - 1] = -math.log(_backed_off_to(next_id, counts, context))
    return scores


def _backed_off_to(next_id: int, counts: Counts, context: tuple[int, ...]) -> float:
    """Return what `backed_off` says of one node, whatever else there is."""
    p = 1.0 / len(counts)
    for length in range(len(context) + 1):
        n, n_all, n_kinds = counts.tally(context[len(context) - length :], next_id)
        if n_all:
            weight = counts.concentration * n_kinds
            p = (n + weight * p) / (n_all + weight)
    return p

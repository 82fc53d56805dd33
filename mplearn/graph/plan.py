"""Ways and walks on what has been observed."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Literal, TypeAlias, Unpack

import numpy as np

from ..errors import InvalidValueError, NoPathError
from .constraints import Asked, Constraints, constrained_walks
from .forecast import Forecast
from .search import simple_paths
from .walks import WalkSampler

if TYPE_CHECKING:
    import networkx as nx

Criterion: TypeAlias = Literal["probability", "steps", "duration"]
_WEIGHTS = {"probability": "cost", "steps": "step", "duration": "duration_s"}


class Plan(Forecast):
    """Counts on which ways are searched and walks drawn; nothing here changes them."""

    _view: nx.DiGraph | None
    _sampler: WalkSampler | None

    def path(
        self,
        start: int,
        goal: int,
        *,
        by: Criterion = "probability",
        avoid: Collection[int] = (),
        visit: Collection[int] = (),
        **asked: Unpack[Asked],
    ) -> tuple[int, ...]:
        """Return the best sequence of observed transitions from ``start`` to ``goal``.

        Args:
            start: First primitive of the path.
            goal: Last primitive of the path; if it is ``start``, the path is that one primitive
                unless something else is asked for.
            by: What is best: the most likely, the fewest steps, or the shortest mean duration.
            avoid: Primitives that must not be passed.
            visit: Primitives that must be passed, in any order (at most 12).
            **asked: What else it must be like, see `Asked`.

        Raises:
            UnknownPrimitiveError: A primitive is not a node.
            NoPathError: There is no such path; the message says what was asked.
            InvalidValueError: A value is not allowed, or the search would be too large.
        """
        return self.k_paths(start, goal, 1, by=by, avoid=avoid, visit=visit, **asked)[0]

    def k_paths(
        self,
        start: int,
        goal: int,
        k: int,
        *,
        by: Criterion = "probability",
        avoid: Collection[int] = (),
        visit: Collection[int] = (),
        **asked: Unpack[Asked],
    ) -> tuple[tuple[int, ...], ...]:
        """Return up to ``k`` different paths, best first; arguments as in `path`.

        Where nothing is asked but what to avoid, no primitive comes twice in a path; else it may.
        """
        self._require(start, goal, *avoid, *visit)
        if k < 1:
            raise InvalidValueError(f"k must be at least 1, not {k}")
        if by not in _WEIGHTS:
            raise InvalidValueError(f"by must be one of {tuple(_WEIGHTS)}, not {by!r}")
        wanted = Constraints(avoid, visit, **asked)
        if wanted.novel and self.order < 2:
            raise InvalidValueError("novel paths need a graph of order 2 at least, not 1")
        if wanted.only_avoid:
            return simple_paths(self.view(), start, goal, avoid, _WEIGHTS[by], k)
        return constrained_walks(
            self.view(), start, goal, wanted, _WEIGHTS[by], k, order=self.order, seen=self.seen
        )

    def log_probability(self, path: Sequence[int]) -> float:
        """Return log of the product of `prior` along a path; -inf where a step was never seen."""
        self._require(*path)
        edges = (self.view().get_edge_data(i, j) for i, j in pairwise(path))
        return float(sum(-math.inf if edge is None else -edge["cost"] for edge in edges))

    def walk(self, start: int | None, length: int, rng: np.random.Generator) -> tuple[int, ...]:
        """Draw a walk of exactly ``length`` primitives by the transition prior.

        Never walks into a dead end too soon: each step is drawn from the `prior` restricted to
        primitives from which what remains of the walk exists.

        Args:
            start: First primitive; None draws one of those from which such a walk exists, by how
                often they have been left.
            length: Number of primitives, ``start`` included.
            rng: Source of randomness.

        Raises:
            NoPathError: No such walk exists; the message says how far one gets.
        """
        if length < 1:
            raise InvalidValueError(f"length must be at least 1, not {length}")
        if start is not None:
            self._require(start)
        if self._sampler is None:
            self._sampler = WalkSampler(*self._indexed_edges(), len(self))
        sampler, ids = self._sampler, self.ids
        first = sampler.draw_start(length, rng) if start is None else self._index[start]
        if first is None or not sampler.alive(length - 1)[first]:
            nodes = range(len(ids)) if first is None else (first,)
            longest = max((sampler.longest(node) for node in nodes), default=0)
            where = "anywhere" if start is None else f"at primitive {start}"
            raise NoPathError(
                f"no walk of {length} primitives starts {where}: "
                f"every way runs into a dead end after {longest} at most"
            )
        return tuple(ids[i] for i in sampler.sample(first, length, rng))

    def to_networkx(self) -> nx.DiGraph:
        """Return the graph as a `networkx.DiGraph` of its own.

        Edges have ``count``, ``probability``, ``duration_s`` and ``duration_std_s`` [s].
        """
        import networkx as nx

        graph = nx.DiGraph()
        graph.add_nodes_from(self._index)
        edges = self._edges
        counts = edges.counts.astype(np.float64)
        sources = self._indices(edges.sources)
        probabilities = counts / np.bincount(sources, weights=counts, minlength=1)[sources]
        whole = (edges.sources, edges.targets, edges.counts)
        real = (probabilities, edges.mean_s, edges.std_s)
        columns = (column.tolist() for column in (*whole, *real))
        for source, target, n, p, mean, std in zip(*columns, strict=True):
            graph.add_edge(
                source, target, count=n, probability=p, duration_s=mean, duration_std_s=std
            )
        return graph

    def view(self) -> nx.DiGraph:
        """Return `to_networkx`, made once until the counts change: to be read, not changed.

        Edges also have what `path` adds up: ``cost``, -log of the probability, and ``step``, 1.
        """
        if self._view is None:
            self._view = self.to_networkx()
            for _, _, edge in self._view.edges(data=True):
                edge["cost"] = -math.log(edge["probability"])
                edge["step"] = 1
        return self._view

    # ---- inside

    def _before_change(self) -> None:
        super()._before_change()
        self._view = None
        self._sampler = None

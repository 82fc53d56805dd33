"""The motion primitive graph: which primitive follows which, how often and when [Kulic2012, 3]."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from ..errors import InvalidValueError, NoPathError
from ..recording import FloatArray, IntArray
from .chains import find_chains
from .counts import TransitionCounts
from .prediction import History, Prediction, backed_off, surprise, usable_context
from .search import constrained_walks, simple_paths
from .walks import WalkSampler, stationary

if TYPE_CHECKING:
    import networkx as nx

Criterion: TypeAlias = Literal["probability", "steps", "duration"]
_WEIGHTS = {"probability": "cost", "steps": "step", "duration": "duration_s"}


class TransitionGraph(TransitionCounts):
    """Observed transitions between primitives, and the paths, walks and predictions they allow.

    Nodes are the ids of primitives (the tree's leaves), edges are transitions between two
    primitives recognised one right after the other; constructor arguments are those of
    `TransitionCounts`.
    """

    _view: nx.DiGraph | None
    _sampler: WalkSampler | None

    # ---- what comes next

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
            smoothing: Mass of each Dirichlet prior, see `concentration`, which is the default.
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
        if k < 1:
            raise InvalidValueError(f"k must be at least 1, not {k}")
        p, ids = self.probabilities(history), self.ids
        last = usable_context(history, 1)
        return tuple(
            Prediction(ids[i], float(p[i]), self.duration_s(last[0], ids[i]) if last else math.nan)
            for i in np.argsort(-p, kind="stable")[:k]
        )

    def log_likelihoods(self, sequence: History) -> FloatArray:
        """Return log P(x_t | what came before) for t = 1, 2, ..., shape (len(sequence) - 1,).

        The score of anomalies in the order of primitives: strongly negative where one comes that
        seldom or never came there. NaN where a segment was not recognised (None): that is an
        anomaly of the motion, not of the order.
        """
        self._require(*(id for id in sequence if id is not None))
        return surprise(self, sequence)

    def stationary(self, restart: float = 0.01) -> FloatArray:
        """Return how often an endless walk is at each primitive, shape (n,), as `ids`.

        The walk follows `prior`; at a dead end, and with probability ``restart`` anywhere, it
        goes on at a primitive drawn uniformly, which makes the answer unique on every graph
        (PageRank with damping 1 - restart).
        """
        if not 1e-4 <= restart <= 1:
            raise InvalidValueError(f"restart must lie in [0.0001, 1], not {restart}")
        return stationary(*self._indexed_edges(), len(self), restart)

    # ---- finding the way

    def path(
        self,
        start: int,
        goal: int,
        *,
        by: Criterion = "probability",
        avoid: Collection[int] = (),
        visit: Collection[int] = (),
        length: int | None = None,
    ) -> tuple[int, ...]:
        """Return the best sequence of observed transitions from ``start`` to ``goal``.

        Args:
            start: First primitive of the path.
            goal: Last primitive of the path; if it is ``start``, the path is that one primitive
                unless ``visit`` or ``length`` ask for more.
            by: What is best: the most likely, the fewest steps, or the shortest mean duration.
            avoid: Primitives that must not be passed.
            visit: Primitives that must be passed, in any order (at most 12).
            length: Exact number of primitives, ``start`` and ``goal`` included.

        Raises:
            UnknownPrimitiveError: A primitive is not a node.
            NoPathError: There is no such path; the message says what was asked.
        """
        return self.k_paths(start, goal, 1, by=by, avoid=avoid, visit=visit, length=length)[0]

    def k_paths(
        self,
        start: int,
        goal: int,
        k: int,
        *,
        by: Criterion = "probability",
        avoid: Collection[int] = (),
        visit: Collection[int] = (),
        length: int | None = None,
    ) -> tuple[tuple[int, ...], ...]:
        """Return up to ``k`` different paths, best first; arguments as in `path`.

        Without ``visit`` and ``length`` no primitive comes twice in a path; with either of them
        it may.
        """
        self._require(start, goal, *avoid, *visit)
        if k < 1:
            raise InvalidValueError(f"k must be at least 1, not {k}")
        if length is not None and length < 1:
            raise InvalidValueError(f"length must be at least 1, not {length}")
        if by not in _WEIGHTS:
            raise InvalidValueError(f"by must be one of {tuple(_WEIGHTS)}, not {by!r}")
        weight, view = _WEIGHTS[by], self._graph()
        if not visit and length is None:
            return simple_paths(view, start, goal, avoid, weight, k)
        return constrained_walks(
            view, start, goal, avoid=avoid, visit=visit, length=length, weight=weight, k=k
        )

    def log_probability(self, path: Sequence[int]) -> float:
        """Return log of the product of `prior` along a path; -inf where a step was never seen."""
        self._require(*path)
        edges = (self._graph().get_edge_data(i, j) for i, j in pairwise(path))
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

    # ---- other views

    def chains(self) -> tuple[tuple[int, ...], ...]:
        """Group the primitives into chains that only ever follow each other, like SQD -> SQR.

        j joins i where it is i's only successor and i is j's only predecessor. Each primitive is in
        exactly one chain.
        """
        return find_chains(self.ids, self._edges.sources, self._edges.targets)

    def merged_view(self) -> nx.DiGraph:
        """Return the graph with each of the `chains` as one node, a tuple of ids.

        A view of what was counted, nothing is changed by it: `to_networkx` remains its undo. Edges
        have the attributes of `to_networkx`, those inside chains are gone.
        """
        import networkx as nx

        whole, merged = self.to_networkx(), nx.DiGraph()
        chains = self.chains()
        merged.add_nodes_from(chains)
        with_head = {chain[0]: chain for chain in chains}
        for chain in chains:
            for target, attributes in whole.adj[chain[-1]].items():
                merged.add_edge(chain, with_head[target], **attributes)
        return merged

    def grouped(self, group_of: Mapping[int, int]) -> TransitionGraph:
        """Return the graph over groups of primitives, as over inner nodes of the tree.

        Args:
            group_of: Group of each primitive; one that is not named stays a node of its own.
        """
        above = TransitionGraph(
            order=self.order,
            concentration=self.concentration,
            history_capacity=self.history_capacity,
        )
        above.absorb(self, group_of)
        return above

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

    # ---- inside

    def _before_change(self) -> None:
        super()._before_change()
        self._view = None
        self._sampler = None

    def _indexed_edges(self) -> tuple[IntArray, IntArray, IntArray]:
        edges = self._edges
        return self._indices(edges.sources), self._indices(edges.targets), edges.counts

    def _graph(self) -> nx.DiGraph:
        """Return the graph with the weights of `path`, made once until the counts change."""
        if self._view is None:
            self._view = self.to_networkx()
            for _, _, edge in self._view.edges(data=True):
                edge["cost"] = -math.log(edge["probability"])
                edge["step"] = 1
        return self._view

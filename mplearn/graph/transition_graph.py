"""The motion primitive graph: which primitive follows which, how often and when [Kulic2012, 3]."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal, TypeAlias, Unpack

import numpy as np

from ..errors import InvalidValueError, NoPathError, UnknownPrimitiveError
from ..recording import FloatArray, IntArray
from ..state import KeptBlocks, validated
from .chains import find_chains, merged_edges
from .constraints import Asked, Constraints, constrained_walks
from .edges import EdgeTable
from .expected import left_out_surprises
from .graph_state import GraphState
from .history import HistoryTable
from .prediction import History, Prediction, backed_off, most_likely, surprise, usable_context
from .reversal import GraphEdit, exchanged
from .search import simple_paths
from .walks import WalkSampler, stationary

if TYPE_CHECKING:
    import networkx as nx

Criterion: TypeAlias = Literal["probability", "steps", "duration"]
_WEIGHTS = {"probability": "cost", "steps": "step", "duration": "duration_s"}


class TransitionGraph:
    """Observed transitions between primitives, and the paths, walks and predictions they allow.

    Nodes are the ids of primitives (the tree's leaves), edges are transitions between two
    primitives recognised one right after the other. Counts only add, so they do not depend on
    order; what grows the graph is under *growing*, nothing else changes it. Ids are listed in the
    order in which they were added; arrays over nodes follow that order.

    Attributes:
        order: Longest history that prediction looks at; 1 is a first-order Markov chain.
        concentration: Weight of what a shorter history predicts, in observations for each different
            primitive that has followed the longer one; 1 is Witten and Bell's [Witten1991].
        history_capacity: Largest number of entries kept about histories longer than one.

    Raises:
        InvalidValueError: A value is out of range.

    Example:
        >>> graph = TransitionGraph()
        >>> for id in (1, 2, 3):
        ...     graph.add_node(id)
        >>> graph.observe(1, 2, 0.8)
        >>> graph.observe(2, 3, 1.1)
        >>> graph.path(1, 3)
        (1, 2, 3)
        >>> graph.predict([1], k=1)[0].id
        2
    """

    _snapshot: TransitionGraph | None
    _state: GraphState | None
    _usual: dict[int, FloatArray]  # by length of history: how surprising transitions were
    _view: nx.DiGraph | None
    _sampler: WalkSampler | None

    def __init__(
        self, *, order: int = 2, concentration: float = 1.0, history_capacity: int = 20_000
    ) -> None:
        if not 1 <= order <= 8:
            raise InvalidValueError(f"order must lie in [1, 8], not {order}")
        if not (concentration > 0 and math.isfinite(concentration)):
            raise InvalidValueError(f"concentration must be positive, not {concentration}")
        if history_capacity < 4:
            raise InvalidValueError(f"history_capacity must be at least 4, not {history_capacity}")
        self.order = order
        self.concentration = concentration
        self.history_capacity = history_capacity
        self._index: dict[int, int] = {}
        self._ids = KeptBlocks()
        self._edges = EdgeTable()
        self._histories = HistoryTable(order, history_capacity)
        self._frozen = False
        self._forget()

    # ---- growing

    def add_node(self, id: int) -> None:
        """Add a primitive; one that is there already stays as it is."""
        if id not in self._index:
            self._before_change()
            self._index[id] = len(self._index)

    def observe(
        self, previous: int, next: int, duration_s: float, *, before: Sequence[int] = ()
    ) -> None:
        """Count a transition between two segments recognised one right after the other.

        Args:
            previous: The first primitive.
            next: The one that followed it.
            duration_s: Time from the start of ``previous`` to the start of ``next`` [s].
            before: The primitives recognised before ``previous`` without a break, oldest first:
                what prediction by longer histories learns from.

        Raises:
            UnknownPrimitiveError: One of them is not a node.
            InvalidValueError: The duration is negative, not finite or beyond a day.
        """
        self._require(previous, next, *before)
        self._before_change()
        self._edges.observe(previous, next, duration_s)
        if self.order > 1 and before:
            self._histories.observe((*before[-(self.order - 1) :], previous), next)

    def remove_node(self, id: int) -> None:
        """Remove a primitive and every transition that names it."""
        self._require(id)
        self._before_change()
        gone = (self._edges.sources == id) | (self._edges.targets == id)
        self._edges = self._edges.without(gone)
        self._histories = self._histories.without(id)
        self._index_anew(i for i in self._index if i != id)

    def merge_nodes(self, keep: int, merged: int) -> None:
        """Make two nodes one: what was counted for ``merged`` is added to ``keep``.

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> graph.merge_nodes(1, 3)
            >>> graph.ids, graph.count(2, 1)
            ((1, 2), 2)
        """
        self._require(keep, merged)
        if keep != merged:
            self._rename({merged: keep})

    def add(self, other: TransitionGraph, new_id: Mapping[int, int] | None = None) -> None:
        """Add the nodes and counts of another graph, its ids replaced where ``new_id`` names them.

        Counts do not depend on the order in which graphs are added.

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> graph.add(graph.copy())  # the same again, from another part of a corpus
            >>> graph.count(1, 2)
            4
        """
        self._before_change()
        added = other.copy()
        if new_id is not None:
            added._require(*new_id)
            added._rename(dict(new_id))
        for node in added.ids:
            self.add_node(node)
        self._edges.add(added._edges.rows)
        self._histories.add(added._histories)

    def exchange(
        self, edit: GraphEdit, heirs: Mapping[int, int | None], ids: Iterable[int]
    ) -> None:
        """Put an edit's rows of after in the place of those of before, whatever came since.

        So it is done again, and undone with ``edit.reversed()``; see `mplearn.graph.reversal`.
        """
        self._before_change()
        twin = TransitionGraph.from_state(exchanged(self.state(), edit, heirs, ids))
        self._index, self._ids = twin._index, twin._ids
        self._edges, self._histories = twin._edges, twin._histories
        self._forget()

    # ---- looking

    def __len__(self) -> int:
        """Number of primitives."""
        return len(self._index)

    def __contains__(self, id: object) -> bool:
        """Whether a primitive is a node."""
        return id in self._index

    @property
    def ids(self) -> tuple[int, ...]:
        """The primitives, in the order in which they were added."""
        return tuple(self._index)

    @property
    def n_edges(self) -> int:
        """Number of different transitions that have been seen."""
        return len(self._edges)

    @property
    def n_transitions(self) -> int:
        """Number of transitions that have been seen."""
        return int(self._edges.counts.sum())

    def count(self, previous: int, next: int) -> int:
        """How often a transition has been seen."""
        self._require(previous, next)
        return self._edges.count(previous, next)

    def duration_s(self, previous: int, next: int) -> float:
        """Mean duration of a transition [s]; NaN where it has never been seen."""
        self._require(previous, next)
        return self._edges.time_s(previous, next)[0]

    def successors(self, id: int) -> tuple[int, ...]:
        """The primitives that have been seen to follow one, in the order of first sight."""
        self._require(id)
        return tuple(self._edges.targets[self._edges.sources == id].tolist())

    def seen(self, context: tuple[int, ...], next: int) -> bool:
        """Whether a primitive has been counted after a context, oldest first."""
        if len(context) < 2:
            return bool(context) and self._edges.count(context[0], next) > 0
        return next in self._histories.followers(context[-self.order :])

    def edge_rows(self) -> IntArray:
        """Return the edges, shape (E, 5): source, target, count, total [ms], squares [ms^2]."""
        return self._edges.rows

    def histories(self) -> Iterator[tuple[tuple[int, ...], int, int]]:
        """Yield (context, next, count) of the contexts longer than one primitive."""
        return self._histories.entries()

    # ---- what comes next

    def prior(self, id: int) -> FloatArray:
        """Return the observed transition probabilities from a primitive, shape (n,), as `ids`.

        Exactly 0 where a transition has never been seen; all 0 at a dead end.

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> dict(zip(graph.ids, graph.prior(2).tolist(), strict=True))  # after 2
            {1: 0.5, 2: 0.0, 3: 0.5}
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

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> graph.probabilities([1, 2]).round(2).tolist()  # nothing is impossible
            [0.44, 0.19, 0.38]
        """
        mass = self.concentration if smoothing is None else smoothing
        if not (mass >= 0 and math.isfinite(mass)):
            raise InvalidValueError(f"smoothing must be at least 0 and finite, not {smoothing}")
        context = usable_context(history, self.order)
        self._require(*context)
        return backed_off(self, context, mass)

    def predict(self, history: History, k: int = 3) -> tuple[Prediction, ...]:
        """Return the ``k`` primitives most likely to come next, the most likely first.

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> [(each.id, round(each.probability, 2)) for each in graph.predict([1], k=2)]
            [(2, 0.79), (1, 0.12)]
        """
        last = usable_context(history, 1)
        p = self.probabilities(history)
        return most_likely(self.ids, p, k, lambda id: self.time_s(last, id))

    def surprises(self, sequence: History) -> FloatArray:
        """Return -log P(x_t | what came before) [nat], t = 1, 2, ..., shape (len(sequence) - 1,).

        The score of anomalies in the order of primitives: large where one comes that seldom or
        never came there. NaN where a segment or the one before it was not recognised (None): that
        is an anomaly of the motion, not of the order.

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> usual, odd = graph.surprises([1, 2])[-1], graph.surprises([1, 1])[-1]
            >>> bool(odd > usual > 0)
            True
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
        at, scored = np.arange(len(scores)), ~np.isnan(scores)
        unknown = np.array([id is None for id in sequence[: len(scores)]], dtype=np.bool_)
        gap = np.maximum.accumulate(np.where(unknown, at, -1))
        lengths = np.minimum(at - gap, self.order)  # of what is known right before
        for length in np.unique(lengths[scored]).tolist():
            usual, here = self._surprises_after(length), scored & (lengths == length)
            reached = np.searchsorted(usual, scores[here] * (1 - 1e-12), side="left")
            shares[here] = (1 + len(usual) - reached) / (1 + len(usual))
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

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> graph.stationary().round(2).tolist()  # how often each is visited in the long run
            [0.4, 0.4, 0.2]
        """
        if not 1e-4 <= restart <= 1:
            raise InvalidValueError(f"restart must lie in [0.0001, 1], not {restart}")
        return stationary(*self._indexed_edges(), len(self), restart)

    # ---- ways and walks

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

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> graph.path(1, 3)
            (1, 2, 3)
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

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> list(graph.k_paths(2, 1, 2))
            [(2, 1), (2, 3, 1)]
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

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> import numpy as np
            >>> graph.walk(1, 4, np.random.default_rng(0))
            (1, 2, 1, 2)
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

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> graph.to_networkx().edges[1, 2]["count"]
            2
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

    # ---- other graphs

    def chains(self) -> tuple[tuple[int, ...], ...]:
        """Group the primitives into chains that only ever follow each other, like SQD -> SQR.

        j joins i where it is i's only successor and i is j's only predecessor. Each primitive is in
        exactly one chain.
        """
        return find_chains(self.ids, self._edges.sources, self._edges.targets)

    def merged(self) -> MergedGraph:
        """Return the graph with each of the `chains` as one node; this graph stays as it is."""
        chains = {chain[0]: chain for chain in self.chains()}
        above = TransitionGraph(order=1, concentration=self.concentration)
        for head in chains:
            above.add_node(head)
        above._edges.add(merged_edges(self._edges, chains))
        return MergedGraph(self.snapshot(), above.snapshot(), chains)

    def grouped(self, group_of: Mapping[int, int]) -> TransitionGraph:
        """Return the graph over groups of primitives, as over inner nodes of the tree.

        Args:
            group_of: Group of each primitive; one that is not named stays a node of its own.

        Example:
            >>> from mplearn.graph import TransitionGraph
            >>> graph = TransitionGraph()
            >>> for id in (1, 2, 3):
            ...     graph.add_node(id)
            >>> for previous, next_id in ((1, 2), (2, 1), (1, 2), (2, 3), (3, 1)):
            ...     graph.observe(previous, next_id, 1.0)
            >>> graph.grouped({1: 10, 2: 10, 3: 11}).count(10, 11)
            1
        """
        above = TransitionGraph(
            order=self.order,
            concentration=self.concentration,
            history_capacity=self.history_capacity,
        )
        above.add(self, group_of)
        return above

    # ---- keeping

    def state(self) -> GraphState:
        """Return all that was counted: the same object as long as nothing more is."""
        if self._state is None:
            self._state = GraphState(
                order=self.order,
                concentration=self.concentration,
                history_capacity=self.history_capacity,
                ids=self._ids.table(self.ids),
                edges=self._edges.table(),
                histories=self._histories.table(),
            )
        return self._state

    @classmethod
    def from_state(cls, state: GraphState) -> TransitionGraph:
        """Return the graph whose `state` this is.

        Raises:
            StateError: The arrays do not describe a graph.
        """
        state = validated(state)
        graph = cls(
            order=state.order,
            concentration=state.concentration,
            history_capacity=state.history_capacity,
        )
        graph._index = {id: k for k, id in enumerate(state.ids.array.tolist())}
        graph._edges.add(state.edges.array)
        graph._histories = HistoryTable.from_table(
            graph.order, graph.history_capacity, state.histories
        )
        return graph

    def snapshot(self) -> TransitionGraph:
        """Return a copy that refuses to be changed: the same one, as long as this one stays so."""
        if self._frozen:
            return self
        if self._snapshot is None:
            self._snapshot = self.copy()
            self._snapshot._frozen = True
        return self._snapshot

    def copy(self) -> TransitionGraph:
        """Return an independent copy."""
        twin = TransitionGraph(
            order=self.order,
            concentration=self.concentration,
            history_capacity=self.history_capacity,
        )
        twin._index, twin._ids = dict(self._index), self._ids.copy()
        twin._edges = self._edges.copy()
        twin._histories = self._histories.copy()
        return twin

    # ---- inside

    def _before_change(self) -> None:
        """Refuse a change to a snapshot."""
        if self._frozen:
            raise InvalidValueError("this graph is a snapshot; its copy() can grow")
        self._forget()

    def _forget(self) -> None:
        """Forget what was derived from the counts."""
        self._snapshot = self._state = None
        self._usual = {}
        self._view = None
        self._sampler = None

    def _require(self, *ids: int) -> None:
        for id in ids:
            if id not in self._index:
                raise UnknownPrimitiveError(
                    f"primitive {id} is not in the graph; it holds {_shortened(self.ids)}"
                )

    def _indices(self, ids: IntArray) -> IntArray:
        index = self._index
        return np.array([index[id] for id in ids.tolist()], dtype=np.int64)

    def followers(self, context: tuple[int, ...]) -> FloatArray:
        """How often each primitive followed a context (the empty one too), shape (n,)."""
        row = np.zeros(len(self))
        edges = self._edges
        if len(context) < 2:
            counted = edges.sources == context[0] if context else np.full(len(edges), True)
            np.add.at(row, self._indices(edges.targets[counted]), edges.counts[counted])
        else:
            for next_id, n in self._histories.followers(context).items():
                row[self._index[next_id]] = n
        return row

    def tally(self, context: tuple[int, ...], next_id: int) -> tuple[int, int, int]:
        """How often a primitive, any primitive, and how many of them followed a context."""
        table = self._edges if len(context) < 2 else self._histories
        return table.tally(context, next_id)

    def _rename(self, new_id: dict[int, int]) -> None:
        self._before_change()
        self._edges = self._edges.renamed(new_id)
        self._histories = self._histories.renamed(new_id)
        self._index_anew(dict.fromkeys(new_id.get(id, id) for id in self._index))

    def _index_anew(self, ids: Iterable[int]) -> None:
        self._index, self._ids = {id: k for k, id in enumerate(ids)}, KeptBlocks()

    def _surprises_after(self, length: int) -> FloatArray:
        if length not in self._usual:
            self._usual[length] = left_out_surprises(self, length)
        return self._usual[length]

    def _indexed_edges(self) -> tuple[IntArray, IntArray, IntArray]:
        edges = self._edges
        return self._indices(edges.sources), self._indices(edges.targets), edges.counts


@dataclass(frozen=True)
class MergedGraph:
    """A graph in which each chain is one node; nothing is lost by it.

    Attributes:
        whole: The graph as it was: the undo.
        graph: The graph of chains, of order 1; a chain goes by its first primitive. Durations are
            from the start of a chain to the start of the next.
        chains: The primitives of each chain, by the first.

    Example:
        >>> graph = TransitionGraph()
        >>> for id in (1, 2, 3):
        ...     graph.add_node(id)
        >>> for previous, next_id in ((1, 2), (2, 3), (3, 1), (3, 3)):  # 2 only ever follows 1
        ...     graph.observe(previous, next_id, 1.0)
        >>> merged = graph.merged()
        >>> merged.chains
        {1: (1, 2), 3: (3,)}
        >>> merged.expand(merged.graph.path(3, 1))
        (3, 1, 2)
    """

    whole: TransitionGraph
    graph: TransitionGraph
    chains: Mapping[int, tuple[int, ...]]

    def expand(self, path: Sequence[int]) -> tuple[int, ...]:
        """Return the primitives of a path of chains.

        Raises:
            UnknownPrimitiveError: The path names something that is not a chain's first primitive.
        """
        for head in path:
            if head not in self.chains:
                raise UnknownPrimitiveError(
                    f"no chain starts with primitive {head}; chains start with {list(self.chains)}"
                )
        return tuple(id for head in path for id in self.chains[head])


def _shortened(ids: tuple[int, ...]) -> str:
    shown = ", ".join(map(str, ids[:20]))
    return f"{len(ids)} primitives: {shown}" + (", ..." if len(ids) > 20 else "")

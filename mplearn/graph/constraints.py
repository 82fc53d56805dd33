"""Walks that meet constraints: what to pass, how many steps, how long, something never seen."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple, TypedDict

from ..errors import InvalidValueError, NoPathError
from .search import costs_to, no_path

if TYPE_CHECKING:
    import networkx as nx

MAX_VISITS = 12
_MAX_STATES = 2_000_000
_MAX_EXPANDED = 500_000

Seen = Callable[[tuple[int, ...], int], bool]


class Asked(TypedDict, total=False):
    """What a path must be like, but for what it passes.

    Attributes:
        length: Exact number of primitives, start and goal included.
        duration_s: Least and most mean time from the start of the first primitive to the start of
            the last [s].
        novel: Ask for a sequence that has never been observed as a whole, though each of its steps
            has: one that holds a succession of at most ``order + 1`` primitives which is not among
            the histories counted (`history_capacity` bounds those).

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> graph = TransitionGraph()
        >>> for id in (1, 2, 3):
        ...     graph.add_node(id)
        >>> for previous, next_id in ((1, 2), (2, 3), (3, 1), (1, 3)):
        ...     graph.observe(previous, next_id, 1.0)
        >>> asked: Asked = {"length": 4, "duration_s": (2.5, 3.5)}
        >>> graph.path(1, 2, **asked)
        (1, 3, 1, 2)
    """

    length: int | None
    duration_s: tuple[float, float] | None
    novel: bool


@dataclass(frozen=True)
class Constraints:
    """What a walk must meet; see `Asked` for the last three.

    Attributes:
        avoid: Primitives that must not be passed.
        visit: Primitives that must be passed, in any order (at most 12).
    """

    avoid: Collection[int] = ()
    visit: Collection[int] = ()
    length: int | None = None
    duration_s: tuple[float, float] | None = None
    novel: bool = False

    def __post_init__(self) -> None:
        if len(set(self.visit)) > MAX_VISITS:
            raise InvalidValueError(
                f"visit may name at most {MAX_VISITS} primitives, not {len(self.visit)}"
            )
        if self.length is not None and self.length < 1:
            raise InvalidValueError(f"length must be at least 1, not {self.length}")
        if self.duration_s is not None:
            low, high = self.duration_s
            if not (0 <= low <= high < math.inf):
                raise InvalidValueError(
                    f"duration_s must be (low, high) with 0 <= low <= high, not {self.duration_s}"
                )

    @property
    def only_avoid(self) -> bool:
        """Whether nothing is asked but what to avoid."""
        return not (self.visit or self.novel or self.length or self.duration_s)

    def __str__(self) -> str:
        parts = [
            f"avoiding {sorted(set(self.avoid))}" if self.avoid else "",
            f"by way of {sorted(set(self.visit))}" if self.visit else "",
            f"in exactly {self.length} primitives" if self.length is not None else "",
            "in {:g} to {:g} s".format(*self.duration_s) if self.duration_s is not None else "",
            "by a succession never observed" if self.novel else "",
        ]
        return " ".join(filter(None, parts))


class _State(NamedTuple):
    """Where a walk stands; walks in the same state can go on in the same ways."""

    node: int
    visited: int  # a bit for each primitive that must be passed
    steps: int  # primitives so far; 0 where it does not matter
    ms: int  # time so far [ms]; 0 where it does not matter
    recent: tuple[int, ...]  # the latest primitives, until something new has happened
    novel: bool


def constrained_walks(
    view: nx.DiGraph,
    start: int,
    goal: int,
    asked: Constraints,
    weight: str,
    k: int,
    *,
    order: int,
    seen: Seen,
) -> tuple[tuple[int, ...], ...]:
    """Return up to ``k`` walks, best first.

    A* over states, each taken up to ``k`` times, with the least cost to the goal as the estimate:
    exact for walks, which may pass a primitive more than once. Durations are added up in whole
    milliseconds.

    Args:
        view: Edges have the attributes ``weight`` and ``duration_s``.
        start: First primitive.
        goal: Last primitive.
        asked: What they must meet.
        weight: Name of what is added up.
        k: How many to return at most.
        order: Length of the longest context that ``seen`` knows.
        seen: Whether a primitive has been observed after a context.

    Raises:
        NoPathError: There is none.
        InvalidValueError: The search would be too large.
    """
    n_states = len(view) * 2 ** len(set(asked.visit)) * (asked.length or 1)
    if n_states * k > _MAX_STATES:
        raise _too_large(n_states * k, _MAX_STATES)
    search = _Search(view, start, goal, asked, weight, k, order, seen)
    walks = tuple(islice(search.walks(), k))
    if not walks:
        raise NoPathError(no_path(start, goal, str(asked)))
    return walks


@dataclass(frozen=True)
class _Search:
    """The search of `constrained_walks`, whose arguments these are."""

    view: nx.DiGraph
    start: int
    goal: int
    asked: Constraints
    weight: str
    k: int
    order: int
    seen: Seen

    @cached_property
    def bit(self) -> dict[int, int]:
        """A bit for each primitive that must be passed."""
        return {node: 1 << i for i, node in enumerate(sorted(set(self.asked.visit)))}

    @cached_property
    def limits_ms(self) -> tuple[float, float]:
        """Least and most time [ms]."""
        low_s, high_s = self.asked.duration_s or (-math.inf, math.inf)
        return 1e3 * low_s, 1e3 * high_s

    def walks(self) -> Iterator[tuple[int, ...]]:
        """Yield the walks, best first."""
        avoid, goal = set(self.asked.avoid), self.goal
        ahead = costs_to(self.view, goal, self.weight, avoid)
        if self.start in avoid or self.start not in ahead:
            return
        trail = [(self.start, -1)]  # each walk begun: its newest node, where its past stands
        first = _State(
            self.start,
            self.bit.get(self.start, 0),
            int(self.asked.length is not None),
            0,
            (self.start,) if self.asked.novel else (),
            False,
        )
        queue = [(ahead[self.start], 0, 0.0, first)]  # equals leave in the order of their entry
        taken: dict[_State, int] = {}
        n_expanded = 0
        while queue:
            _, place, cost, state = heapq.heappop(queue)
            if taken.get(state, 0) >= self.k:
                continue
            taken[state] = taken.get(state, 0) + 1
            n_expanded += 1
            if n_expanded > _MAX_EXPANDED:
                raise _too_large(n_expanded, _MAX_EXPANDED)
            if self._arrived(state):
                yield _followed_back(trail, place)
            if self.asked.length is not None and state.steps >= self.asked.length:
                continue
            for follower, edge in self.view.adj[state.node].items():
                if follower not in ahead:
                    continue
                after = self._after(state, follower, edge["duration_s"])
                if after.ms <= self.limits_ms[1]:
                    reached = cost + edge[self.weight]
                    entry = (reached + ahead[follower], len(trail), reached, after)
                    heapq.heappush(queue, entry)
                    trail.append((follower, place))

    def _arrived(self, state: _State) -> bool:
        return (
            state.node == self.goal
            and state.visited == (1 << len(self.bit)) - 1
            and self.asked.length in (None, state.steps)
            and self.limits_ms[0] <= state.ms <= self.limits_ms[1]
            and state.novel == self.asked.novel
        )

    def _after(self, state: _State, follower: int, duration_s: float) -> _State:
        novel = state.novel
        if self.asked.novel and not novel and len(state.recent) > 1:
            novel = not self.seen(state.recent, follower)
        timed = self.asked.duration_s is not None
        watched = self.asked.novel and not novel
        return _State(
            follower,
            state.visited | self.bit.get(follower, 0),
            state.steps + 1 if self.asked.length is not None else 0,
            state.ms + round(1e3 * duration_s) if timed else 0,
            (*state.recent, follower)[-self.order :] if watched else (),
            novel,
        )


def _followed_back(trail: list[tuple[int, int]], place: int) -> tuple[int, ...]:
    nodes = []
    while place >= 0:
        node, place = trail[place]
        nodes.append(node)
    return tuple(reversed(nodes))


def _too_large(n: int, most: int) -> InvalidValueError:
    return InvalidValueError(
        f"a search over {n} states is too large (at most {most}): "
        "ask for a smaller length, duration_s, k or visit"
    )

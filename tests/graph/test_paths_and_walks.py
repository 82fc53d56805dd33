from itertools import pairwise, product

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError, NoPathError, UnknownPrimitiveError
from mplearn.graph import TransitionGraph

N = 6
edge_lists = st.lists(
    st.tuples(st.integers(0, N - 1), st.integers(0, N - 1), st.integers(1, 5)),
    min_size=1,
    max_size=14,
)


def graph_of(edges):
    graph = TransitionGraph()
    for id in range(N):
        graph.add_node(id)
    for i, j, n in edges:
        for k in range(n):
            graph.observe(i, j, 0.4 + 0.1 * i + 0.03 * j + 0.01 * k)
    return graph


def weight(graph, path, by):
    exported = graph.to_networkx()
    edges = [exported.edges[i, j] for i, j in pairwise(path)]
    if by == "probability":
        return sum(-np.log(edge["probability"]) for edge in edges)
    return len(edges) if by == "steps" else sum(edge["duration_s"] for edge in edges)


def all_walks(graph, start, goal, longest):
    """Every walk of up to ``longest`` primitives, by enumeration."""
    exported = graph.to_networkx()
    walks, frontier = [], [(start,)]
    for _ in range(longest):
        walks += [walk for walk in frontier if walk[-1] == goal]
        frontier = [(*walk, j) for walk in frontier for j in exported.successors(walk[-1])]
    return walks


@pytest.mark.parametrize("by", ["probability", "steps", "duration"])
@settings(max_examples=40)
@given(edges=edge_lists, start=st.integers(0, N - 1), goal=st.integers(0, N - 1))
def test_the_best_paths_are_those_of_enumeration(by, edges, start, goal):
    graph = graph_of(edges)
    simple = [walk for walk in all_walks(graph, start, goal, N) if len(set(walk)) == len(walk)]
    costs = sorted(weight(graph, path, by) for path in simple)
    if not simple:
        with pytest.raises(NoPathError, match=f"from primitive {start} to {goal}"):
            graph.path(start, goal, by=by)
        return
    best = graph.path(start, goal, by=by)
    assert (best[0], best[-1]) == (start, goal)
    assert weight(graph, best, by) == pytest.approx(costs[0])
    found = graph.k_paths(start, goal, 5, by=by)
    assert len(set(found)) == len(found) == min(5, len(simple))
    np.testing.assert_allclose([weight(graph, path, by) for path in found], costs[: len(found)])


@settings(max_examples=60)
@given(
    edge_lists,
    st.integers(0, N - 1),
    st.integers(0, N - 1),
    st.sets(st.integers(0, N - 1), max_size=2),
    st.sets(st.integers(0, N - 1), max_size=2),
    st.integers(1, 6),
)
def test_constrained_paths_are_those_of_enumeration(edges, start, goal, avoid, visit, length):
    graph = graph_of(edges)
    fitting = [
        walk
        for walk in all_walks(graph, start, goal, length)
        if len(walk) == length and visit <= set(walk) and not avoid & set(walk)
    ]
    ask = {"avoid": avoid, "visit": visit, "length": length}
    if not fitting:
        with pytest.raises(NoPathError, match=f"exactly {length} primitives"):
            graph.path(start, goal, **ask)
        return
    costs = sorted(weight(graph, walk, "probability") for walk in fitting)
    found = graph.k_paths(start, goal, 4, **ask)
    assert set(found) <= set(fitting)
    assert len(set(found)) == len(found) == min(4, len(fitting))
    np.testing.assert_allclose(
        [weight(graph, walk, "probability") for walk in found], costs[: len(found)], atol=1e-12
    )
    np.testing.assert_allclose(graph.log_probability(found[0]), -costs[0], atol=1e-12)


@settings(max_examples=40)
@given(edge_lists, st.integers(0, N - 1), st.integers(0, N - 1))
def test_a_way_by_all_of_two_others(edges, start, goal):
    graph = graph_of(edges)
    exported = graph.to_networkx()
    lengths = dict(nx.all_pairs_dijkstra_path_length(exported, weight=lambda *_: 1))
    visits = (1, 4)
    orders = [(start, a, b, goal) for a, b in (visits, visits[::-1])]
    steps = [
        sum(lengths[i][j] for i, j in pairwise(stops))
        for stops in orders
        if all(j in lengths[i] for i, j in pairwise(stops))
    ]
    if not steps:
        with pytest.raises(NoPathError, match="by way of"):
            graph.path(start, goal, visit=visits, by="steps")
        return
    path = graph.path(start, goal, visit=visits, by="steps")
    assert len(path) - 1 == min(steps)
    assert set(visits) <= set(path)


@settings(max_examples=60)
@given(
    edge_lists,
    st.integers(0, N - 1),
    st.integers(0, N - 1),
    st.tuples(st.floats(0, 3), st.floats(0, 3)).map(sorted),
)
def test_ways_of_a_duration_are_those_of_enumeration(edges, start, goal, bounds):
    graph = graph_of(edges)
    exported = graph.to_networkx()
    low, high = bounds

    def ms(walk):
        return sum(round(1e3 * exported.edges[i, j]["duration_s"]) for i, j in pairwise(walk))

    # a step takes 0.4 s at least, so eight primitives are more than 3 s allow
    fitting = {w for w in all_walks(graph, start, goal, 9) if 1e3 * low <= ms(w) <= 1e3 * high}
    if not fitting:
        with pytest.raises(NoPathError, match=f"in {low:g} to {high:g} s"):
            graph.path(start, goal, duration_s=(low, high))
        return
    costs = sorted(weight(graph, walk, "probability") for walk in fitting)
    found = graph.k_paths(start, goal, 3, duration_s=(low, high))
    assert set(found) <= fitting
    assert len(set(found)) == len(found) == min(3, len(fitting))
    np.testing.assert_allclose(
        [weight(graph, walk, "probability") for walk in found], costs[: len(found)], atol=1e-12
    )


@settings(max_examples=60)
@given(
    st.lists(st.integers(0, N - 1), min_size=4, max_size=25),
    st.integers(0, N - 1),
    st.integers(0, N - 1),
    st.integers(3, 6),
    st.integers(2, 3),
)
def test_novel_paths_have_never_been_observed(sequence, start, goal, length, order):
    graph = TransitionGraph(order=order)
    for id in range(N):
        graph.add_node(id)
    for t in range(1, len(sequence)):
        before = sequence[max(t - order, 0) : t - 1]
        graph.observe(sequence[t - 1], sequence[t], 1.0, before=before)
    grams = {
        tuple(sequence[i : i + n])
        for n in range(3, order + 2)
        for i in range(len(sequence) - n + 1)
    }

    def is_new(walk):
        ends = range(3, len(walk) + 1)
        return any(walk[max(e - order - 1, 0) : e] not in grams for e in ends)

    fitting = {w for w in all_walks(graph, start, goal, length) if len(w) == length and is_new(w)}
    if not fitting:
        with pytest.raises(NoPathError, match="never observed"):
            graph.path(start, goal, length=length, novel=True)
        return
    found = graph.k_paths(start, goal, 3, length=length, novel=True)
    assert set(found) <= fitting
    assert len(set(found)) == len(found) == min(3, len(fitting))
    observed = {tuple(sequence[i : i + length]) for i in range(len(sequence))}
    assert not observed & set(found)
    best = min(weight(graph, walk, "probability") for walk in fitting)
    assert weight(graph, found[0], "probability") == pytest.approx(best)


def test_what_cannot_be_asked():
    graph = graph_of([(0, 1, 1), (1, 0, 1)])
    with pytest.raises(UnknownPrimitiveError, match="42"):
        graph.path(0, 1, avoid=[42])
    with pytest.raises(InvalidValueError, match="by must"):
        graph.path(0, 1, by="beauty")
    with pytest.raises(InvalidValueError, match="length"):
        graph.path(0, 1, length=0)
    with pytest.raises(InvalidValueError, match="too large"):
        graph.path(0, 1, length=10_000_000)
    for wrong in ((2.0, 1.0), (-1.0, 1.0), (0.0, np.inf)):
        with pytest.raises(InvalidValueError, match="duration_s"):
            graph.path(0, 1, duration_s=wrong)
    with pytest.raises(NoPathError, match=r"in 0\.1 to 0\.2 s by a succession never observed"):
        graph.path(0, 1, duration_s=(0.1, 0.2), novel=True)
    with pytest.raises(NoPathError, match=r"avoiding \[1\]"):
        graph.path(0, 1, avoid=[1])
    assert graph.path(0, 0) == (0,)
    assert graph.path(0, 0, length=3) == (0, 1, 0)
    assert graph.log_probability([0, 0]) == -np.inf


@settings(max_examples=60)
@given(edge_lists, st.integers(0, N - 1), st.integers(1, 12), st.integers(0, 2**32))
def test_walks_exist_exactly_where_powers_of_the_adjacency_say(edges, start, length, seed):
    graph = graph_of(edges)
    adjacency = np.zeros((N, N), dtype=object)
    for i, j, _ in edges:
        adjacency[i, j] = 1
    n_walks = np.ones(N, dtype=object)
    for _ in range(length - 1):
        n_walks = adjacency @ n_walks
    if not n_walks[start]:
        with pytest.raises(NoPathError, match=f"starts at primitive {start}"):
            graph.walk(start, length, np.random.default_rng(seed))
    else:
        walk = graph.walk(start, length, np.random.default_rng(seed))
        assert walk[0] == start
        assert len(walk) == length
        assert all(adjacency[i, j] for i, j in pairwise(walk))
        assert walk == graph.walk(start, length, np.random.default_rng(seed))
    if n_walks.any():
        anywhere = graph.walk(None, length, np.random.default_rng(seed))
        assert len(anywhere) == length
    else:
        with pytest.raises(NoPathError, match="anywhere"):
            graph.walk(None, length, np.random.default_rng(seed))


def test_the_message_says_how_far_one_gets():
    graph = graph_of([(0, 1, 1), (1, 2, 1), (3, 3, 1)])
    with pytest.raises(NoPathError, match="dead end after 3 at most"):
        graph.walk(0, 10, np.random.default_rng(0))
    assert graph.walk(3, 50, np.random.default_rng(0)) == (3,) * 50


def test_walks_follow_the_prior_restricted_to_what_lives_on():
    # 0 goes to 1 (3 times), 2 (1), and into the dead end 5 (6): never there while steps remain
    graph = graph_of([(0, 1, 3), (0, 2, 1), (0, 5, 5), (0, 5, 1), (1, 0, 1), (2, 0, 1)])
    rng = np.random.default_rng(3)
    walks = [graph.walk(0, 4, rng) for _ in range(4000)]
    seconds = np.array([walk[1] for walk in walks])
    assert set(seconds) == {1, 2}
    assert (seconds == 1).mean() == pytest.approx(0.75, abs=0.03)
    lasts = np.array([walk[3] for walk in walks])
    np.testing.assert_allclose(
        [(lasts == id).mean() for id in (1, 2, 5)], [0.3, 0.1, 0.6], atol=0.03
    )


def test_a_walk_does_not_care_when_its_graph_has_been_asked_before():
    edges = [(i, j, 1 + (i * j) % 3) for i, j in product(range(N), repeat=2) if (i + j) % 2]
    fresh, asked = graph_of(edges), graph_of(edges)
    for length in (1, 2, 30):
        asked.walk(None, length, np.random.default_rng(0))
    assert fresh.walk(0, 40, np.random.default_rng(7)) == asked.walk(
        0, 40, np.random.default_rng(7)
    )
    asked.observe(0, 0, 1.0)
    assert asked.path(0, 0, length=2) == (0, 0)

from dataclasses import replace
from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from graph_examples import learned, paper_graph, sequences
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.graph import TransitionGraph


@given(sequences)
def test_counts_probabilities_and_durations_are_those_of_the_sequence(sequence):
    graph = learned(sequence)
    pairs = list(pairwise(sequence))
    assert graph.n_transitions == len(pairs)
    assert graph.n_edges == len(set(pairs))
    exported = graph.to_networkx()
    for i, j in set(pairs):
        times = [0.5 + t % 3 for t in range(1, len(sequence)) if pairs[t - 1] == (i, j)]
        edge = exported.edges[i, j]
        assert edge["count"] == graph.count(i, j) == pairs.count((i, j))
        leaving = sum(first == i for first, _ in pairs)
        assert edge["probability"] == pytest.approx(pairs.count((i, j)) / leaving)
        assert edge["duration_s"] == graph.duration_s(i, j) == pytest.approx(np.mean(times))
        assert edge["duration_std_s"] == pytest.approx(np.std(times), abs=1e-6)


@given(sequences)
def test_prior_is_observed_only_and_sums_to_one_or_nothing(sequence):
    graph = learned(sequence)
    for id in graph.ids:
        row = graph.prior(id)
        seen = {j for i, j in pairwise(sequence) if i == id}
        assert {graph.ids[k] for k in np.flatnonzero(row)} == seen == set(graph.successors(id))
        assert row.sum() == (pytest.approx(1.0) if seen else 0.0)


@given(sequences, sequences, st.randoms())
def test_counts_do_not_depend_on_order_nor_on_who_counted(first, second, random):
    parts = [first, second]
    pairs = [(i, j, 0.1 * k) for part in parts for k, (i, j) in enumerate(pairwise(part))]
    shuffled = random.sample(pairs, len(pairs))
    graphs = []
    for each in (pairs, shuffled):
        graph = TransitionGraph()
        for id in range(7):
            graph.add_node(id)
        for i, j, s in each:
            graph.observe(i, j, s)
        graphs.append(graph)
    a, b = (graph.state() for graph in graphs)
    assert sorted(a.edges.array.tolist()) == sorted(b.edges.array.tolist())
    ab, ba = learned(first), learned(second)
    ab.add(learned(second))
    ba.add(learned(first))
    for key in ("edges", "histories"):
        assert sorted(getattr(ab.state(), key).array.tolist()) == sorted(
            getattr(ba.state(), key).array.tolist()
        )
    assert ab.n_transitions == len(pairs)


@given(sequences, st.integers(0, 6), st.integers(0, 6))
def test_merging_nodes_is_as_if_they_had_been_one(sequence, keep, merged):
    whole = [*range(7), *sequence]
    graph = learned(whole)
    graph.merge_nodes(keep, merged)
    expected = learned([keep if id == merged else id for id in whole])
    for key in ("edges", "histories"):
        assert sorted(getattr(graph.state(), key).array.tolist()) == sorted(
            getattr(expected.state(), key).array.tolist()
        )
    assert set(graph.ids) == set(expected.ids)


@given(sequences, st.integers(0, 6))
def test_removing_a_node_removes_all_that_names_it(sequence, gone):
    whole = [*range(7), *sequence]
    graph = learned(whole)
    graph.remove_node(gone)
    pairs = [pair for pair in pairwise(whole) if gone not in pair]
    assert graph.n_transitions == len(pairs)
    assert gone not in graph
    assert gone not in graph.state().histories.array[:, 1:-1][:, [-1]]
    assert graph.probabilities().sum() == pytest.approx(1.0)


@given(sequences)
def test_state_and_copy_resume_exactly(sequence):
    graph = learned(sequence)
    twin = TransitionGraph.from_state(graph.state())
    copy = graph.copy()
    for other in (twin, copy):
        assert other.state() == graph.state()
    copy.add_node(99)
    copy.observe(99, 99, 1.0)
    assert 99 not in graph
    snapshot = graph.snapshot()
    np.testing.assert_array_equal(snapshot.prior(sequence[0]), graph.prior(sequence[0]))
    with pytest.raises(InvalidValueError, match="snapshot"):
        snapshot.observe(sequence[0], sequence[0], 1.0)
    assert snapshot.state() == graph.state()
    assert graph.snapshot() is snapshot
    graph.add_node(100)
    assert 100 in graph.snapshot()
    assert 100 not in snapshot
    snapshot.copy().add_node(1000)


def test_stationary_is_pagerank():
    rng = np.random.default_rng(1)
    graph = learned(rng.integers(0, 12, 60).tolist())
    graph.add_node(50)  # a dead end, and nothing leads to it
    for restart in (0.15, 0.01):
        rank = nx.pagerank(
            graph.to_networkx(), alpha=1 - restart, weight="probability", max_iter=5000, tol=1e-13
        )
        np.testing.assert_allclose(
            graph.stationary(restart), [rank[id] for id in graph.ids], atol=1e-9
        )


@settings(max_examples=20)
@given(st.sampled_from([float("nan"), float("inf"), -0.1, 1e9]))
def test_bad_durations_change_nothing(duration_s):
    graph = paper_graph()
    before = graph.state()
    with pytest.raises(InvalidValueError, match="duration_s"):
        graph.observe(0, 1, duration_s)
    np.testing.assert_array_equal(graph.state().edges.array, before.edges.array)


def test_bad_input_is_named():
    graph = paper_graph()
    with pytest.raises(UnknownPrimitiveError, match="primitive 77 is not in the graph"):
        graph.observe(0, 77, 1.0)
    for call in (graph.prior, graph.successors, graph.remove_node, lambda i: graph.predict([i])):
        with pytest.raises(UnknownPrimitiveError, match="77"):
            call(77)
    with pytest.raises(InvalidValueError, match="smoothing"):
        graph.probabilities([0], smoothing=-1)
    with pytest.raises(InvalidValueError, match="k must"):
        graph.predict([0], 0)
    for wrong in ({"order": 0}, {"concentration": 0}, {"history_capacity": 0}):
        with pytest.raises(InvalidValueError, match=next(iter(wrong))):
            TransitionGraph(**wrong)
    state = graph.state()
    edges = state.edges.array.copy()
    edges[0, 0] = 44
    for damage in ({"edges": edges}, {"ids": state.ids.array[:2]}, {"edges": edges[:, :3]}):
        with pytest.raises(InvalidValueError):
            TransitionGraph.from_state(replace(state, **damage))


def test_an_empty_graph_answers():
    graph = TransitionGraph()
    assert graph.predict([], 3) == ()
    assert graph.chains() == ()
    assert len(graph.stationary()) == len(graph.to_networkx()) == 0


@settings(max_examples=40)
@given(sequences, sequences, sequences)
def test_absorbing_is_associative_and_a_seam_is_all_that_one_stream_has_more(a, b, c):
    def parts(graph):
        state = graph.state()
        return (
            sorted(state.edges.array.tolist()),
            sorted(state.histories.array.tolist()),
            set(graph.ids),
        )

    left, right, inner = learned(a), learned(a), learned(b)
    left.add(learned(b))
    left.add(learned(c))
    inner.add(learned(c))
    right.add(inner)
    assert parts(left) == parts(right)
    whole, apart = learned([*a, *b]), learned(a)
    apart.add(learned(b))
    for i in whole.ids:
        for j in whole.ids:
            seam = (i, j) == (a[-1], b[0])
            assert whole.count(i, j) == apart.count(i, j) + seam

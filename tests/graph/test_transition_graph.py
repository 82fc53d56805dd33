import math
from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.graph import TransitionGraph

sequences = st.lists(st.integers(0, 6), min_size=2, max_size=60)


def learned(sequence, order=2, **kwargs):
    graph = TransitionGraph(order=order, **kwargs)
    for id in sorted(set(sequence)):
        graph.add_node(id)
    for t in range(1, len(sequence)):
        before = sequence[max(t - order, 0) : t - 1]
        graph.observe(sequence[t - 1], sequence[t], 0.5 + t % 3, before=before)
    return graph


def paper_graph():
    """Both arms, bow, squat: bow down is always followed by bow up, squat down by squat up."""
    bar, bal, bd, bu, sqd, sqr = range(6)
    return learned([bar, bal, bd, bu, bar, bal, sqd, sqr, bar, bal, bd, bu, sqd, sqr, bar])


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


@given(sequences, st.lists(st.none() | st.integers(0, 6), max_size=6), st.floats(0, 20))
def test_probabilities_sum_to_one(sequence, history, smoothing):
    graph = learned([*range(7), *sequence], order=3)
    p = graph.probabilities(history, smoothing=smoothing)
    assert p.sum() == pytest.approx(1.0)
    assert (p >= 0).all()
    assert smoothing < 1e-9 or (p > 0).all()


def test_smoothing_by_hand():
    graph = TransitionGraph(order=2, concentration=2.0)
    for id in (0, 1, 2):
        graph.add_node(id)
    graph.observe(0, 1, 1.0)
    graph.observe(0, 1, 1.0)
    graph.observe(1, 2, 1.0, before=[0])
    p0 = (np.array([0, 2, 1]) + 4 / 3) / 7  # two different ones followed: a weight of 4
    np.testing.assert_allclose(graph.probabilities(), p0)
    np.testing.assert_allclose(graph.probabilities([0]), (np.array([0, 2, 0]) + 2 * p0) / 4)
    p1 = (np.array([0, 0, 1]) + 2 * p0) / 3
    np.testing.assert_allclose(graph.probabilities([1]), p1)
    np.testing.assert_allclose(graph.probabilities([0, 1]), (np.array([0, 0, 1]) + 2 * p1) / 3)
    # never seen before 1: the shorter history decides; None cuts what lies before it off
    np.testing.assert_allclose(graph.probabilities([2, 1]), p1)
    np.testing.assert_allclose(graph.probabilities([0, None, 1]), p1)
    np.testing.assert_allclose(graph.probabilities([0, None]), p0)
    np.testing.assert_allclose(graph.probabilities([1], smoothing=0), [0, 0, 1])
    np.testing.assert_allclose(graph.probabilities([2], smoothing=0), [0, 2 / 3, 1 / 3])


def test_longer_histories_tell_apart_what_one_step_cannot():
    sequence = [0, 2, 3, 1, 2, 4] * 20  # after 2 comes 3 or 4, depending on what came before 2
    one, two = learned(sequence, order=1), learned(sequence, order=2)
    assert one.predict([0, 2], 1)[0].probability < 0.55
    best = two.predict([0, 2], 1)[0]
    assert (best.id, best.probability > 0.9) == (3, True)
    assert two.predict([1, 2], 1)[0].id == 4
    assert best.duration_s == two.duration_s(2, 3)
    assert math.isnan(two.predict([None], 1)[0].duration_s)


def test_a_planted_wrong_order_surprises_most():
    sequence = [0, 1, 2, 3] * 30
    graph = learned(sequence)
    planted = [*sequence[:20], 3, *sequence[20:40]]
    scores = graph.surprises(planted)
    assert np.argmax(scores) in (19, 20)
    assert len(scores) == len(planted) - 1
    broken = graph.surprises([0, 1, None, 3, 0])
    assert np.isnan(broken).tolist() == [False, True, True, False]
    np.testing.assert_allclose(broken[0], -np.log(graph.probabilities([0])[1]))


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
    assert sorted(a["edges"].tolist()) == sorted(b["edges"].tolist())
    ab, ba = learned(first), learned(second)
    ab.absorb(learned(second))
    ba.absorb(learned(first))
    for key in ("edges", "histories"):
        assert sorted(ab.state()[key].tolist()) == sorted(ba.state()[key].tolist())
    assert ab.n_transitions == len(pairs)


@given(sequences, st.integers(0, 6), st.integers(0, 6))
def test_merging_nodes_is_as_if_they_had_been_one(sequence, keep, merged):
    whole = [*range(7), *sequence]
    graph = learned(whole)
    graph.merge_nodes(keep, merged)
    expected = learned([keep if id == merged else id for id in whole])
    for key in ("edges", "histories"):
        assert sorted(graph.state()[key].tolist()) == sorted(expected.state()[key].tolist())
    assert set(graph.ids) == set(expected.ids)


@given(sequences, st.integers(0, 6))
def test_removing_a_node_removes_all_that_names_it(sequence, gone):
    whole = [*range(7), *sequence]
    graph = learned(whole)
    graph.remove_node(gone)
    pairs = [pair for pair in pairwise(whole) if gone not in pair]
    assert graph.n_transitions == len(pairs)
    assert gone not in graph
    assert gone not in graph.state()["histories"][:, 1:-1][:, [-1]]
    assert graph.probabilities().sum() == pytest.approx(1.0)


@given(sequences)
def test_state_and_copy_resume_exactly(sequence):
    graph = learned(sequence)
    twin = TransitionGraph.from_state(graph.state())
    copy = graph.copy()
    for other in (twin, copy):
        for key, value in graph.state().items():
            np.testing.assert_array_equal(other.state()[key], value)
    copy.add_node(99)
    copy.observe(99, 99, 1.0)
    assert 99 not in graph
    snapshot = graph.snapshot()
    np.testing.assert_array_equal(snapshot.prior(sequence[0]), graph.prior(sequence[0]))
    with pytest.raises(InvalidValueError, match="snapshot"):
        snapshot.observe(sequence[0], sequence[0], 1.0)
    with pytest.raises(InvalidValueError, match="snapshot"):
        snapshot.load_state(graph.state())
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


def test_histories_are_bounded_and_keep_what_is_frequent():
    graph = TransitionGraph(order=3, history_capacity=200)
    for id in range(30):
        graph.add_node(id)
    rng = np.random.default_rng(0)
    for _ in range(300):
        a, b, c, d = rng.integers(3, 30, 4).tolist()
        graph.observe(1, 2, 1.0, before=[0])
        graph.observe(c, d, 1.0, before=[a, b])
    assert len(graph.state()["histories"]) <= 200
    frequent = [row for row in graph.state()["histories"].tolist() if row[1:3] == [0, 1]]
    assert frequent[0][-2:] == [2, 300]


def test_chains_of_the_paper():
    graph = paper_graph()
    before = graph.state()
    assert graph.chains() == ((0, 1), (2, 3), (4, 5))
    merged = graph.merged()
    assert merged.graph.ids == (0, 2, 4)
    np.testing.assert_allclose(merged.graph.prior(0), [0, 2 / 3, 1 / 3])
    assert merged.expand(merged.graph.path(2, 4)) == (2, 3, 4, 5)
    for key, value in merged.whole.state().items():  # the undo
        np.testing.assert_array_equal(value, before[key])
    with pytest.raises(UnknownPrimitiveError, match="no chain starts with primitive 3"):
        merged.expand([2, 3])


@given(sequences)
def test_merging_chains_loses_no_count_and_no_time(sequence):
    graph = learned([*range(7), *sequence])
    merged = graph.merged()
    inside = {pair for chain in merged.chains.values() for pair in pairwise(chain)}
    edges = [(i, j) for i, j, *_ in graph.edge_rows().tolist() if (i, j) not in inside]
    head_of = {id: head for head, chain in merged.chains.items() for id in chain}
    outside = sum(graph.count(i, j) for i, j in edges)
    assert merged.graph.n_transitions == outside
    for i, j in edges:
        chain = merged.chains[head_of[i]]
        if i == chain[-1] and j in merged.chains:
            time_s = sum(graph.duration_s(*pair) for pair in [*pairwise(chain), (i, j)])
            assert merged.graph.duration_s(chain[0], j) == pytest.approx(
                time_s, abs=1e-3 * len(chain)
            )


@given(sequences)
def test_chains_hold_everyone_once_and_are_as_long_as_they_can_be(sequence):
    graph = learned([*range(7), *sequence]) if sequence[0] % 2 else learned(sequence)
    exported, chains = graph.to_networkx(), graph.chains()
    assert sorted(id for chain in chains for id in chain) == sorted(graph.ids)

    def bound(i, j):
        return list(exported.successors(i)) == [j] and list(exported.predecessors(j)) == [i]

    for chain in chains:
        assert all(bound(i, j) for i, j in pairwise(chain))
    for one in chains:
        for other in chains:
            assert one is other or not bound(one[-1], other[0])


def test_a_ring_is_opened_once():
    assert learned([3, 1, 2, 3]).chains() == ((1, 2, 3),)
    assert learned([1, 1]).chains() == ((1,),)


def test_the_graph_above_groups_counts():
    graph = paper_graph()
    above = graph.grouped({2: 10, 3: 10, 4: 11, 5: 11})
    assert set(above.ids) == {0, 1, 10, 11}
    assert above.count(10, 10) == 2
    assert above.count(1, 10) == 2
    assert above.n_transitions == graph.n_transitions
    assert graph.count(2, 3) == 2


@settings(max_examples=20)
@given(st.sampled_from([float("nan"), float("inf"), -0.1, 1e9]))
def test_bad_durations_change_nothing(duration_s):
    graph = paper_graph()
    before = graph.state()
    with pytest.raises(InvalidValueError, match="duration_s"):
        graph.observe(0, 1, duration_s)
    np.testing.assert_array_equal(graph.state()["edges"], before["edges"])


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
    edges = state["edges"].copy()
    edges[0, 0] = 44
    for damage in ({"edges": edges}, {"ids": state["ids"][:2]}, {"edges": edges[:, :3]}):
        with pytest.raises(InvalidValueError):
            graph.load_state(state | damage)


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
        return sorted(state["edges"].tolist()), sorted(state["histories"].tolist()), set(graph.ids)

    left, right, inner = learned(a), learned(a), learned(b)
    left.absorb(learned(b))
    left.absorb(learned(c))
    inner.absorb(learned(c))
    right.absorb(inner)
    assert parts(left) == parts(right)
    whole, apart = learned([*a, *b]), learned(a)
    apart.absorb(learned(b))
    for i in whole.ids:
        for j in whole.ids:
            seam = (i, j) == (a[-1], b[0])
            assert whole.count(i, j) == apart.count(i, j) + seam

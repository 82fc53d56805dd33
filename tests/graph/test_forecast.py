import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn.graph import TransitionGraph

sequences = st.lists(st.integers(0, 4), min_size=3, max_size=40)


def learned(sequence, ids, order=2, skip=None, **settings):
    graph = TransitionGraph(order=order, **settings)
    for id in ids:
        graph.add_node(id)
    for t in range(1, len(sequence)):
        if t != skip:
            before = sequence[max(t - order, 0) : t - 1]
            graph.observe(sequence[t - 1], sequence[t], 1.0, before=before)
    return graph


def witten_bell(sequence, context, n, order, weight):
    """Interpolated from the definition, over all positions of the sequence."""
    p = [1 / n] * n
    for length in range(min(order, len(context)) + 1):
        part = tuple(context[len(context) - length :])
        first = max(length, 1)
        after = Counter(
            sequence[t]
            for t in range(first, len(sequence))
            if tuple(sequence[t - length : t]) == part
        )
        if after:
            total, kinds = sum(after.values()), len(after)
            p = [(after[x] + weight * kinds * p[x]) / (total + weight * kinds) for x in range(n)]
    return p


@settings(max_examples=60)
@given(sequences, st.integers(1, 3), st.sampled_from([0.5, 1.0, 2.0]))
def test_back_off_is_witten_and_bells(sequence, order, weight):
    graph = learned(sequence, range(5), order=order, concentration=weight)
    for t in range(1, len(sequence)):
        context = sequence[max(t - order, 0) : t]
        expected = witten_bell(sequence, context, 5, order, weight)
        np.testing.assert_allclose(graph.probabilities(context), expected)


@settings(max_examples=40)
@given(sequences, st.integers(1, 3))
def test_p_values_hold_each_transition_against_the_others(sequence, order):
    graph = learned(sequence, range(5), order=order)
    scores, shares = graph.surprises(sequence), graph.p_values(sequence)
    for length in range(1, order + 1):
        left_out = []
        for t in range(length, len(sequence)):
            others = learned(sequence, range(5), order=order, skip=t)
            p = others.probabilities(sequence[t - length : t])
            left_out.append(-math.log(p[sequence[t]]))
        for t in range(len(scores)):
            if min(t + 1, order) == length:
                as_large = sum(other >= scores[t] * (1 - 1e-9) for other in left_out)
                assert shares[t] == pytest.approx((1 + as_large) / (len(left_out) + 1))
    broken = graph.p_values([sequence[0], None, sequence[1], sequence[2]])
    assert np.isnan(broken).tolist() == [True, True, False]


def markov(rng, n_nodes, length):
    rows = [rng.choice(n_nodes, 3, replace=False) for _ in range(n_nodes)]
    shares = [rng.dirichlet([2.0, 1.0, 0.3]) for _ in range(n_nodes)]
    sequence = [0]
    for _ in range(length):
        sequence.append(int(rng.choice(rows[sequence[-1]], p=shares[sequence[-1]])))
    return sequence


def test_false_alarms_come_at_the_stated_rate():
    rates = {0.02: [], 0.05: [], 0.2: []}
    for seed in range(6):
        sequence = markov(np.random.default_rng(seed), 15, 2500)
        graph = learned(sequence[:1000], range(15))
        p = graph.p_values(sequence[1000:])
        for alpha, shares in rates.items():
            shares.append(np.mean(p <= alpha))
    for alpha, shares in rates.items():
        assert np.mean(shares) <= alpha + 0.01
        assert np.mean(shares) >= 0.3 * alpha  # and not by never giving an alarm


def test_probabilities_are_reliable_on_what_comes_later():
    said, came = [], []
    for seed in range(6):
        sequence = markov(np.random.default_rng(seed), 15, 1500)
        graph = learned(sequence[:600], range(15))
        for t in range(602, len(sequence)):
            for each in graph.predict(sequence[t - 2 : t], 3):
                said.append(each.probability)
                came.append(each.id == sequence[t])
    said, came = np.array(said), np.array(came)
    edges = np.quantile(said, np.linspace(0, 1, 9))
    bins = np.clip(np.searchsorted(edges, said, side="right") - 1, 0, 7)
    gaps = [abs(said[bins == b].mean() - came[bins == b].mean()) for b in range(8)]
    shares = [np.mean(bins == b) for b in range(8)]
    assert np.dot(gaps, shares) < 0.03  # expected calibration error
    assert max(gaps) < 0.08


def test_when_it_comes():
    graph = TransitionGraph()
    for id in range(4):
        graph.add_node(id)
    for seconds in (1.0, 2.0):
        graph.observe(0, 1, seconds)
    graph.observe(0, 2, 6.0)
    when = {each.id: (each.duration_s, each.duration_std_s) for each in graph.predict([0], 4)}
    assert when[1] == (1.5, 0.5)
    assert when[2] == (6.0, 0.0)
    assert when[3] == pytest.approx((3.0, np.std([1, 2, 6])))  # never seen there: whatever follows
    assert all(math.isnan(each.duration_s) for each in graph.predict([3], 2))


def test_asking_changes_nothing():
    sequence = markov(np.random.default_rng(0), 8, 200)
    graph, asked = learned(sequence, range(8)), learned(sequence, range(8))
    asked.predict([0, 1], 5)
    asked.surprises(sequence)
    asked.p_values(sequence)
    assert asked.state() == graph.state()
    asked.observe(0, 0, 1.0)  # what was derived does not outlive a change
    assert asked.p_values([0, 0]) != graph.p_values([0, 0])


def test_an_empty_graph_alarms_at_nothing():
    graph = TransitionGraph()
    assert graph.p_values([]).shape == (0,)
    graph.add_node(0)
    assert graph.p_values([0, 0]) == 1.0
    one = TransitionGraph(order=1)
    one.add_node(0)
    with pytest.raises(InvalidValueError, match="novel"):
        one.path(0, 0, novel=True)

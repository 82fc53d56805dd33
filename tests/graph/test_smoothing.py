import math

import numpy as np
import pytest
from graph_examples import learned, sequences
from hypothesis import given
from hypothesis import strategies as st

from mplearn.graph import TransitionGraph


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


def test_histories_are_bounded_and_keep_what_is_frequent():
    graph = TransitionGraph(order=3, history_capacity=200)
    for id in range(30):
        graph.add_node(id)
    rng = np.random.default_rng(0)
    for _ in range(300):
        a, b, c, d = rng.integers(3, 30, 4).tolist()
        graph.observe(1, 2, 1.0, before=[0])
        graph.observe(c, d, 1.0, before=[a, b])
    assert len(graph.state().histories) <= 200
    frequent = [row for row in graph.state().histories.array.tolist() if row[1:3] == [0, 1]]
    assert frequent[0][-2:] == [2, 300]

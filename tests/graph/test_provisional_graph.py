import math

import numpy as np
import pytest
from graph_examples import learned, sequences
from hypothesis import given

from mplearn.errors import InvalidValueError
from mplearn.graph import ProvisionalGraph, TransitionGraph


def by_id(predictions):
    return {each.id: each for each in predictions}


@given(sequences, sequences)
def test_two_parts_foretell_as_their_sum(inside, beside):
    graph = learned(inside)
    whole = graph.copy()
    whole.add(learned(beside))
    extension = ProvisionalGraph(graph)
    for id in sorted(set(beside)):
        extension.add_node(id)
    for t in range(1, len(beside)):
        extension.observe(beside[t - 1], beside[t], 1.0, before=beside[max(0, t - 2) : t - 1])
    assert extension.ids == whole.ids
    assert graph.edge_rows().tolist() == learned(inside).edge_rows().tolist()
    for history in ([], beside[-1:], beside[-2:], [inside[-1], beside[-1]]):
        ours, theirs = by_id(extension.predict(history, 9)), by_id(whole.predict(history, 9))
        assert ours.keys() == theirs.keys()
        for id, each in ours.items():
            assert each.probability == pytest.approx(theirs[id].probability, abs=1e-12)


def test_nothing_beside_changes_nothing():
    graph = learned([0, 1, 2, 0, 1, 2, 0, 2])
    assert ProvisionalGraph(graph).predict([1, 2], 3) == graph.predict([1, 2], 3)
    assert ProvisionalGraph(TransitionGraph()).predict([], 3) == ()
    with pytest.raises(InvalidValueError, match="k must be at least 1"):
        ProvisionalGraph(graph).predict([], 0)


def test_times_are_those_of_the_part_that_saw_the_transition():
    graph = TransitionGraph()
    for id in (0, 1):
        graph.add_node(id)
    graph.observe(0, 1, 0.6)
    extension = ProvisionalGraph(graph)
    extension.observe(0, 7, 2.0)
    extension.observe(7, 0, 3.0)
    times = {id: each.duration_s for id, each in by_id(extension.predict([0], 9)).items()}
    assert times == {0: 0.6, 1: 0.6, 7: 2.0}  # 0 never followed 0: the graph's mean stands in
    assert by_id(extension.predict([7], 9))[1].duration_s == 3.0
    assert all(math.isnan(each.duration_s) for each in extension.predict([], 9))
    assert np.array_equal(extension.followers((0,)), [0, 1, 1])

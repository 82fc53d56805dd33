"""The state of a graph in blocks: whatever was asked before, and little of it new."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.graph import GraphState, TransitionGraph
from mplearn.state import Kept, checkpoint, from_plain, resumed, to_plain

ids = st.integers(0, 2)
steps = st.lists(
    st.one_of(
        st.tuples(st.just("observe"), ids, ids, ids),
        st.tuples(st.just("remove"), ids),
        st.tuples(st.just("merge"), ids, ids),
        st.tuples(st.just("look")),
        st.tuples(st.just("copy")),
        st.tuples(st.just("resume")),
    ),
    max_size=40,
)


def apply(graph, step, looks):
    """Return the graph after a step; what only looks does nothing unless ``looks``."""
    what, *given_ids = step
    if what in ("observe", "merge"):
        for id in given_ids:
            graph.add_node(id)
    if what == "observe":
        before, previous, after = given_ids
        graph.observe(previous, after, 0.5, before=(before,))
    elif what == "remove" and given_ids[0] in graph:
        graph.remove_node(*given_ids)
    elif what == "merge":
        graph.merge_nodes(*given_ids)
    elif looks and what == "look":
        graph.state()
    elif looks and what == "copy":
        graph.snapshot()
        return graph.copy()
    elif looks and what == "resume":
        return TransitionGraph.from_state(graph.state())
    return graph


@settings(max_examples=60)
@given(steps)
def test_a_state_is_the_same_whatever_was_asked_before(steps):
    asked, never = (TransitionGraph(order=3, history_capacity=24) for _ in range(2))
    for step in steps:
        before = asked.snapshot()
        plain = to_plain(before.state())
        asked, never = apply(asked, step, True), apply(never, step, False)
        if step == ("look",):
            assert asked.state() == never.copy().state()
        again = to_plain(TransitionGraph.from_state(before.state()).state())  # it did not change
        assert all(np.array_equal(plain[name], again[name]) for name in plain)
    one, other = asked.state(), never.state()
    assert one == other
    written = checkpoint(one)
    assert resumed(GraphState, written.document, written.new.__getitem__) == one
    assert from_plain(GraphState, to_plain(one)) == one


@pytest.mark.parametrize("n", [300, 6000])
def test_what_one_more_transition_costs_does_not_grow_with_the_graph(n):
    graph, rng = TransitionGraph(), np.random.default_rng(1)
    for id in range(n):
        graph.add_node(id)
    order = rng.integers(0, n, 3 * n).tolist()
    for before, previous, after in zip(order, order[1:], order[2:], strict=False):
        graph.observe(previous, after, 1.0, before=(before,))
    kept, first = Kept(), checkpoint(graph.state())
    kept.add(0, first.held)
    for k in range(1, 12):
        before, previous, after = rng.integers(0, n, 3).tolist()
        graph.observe(previous, after, 1.0, before=(before,))
        later = checkpoint(graph.state(), kept)
        assert len(later.new) <= 6  # blocks: an edge's, a context's, what that left; the graph
        assert sum(map(len, later.new.values())) < 20_000
        kept.add(k, later.held)
        kept.drop(k - 1)
    assert set(later.parts) == {key for key in (*first.new, *later.parts) if key in kept}

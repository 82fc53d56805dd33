import pytest
from hypothesis import given
from hypothesis import strategies as st

from mplearn.graph import TransitionGraph
from mplearn.learner.foresight import foresee, motions_of
from mplearn.learner.seen_segment import SeenSegment
from mplearn.recording import Segment

LABELS = 5


def chain_of(sequence, known, breaks=()):
    """A chain in which the labels of ``known`` are primitives; others are like one before them."""
    segments, last = [], {}
    for i, label in enumerate(sequence):
        like = None if label in known else last.get(label)
        primitive = label if label in known else None
        segment = Segment(100 * i, 100 * i + 90)
        segments.append(SeenSegment(i, primitive, i not in breaks and i > 0, segment, like=like))
        last[label] = i
    return segments


def counted(sequence, chosen, breaks=()):
    """The graph of a sequence, of the transitions only that ``chosen`` says true of."""
    graph = TransitionGraph()
    for t in range(1, len(sequence)):
        if t not in breaks and chosen(sequence[t - 1], sequence[t]):
            before = sequence[t - 2 : t - 1] if t > 1 and t - 1 not in breaks else []
            for id in (*before, sequence[t - 1], sequence[t]):
                graph.add_node(id)
            graph.observe(sequence[t - 1], sequence[t], 1.0, before=before)
    for id in sequence:
        graph.add_node(id)
    return graph


@given(
    st.lists(st.integers(0, LABELS - 1), min_size=2, max_size=40),
    st.sets(st.integers(2, 39), max_size=3),
)
def test_motions_that_are_no_primitives_are_foretold_as_labels_would_be(sequence, breaks):
    segments = chain_of(sequence, set(), breaks)
    perfect = counted(sequence, lambda *_: True, breaks)
    history = sequence[-1:] if len(sequence) - 1 in breaks else sequence[-2:]
    expected = {each.id: each for each in perfect.predict(history, 99)}
    foreseen = foresee(TransitionGraph(), segments, 100.0, 99, broken=False)
    assert all(each.id is None for each in foreseen)
    assert {sequence[each.segments[0]] for each in foreseen} == set(sequence)
    for each in foreseen:
        label = sequence[each.segments[0]]
        assert all(sequence[number] == label for number in each.segments)
        assert each.probability == pytest.approx(expected[label].probability, abs=1e-12)
        assert each.duration_s == pytest.approx(expected[label].duration_s, nan_ok=True)


@given(st.lists(st.integers(0, LABELS - 1), min_size=2, max_size=40))
def test_primitives_and_others_are_foretold_together(sequence):
    known = {0, 1, 2}
    graph = counted(sequence, lambda a, b: a in known and b in known)
    for id in [id for id in graph.ids if id not in known]:
        graph.remove_node(id)
    foreseen = foresee(graph, chain_of(sequence, known), 100.0, 99, broken=False)
    perfect = counted(sequence, lambda *_: True)
    expected = {each.id: each for each in perfect.predict(sequence[-1:], 99)}
    assert sum(each.probability for each in foreseen) == pytest.approx(1.0)
    assert {each.id for each in foreseen if each.id is not None} == known & set(sequence)
    seconds = {sequence[each.segments[0]]: each.duration_s for each in foreseen}
    for label, each in expected.items():
        if perfect.seen((sequence[-1],), label):
            assert seconds[label] == pytest.approx(each.duration_s)


def test_what_comes_after_a_break_depends_on_nothing():
    segments = chain_of([0, 1, 0, 1, 0], set())
    after = foresee(TransitionGraph(), segments, 100.0, 2, broken=True)
    assert [each.probability for each in after] == pytest.approx([0.5, 0.5])
    assert foresee(TransitionGraph(), [], 100.0, 2, broken=False) == ()


def test_a_motion_is_that_of_what_it_is_like():
    segment = Segment(0, 50)
    segments = [
        SeenSegment(i, None, True, segment, like=like) for i, like in ((4, None), (6, 4), (9, 6))
    ]
    assert set(motions_of(segments).values()) == {-5}
    segments[0].primitive = 3  # a primitive was born of it, or it was moved there
    assert set(motions_of(segments).values()) == {3}
    assert motions_of(segments[1:]) == {6: -7, 9: -7}  # what it was like is forgotten

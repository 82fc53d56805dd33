"""Graphs that several tests learn from sequences."""

from hypothesis import strategies as st

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

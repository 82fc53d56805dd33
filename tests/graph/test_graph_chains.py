from itertools import pairwise

import numpy as np
import pytest
from graph_examples import learned, paper_graph, sequences
from hypothesis import given

from mplearn.errors import UnknownPrimitiveError


def test_chains_of_the_paper():
    graph = paper_graph()
    before = graph.state()
    assert graph.chains() == ((0, 1), (2, 3), (4, 5))
    merged = graph.merged()
    assert merged.graph.ids == (0, 2, 4)
    np.testing.assert_allclose(merged.graph.prior(0), [0, 2 / 3, 1 / 3])
    assert merged.expand(merged.graph.path(2, 4)) == (2, 3, 4, 5)
    assert merged.whole.state() == before  # the undo
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

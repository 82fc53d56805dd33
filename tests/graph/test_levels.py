import math

import networkx as nx
import numpy as np
import pytest

from mplearn.errors import InvalidValueError, NoPathError, UnknownPrimitiveError
from mplearn.graph import LevelledGraph, TransitionGraph, tree_levels


def large_graph(n_groups, size, rng, n_neighbours=4):
    """Groups of motions that mostly follow each other, with ways to a few other groups."""
    graph = TransitionGraph(order=1)
    n = n_groups * size
    for id in range(n):
        graph.add_node(id)
    near = [rng.choice(n_groups, n_neighbours, replace=False) for _ in range(n_groups)]
    for id in range(n):
        first = id // size * size
        followers = (first + rng.integers(0, size, 4)).tolist()
        if rng.random() < 0.1:
            followers.append(int(rng.choice(near[id // size])) * size + int(rng.integers(size)))
        for follower in followers:
            for _ in range(int(rng.integers(1, 3))):
                graph.observe(id, follower, 1.0)
    return graph


def test_searching_above_first_needs_fewer_expansions_among_ten_thousand():
    rng = np.random.default_rng(0)
    size, n_groups = 100, 100
    graph = large_graph(n_groups, size, rng)
    groups = [{id: 10**6 + id // size for id in graph.ids}]
    levelled = LevelledGraph(graph, groups)
    flat = LevelledGraph(graph, [])
    few, many, detours = 0, 0, []
    for start, goal in rng.integers(0, len(graph), (8, 2)).tolist():
        below, above = flat.path(start, goal), levelled.path(start, goal)
        assert (above.nodes[0], above.nodes[-1]) == (start, goal)
        assert all(graph.count(i, j) for i, j in zip(above.nodes, above.nodes[1:], strict=False))
        assert above.cost == pytest.approx(-graph.log_probability(above.nodes))
        assert below.cost == pytest.approx(
            nx.dijkstra_path_length(graph.view(), start, goal, weight="cost")
        )
        assert above.cost >= below.cost - 1e-9
        few, many = few + above.n_expanded, many + below.n_expanded
        detours.append(above.cost / below.cost)
    assert many > 4 * few
    assert np.mean(detours) < 1.3


def test_where_the_groups_mislead_the_whole_graph_is_searched():
    # the group of 1 and 2 joins 0 to 3, but inside it no way leads from 1 to 2, save by 9
    graph = TransitionGraph()
    for id in (0, 1, 2, 3, 9):
        graph.add_node(id)
    for i, j in ((0, 1), (2, 3), (1, 9), (9, 2)):
        graph.observe(i, j, 1.0)
    levelled = LevelledGraph(graph, [{1: 100, 2: 100}])
    assert levelled.graphs[1].path(0, 3) == (0, 100, 3)
    assert levelled.path(0, 3).nodes == (0, 1, 9, 2, 3) == graph.path(0, 3)
    with pytest.raises(NoPathError, match="from primitive 3 to 0"):
        levelled.path(3, 0)
    with pytest.raises(UnknownPrimitiveError, match="77"):
        levelled.path(77, 0)
    with pytest.raises(InvalidValueError, match="two groups"):
        LevelledGraph(graph, [{1: 100, 2: 100}, {1: 5, 2: 6}])


def test_levels_of_a_tree():
    #      0
    #    1     2
    #  3   4   |
    #  |  5 6  |
    parents = {0: None, 1: 0, 2: 0, 3: 1, 4: 1, 5: 4, 6: 4}
    fine, coarse = tree_levels(parents)
    assert fine == {2: 2, 3: 3, 5: 4, 6: 4}
    assert coarse == {2: 2, 3: 1, 5: 1, 6: 1}
    assert tree_levels({0: None, 1: 0, 2: 0}) == ()
    assert tree_levels({0: None}) == tree_levels({}) == ()


def test_each_level_counts_what_happens_between_its_groups():
    rng = np.random.default_rng(3)
    graph = large_graph(6, 5, rng)
    fine = {id: 100 + id // 5 for id in graph.ids}
    coarse = {id: 200 + id // 10 for id in graph.ids}
    levelled = LevelledGraph(graph, [fine, coarse])
    assert [len(each) for each in levelled.graphs] == [30, 6, 3]
    for each in levelled.graphs:
        assert each.n_transitions == graph.n_transitions
    for start, goal in rng.integers(0, 30, (20, 2)).tolist():
        if nx.has_path(graph.view(), start, goal):
            assert math.isfinite(levelled.path(start, goal).cost)

"""Policies against closed forms: the prior itself, argmax, brute force over all paths."""

from itertools import pairwise, permutations

import networkx as nx
import numpy as np
import pytest
from gymnasium.spaces import Discrete
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chisquare

from mplearn.errors import InvalidValueError, NoPathError, UnknownPrimitiveError
from mplearn_agents.policies import POLICIES, Greedy, PathToGoal, RandomWalk, UniformLegal


def make_info(weights, legal=None):
    prior = np.asarray(weights, dtype=np.float64)
    mask = (prior > 0) if legal is None else np.asarray(legal, dtype=bool)
    return {"transition_prior": prior / prior.sum(), "action_mask": mask.astype(np.int8)}


def draws(policy, info, n):
    return np.bincount(
        [policy.act(None, info) for _ in range(n)], minlength=len(info["action_mask"])
    )


def test_the_random_walk_draws_from_the_prior():
    info = make_info([0.0, 5.0, 1.0, 0.0, 2.0, 4.0])
    counts = draws(RandomWalk(seed=5), info, 4000)
    legal = info["transition_prior"] > 0
    assert not counts[~legal].any()
    assert chisquare(counts[legal], 4000 * info["transition_prior"][legal]).pvalue > 1e-3


def test_the_random_walk_is_the_action_spaces_own_sample():
    info, space, policy = make_info([1, 2, 3, 4]), Discrete(4, seed=11), RandomWalk()
    policy.reset(11)
    expected = [int(space.sample(probability=info["transition_prior"])) for _ in range(50)]
    assert [policy.act(None, info) for _ in range(50)] == expected


def test_uniform_draws_evenly_among_legal_actions():
    info = make_info([9, 1, 0, 1, 0], legal=[1, 1, 0, 1, 1])
    counts = draws(UniformLegal(seed=2), info, 4000)
    assert counts[2] == 0
    assert chisquare(counts[[0, 1, 3, 4]]).pvalue > 1e-3


@pytest.mark.parametrize("name", ["random", "uniform", "greedy"])
@settings(max_examples=60, deadline=None)
@given(
    weights=st.lists(st.integers(0, 5), min_size=1, max_size=12).filter(any),
    seed=st.integers(0, 99),
)
def test_no_policy_ever_takes_an_illegal_action(name, weights, seed):
    policy, info = POLICIES[name](None), make_info(weights)
    policy.reset(seed)
    actions = [policy.act(None, info) for _ in range(5)]
    assert all(info["action_mask"][action] for action in actions)
    policy.reset(seed)
    assert [policy.act(None, info) for _ in range(5)] == actions
    if name == "greedy":
        assert set(actions) == {int(np.argmax(info["transition_prior"]))}


def test_a_reset_without_a_seed_goes_on_instead_of_repeating():
    info = make_info(np.ones(50))
    for policy in (RandomWalk(3), UniformLegal(3)):
        first = [policy.act(None, info) for _ in range(8)]
        policy.reset()
        assert [policy.act(None, info) for _ in range(8)] != first


def graph_of(weights):
    rows = np.asarray(weights, dtype=np.float64)
    rows = rows / np.maximum(rows.sum(axis=1, keepdims=True), 1)
    graph = nx.DiGraph()
    graph.add_nodes_from(range(len(rows)))
    graph.add_edges_from(
        (i, j, {"probability": rows[i, j]}) for i, j in zip(*np.nonzero(rows), strict=True)
    )
    return graph, rows


def all_paths(rows, start, goal):
    others = [k for k in range(len(rows)) if k not in (start, goal)]
    for n in range(len(others) + 1):
        for middle in permutations(others, n):
            path = (start, *middle, goal)
            p = np.prod([rows[a, b] for a, b in pairwise(path)])
            if p > 0:
                yield path, float(p)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("prefer", ["likely", "short"])
def test_the_path_to_a_goal_is_the_best_of_all_paths(prefer, seed):
    rng = np.random.default_rng(seed)
    weights = rng.integers(1, 9, (6, 6)) * (rng.random((6, 6)) < 0.4)
    weights[np.arange(6), np.arange(1, 7) % 6] += 1  # a ring: everything can be reached
    graph, rows = graph_of(weights)
    policy, at, walked = PathToGoal(graph, goal=4, prefer=prefer), 0, [0]
    while at != 4:
        at = policy.act(None, make_info(rows[at]))
        walked.append(at)
    paths = dict(all_paths(rows, 0, 4))
    if prefer == "likely":
        assert paths[tuple(walked)] == pytest.approx(max(paths.values()))
    else:
        fewest = min(map(len, paths))
        assert len(walked) == fewest
        assert paths[tuple(walked)] == pytest.approx(
            max(p for path, p in paths.items() if len(path) == fewest)
        )


def test_a_goal_out_of_reach_is_said():
    graph, rows = graph_of([[0, 1, 1, 0], [1, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]])
    policy = PathToGoal(graph, goal=3)
    with pytest.raises(NoPathError, match=r"\[1, 2\] leads to 3"):
        policy.act(None, make_info(rows[0]))
    assert policy.act(None, make_info(rows[1])) == 0  # there is no choice
    with pytest.raises(UnknownPrimitiveError, match=r"goal 7 .* \[0, 1, 2, 3\]"):
        PathToGoal(graph, goal=7)
    with pytest.raises(InvalidValueError, match="'cheap'"):
        PathToGoal(graph, goal=1, prefer="cheap")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"action_mask": [0, 0, 0]}, "allows an action"),
        ({"transition_prior": [0.5, 0.2, 0.2]}, "sum to 1"),
        ({"transition_prior": [0.5, 0.5]}, "3 probabilities"),
        ({"action_mask": [1, 1, 0]}, r"masked actions \[2\]"),
    ],
)
def test_an_info_that_contradicts_itself_is_refused(change, said):
    info = make_info([1, 1, 1]) | {key: np.array(value) for key, value in change.items()}
    with pytest.raises(InvalidValueError, match=said):
        Greedy().act(None, info)


def test_an_info_without_a_prior_is_refused():
    with pytest.raises(InvalidValueError, match=r"needs info\['transition_prior'\].*\['x'\]"):
        RandomWalk().act(None, {"x": 1})

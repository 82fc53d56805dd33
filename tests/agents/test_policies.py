"""Policies against closed forms: the prior itself, argmax, brute force over all paths."""

import copy
from itertools import pairwise, permutations

import networkx as nx
import numpy as np
import pytest
from graph_world import DISCOUNT, GraphWorld
from gymnasium.spaces import Discrete
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chisquare

from mplearn.errors import InvalidValueError, NoPathError, UnknownPrimitiveError
from mplearn.graph import TransitionGraph
from mplearn_agents.policies import (
    POLICIES,
    Greedy,
    Imitation,
    Mirror,
    PathToGoal,
    PathToTask,
    RandomWalk,
    Search,
    UniformLegal,
)


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


def test_the_quick_path_is_the_one_of_least_time():
    rng = np.random.default_rng(3)
    weights = rng.integers(1, 9, (6, 6)) * (rng.random((6, 6)) < 0.5)
    weights[np.arange(6), np.arange(1, 7) % 6] += 1
    graph, rows = graph_of(weights)
    nx.set_node_attributes(graph, dict(enumerate(rng.uniform(0.5, 5.0, 6))), "duration_s")

    def time_s(path):
        return sum(graph.nodes[node]["duration_s"] for node in path[1:])

    for goals in ({4}, {2, 5}):
        policy, walked = PathToGoal(graph, goals, "quick"), [0]
        while walked[-1] not in goals:
            walked.append(policy.act(None, make_info(rows[walked[-1]])))
        assert time_s(walked) == pytest.approx(
            min(time_s(path) for goal in goals for path, _ in all_paths(rows, 0, goal))
        )


def test_paths_to_what_a_task_wants():
    graph, rows = graph_of(np.ones((4, 4)) - np.eye(4))
    info = make_info(rows[0]) | {"task": {"slots": (3, 1)}}
    assert PathToTask(graph, in_order=True, prefer="short").act(None, info) == 3
    assert PathToTask(graph, in_order=False, prefer="short").act(None, info) == 1
    with pytest.raises(InvalidValueError, match="names slots in info"):
        PathToTask(graph, in_order=True).act(None, make_info(rows[0]))


def test_imitation_draws_from_the_longer_history():
    """From 1 by 0 always to 2 and from 2 by 0 to 1: the last primitive alone does not tell."""
    graph, walked = TransitionGraph(), [11, 10, 12, 10] * 40
    for id in (10, 11, 12):
        graph.add_node(id)
    for t in range(1, len(walked)):
        graph.observe(walked[t - 1], walked[t], 1.0, before=walked[max(0, t - 3) : t - 1])
    slots = {10: 1, 11: 2, 12: 3}
    policy = Imitation(graph, slots, seed=1)
    counts = np.zeros((4, 4))
    at, before = 2, None
    policy.act(None, make_info([0, 0, 1, 0]) | {"primitive": -1})
    for _ in range(400):
        weights = [0, 0, 1, 1] if at == 1 else [0, 1, 0, 0]
        action = policy.act(None, make_info(weights) | {"primitive": at})
        if at == 1:
            counts[before, action] += 1
        at, before = action, at
    wanted = graph.probabilities([11, 10])[list(graph.ids).index(12)]
    assert wanted > 0.8
    assert counts[2, 3] / counts[2].sum() == pytest.approx(wanted, abs=0.1)
    assert counts[3, 2] / counts[3].sum() == pytest.approx(wanted, abs=0.1)
    policy.act(None, make_info([0, 0, 1, 1]) | {"primitive": -1})  # a new episode: by the prior


def test_imitation_takes_what_is_known_by_now_where_that_grows():
    """It knew nothing at first, then that 10 follows 11; then 10 is gone, and 12 does."""

    def known(after):
        graph = TransitionGraph()
        for id in (11, after):
            graph.add_node(id)
        for _ in range(50):
            graph.observe(11, after, 1.0)
        return graph, {11: 1, after: 2}

    now = [(TransitionGraph(), {})]
    policy = Imitation(*now[0], seed=1, renew=lambda: now[0])
    even = make_info([0, 1, 1])
    for after in (10, 12):
        now[0] = known(after)
        info = even | {"library_version": str(after)}
        assert policy.act(None, make_info([0, 1, 0]) | info | {"primitive": -1}) in (1, 2)
        policy.act(None, make_info([0, 1, 0]) | {"library_version": str(after), "primitive": 11})
        drawn = []
        for _ in range(20):
            policy._history = [10, 11]
            drawn.append(policy.act(None, info | {"primitive": 11}))
        assert np.mean(np.array(drawn) == 2) > 0.9


def test_a_mirror_does_what_is_recognised_and_waits_where_it_may_not():
    info = {"action_mask": np.array([1, 1, 0, 1])}

    def seen(slot, elapsed):
        task = np.full(14, 0.25)
        task[:4] = np.arange(4) == slot
        task[-2] = elapsed
        return {"task": task}

    assert Mirror().act(seen(None, 0.5), info) == 0  # nothing is recognised yet
    assert Mirror().act(seen(3, 0.5), info) == 3
    assert Mirror().act(seen(3, 1.1), info) == 0  # it should be over
    assert Mirror().act(seen(2, 0.5), info) == 0  # not legal here
    with pytest.raises(InvalidValueError, match="follow"):
        Mirror().act({"task": np.zeros(5)}, info)


def best_return(world, at, time_s, horizon_s):
    """Brute force over all sequences, each action paid as far as it lies within the horizon."""
    best = 0.0
    for node in [0, *world.edges[at]]:
        duration_s, reward = (0.5, 0.0) if node == 0 else world.paid(node)
        value = reward * min(1.0, (horizon_s - time_s) / duration_s)
        there, end_s = (node or at), time_s + duration_s
        if there not in world.ends and end_s < horizon_s:
            value += DISCOUNT**duration_s * best_return(world, there, end_s, horizon_s)
        best = max(best, value)
    return best


@pytest.mark.parametrize("seed", range(6))
def test_search_finds_the_best_sequence(seed):
    rng = np.random.default_rng(seed)
    world = GraphWorld(
        edges={k: sorted({1 + k % 5, *rng.integers(1, 6, 2).tolist()}) for k in range(6)},
        duration_s=[0.5, *rng.uniform(0.8, 2.0, 5)],
        reward=[0.0, *rng.normal(0.3, 1.0, 5)],
        ends=(5,),
    )
    horizon_s = 4.0
    policy = Search(world, copy.deepcopy(world), horizon_s, beam=10_000)
    observation, info = world.reset()
    policy.twin.reset()
    state = world.state()
    action = policy.act(observation, info)
    assert world.state() == state
    duration_s, reward = (0.5, 0.0) if action == 0 else world.paid(action)
    value = reward * min(1.0, horizon_s / duration_s)
    if action not in world.ends and duration_s < horizon_s:
        rest = best_return(world, action or 0, duration_s, horizon_s)
        value += DISCOUNT**duration_s * rest
    assert value == pytest.approx(best_return(world, 0, 0.0, horizon_s))


def test_search_takes_the_likelier_of_equal_ways():
    world = GraphWorld({0: [1, 2], 1: [3], 2: [3], 3: [1]}, [0.5, 1, 1, 1], [0, 0, 0, 1], (3,))
    info = world.reset()[1]
    info["transition_prior"][[1, 2]] = 0.2, 0.8
    assert Search(world, copy.deepcopy(world), 5.0).act(None, info) == 2
    with pytest.raises(InvalidValueError, match="0 and 3"):
        Search(world, world, 0, 3)
    with pytest.raises(InvalidValueError, match=r"gymnasium\.make supplies"):
        Search.for_env(world)

"""An agent that explores: it goes where it can get soonest, and where it is likely to get."""

from collections import Counter

import gymnasium
import numpy as np
import pytest

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError
from mplearn_agents.episodes import play
from mplearn_agents.policies import PathToTask
from mplearn_agents.policies.experienced import Experience, Experienced, explore


def known(edges, falls=(), capacity=8):
    """Return an experience of a graph whose actions all last as long, each tried often."""
    experience = Experience(capacity, capacity)
    for place, sets in edges.items():
        experience.legal[place] = Counter(sets)
        for action in {a for legal in sets for a in legal}:
            for k in range(100):
                fell = (place, action) in falls and k < 50
                experience.note(place, action, 2.0, 0.9, -0.01, fell)
    return experience


def info_of(place, legal, goals, capacity=8):
    mask = np.zeros(capacity, np.int8)
    mask[[0, *legal]] = 1
    return {"current_primitive": place}, {"action_mask": mask, "task": {"slots": np.array(goals)}}


def test_a_way_counts_as_much_as_it_is_to_be_expected():
    # 1 -> 2 -> 5 is short, but only one of ten people goes from 2 to 5; 1 -> 3 -> 4 -> 5 is sure
    edges = {1: {(2, 3): 10}, 2: {(5,): 1, (6,): 9}, 3: {(4,): 10}, 4: {(5,): 10},
             6: {(7,): 10}, 7: {(6,): 10}, 5: {(1,): 10}}  # fmt: skip
    policy = Experienced(known(edges), in_order=False)
    policy.reset()
    assert policy.act(*info_of(1, (2, 3), [5])) == 3
    policy.act(*info_of(2, (5,), [5]))  # now it is seen that this person does
    assert policy.act(*info_of(1, (2, 3), [5])) == 2
    policy.reset()
    assert policy.act(*info_of(1, (2, 3), [5])) == 3


def test_who_falls_takes_another_way():
    edges = {1: {(2, 3): 10}, 2: {(5,): 10}, 3: {(4,): 10}, 4: {(5,): 10}, 5: {(1,): 10}}
    assert Experienced(known(edges), False).act(*info_of(1, (2, 3), [5])) == 2
    risky = known(edges, falls={(1, 2)})
    assert Experienced(risky, False).act(*info_of(1, (2, 3), [5])) == 3


def test_it_holds_where_nothing_else_is_legal_and_needs_a_goal():
    policy = Experienced(known({1: {(2,): 1}, 2: {(1,): 1}}), True)
    assert policy.act(*info_of(1, (), [2])) == 0
    with pytest.raises(InvalidValueError, match="needs a task that names slots"):
        policy.act(*info_of(1, (2,), [-1]))


def test_it_finds_out_what_the_planner_is_told():
    env = gymnasium.make("mplearn/PrimitiveHumanoid-v0", dynamics="kinematic", task="recite")
    policy = Experienced.for_env(env, steps=1500)
    assert (policy.experience.tried.sum(axis=1) > 0).sum() > 15
    told = play(env, PathToTask.for_env(env, "quick"), 6, seed=4)
    found = play(env, policy, 6, seed=4)
    assert [e.success for e in found] == [e.success for e in told]
    assert np.mean([e.return_ for e in found]) > np.mean([e.return_ for e in told]) - 0.05
    again = explore(gymnasium.make(env.spec.id, **env.spec.kwargs), 200, seed=3)
    same = explore(gymnasium.make(env.spec.id, **env.spec.kwargs), 200, seed=3)
    np.testing.assert_array_equal(again.tried, same.tried)

"""The task goal: its goals can be reached, and in no less time than it says."""

import numpy as np
import pytest
from standing_env import SLOT, legal
from standing_task import make, named, shortest_way

from mplearn.errors import InvalidValueError
from mplearn_envs.execution.earliest_arrival import earliest_arrivals
from mplearn_envs.tasks import GoalTask


@pytest.mark.parametrize("kind", ("hand", "posture", "primitive"))
def test_goals_are_drawn_by_seed_not_yet_reached_and_reached_in_the_least_time(kind):
    env = make(GoalTask(kind))
    goals = set()
    for seed in range(12):
        observation, info = env.reset(seed=seed)
        again, _ = env.reset(seed=seed)
        np.testing.assert_array_equal(observation["task"], again["task"])
        goals.add(observation["task"].tobytes())
        assert not info["is_success"]
        time_s, value, terminated = 0.0, 0.0, False
        for action in shortest_way(env, info, named(info)):
            assert not terminated
            _, reward, terminated, _, info = env.step(action)
            value += 0.95**time_s * reward
            time_s += info["duration_s"]
        assert terminated and info["is_success"]
        assert time_s == pytest.approx(info["task"]["least_time_s"], abs=1e-9)
        hurry = -0.1 * (1 - 0.95**time_s) / -np.log(0.95)
        assert value == pytest.approx(hurry + 0.95**time_s, rel=0.02)
    assert len(goals) > 3


def test_soonest_arrivals_are_those_of_all_ways():
    env = make("free")
    env.reset()
    repertoire = env.unwrapped.repertoire
    found = earliest_arrivals(repertoire, repertoire.entries(env.unwrapped.performer.reference))
    best = {}
    rng = np.random.default_rng(0)
    for _ in range(60):
        _, info = env.reset(seed=0)
        time_s = 0.0
        for _ in range(5):
            options = [slot for slot in legal(info) if slot]
            if not options:
                break
            *_, info = env.step(rng.choice(options))
            time_s += info["duration_s"]
            best[info["primitive"]] = min(best.get(info["primitive"], np.inf), time_s)
    assert set(best) == set(found)
    for id, time_s in best.items():
        assert found[id].time_s == pytest.approx(time_s, abs=0.05)


def test_a_hand_reaches_its_point():
    env = make(GoalTask("hand", far_m=0.15, tolerance_m=0.05))
    observation, info = env.reset(seed=3)
    start = observation["task"]
    for action in shortest_way(env, info, named(info)):
        observation, *_ = env.step(action)
    end = observation["task"]
    np.testing.assert_array_equal(start[:5], end[:5])
    assert np.linalg.norm(start[5:8]) > 0.15 and np.linalg.norm(end[5:8]) <= 0.05
    env.unwrapped.performer.show()
    hand = env.unwrapped.data.body(("hand_l", "hand_r")[int(start[1])]).xpos
    assert hand[2] == pytest.approx(end[4] - end[7], abs=1e-5)
    assert start[8] == 1.0 and 0.0 < end[8] < 1.0


def test_a_goal_ends_at_its_deadline():
    env = make(GoalTask("primitive", target="rise", deadline_s=6.0))
    env.reset()
    terminated, n = False, 0
    while not terminated:
        _, _, terminated, _, info = env.step(0)
        n += 1
    assert n == 12 and not info["is_success"] and not info["fallen"]


def test_given_goals():
    bow = {"base_pitch": 0.8}
    env = make(GoalTask("posture", target=bow))
    observation, info = env.reset()
    assert named(info) == [SLOT["bow down"]]
    apart = observation["task"][33:66]
    assert apart[2] == pytest.approx(0.8, abs=0.01) and np.count_nonzero(apart) == 1
    assert env.step(SLOT["bow down"])[4]["is_success"]
    env = make(GoalTask("primitive"))
    assert named(env.reset(options={"target": "rise"})[1]) == [SLOT["rise"]]
    with pytest.raises(InvalidValueError, match=r"\('target',\) here, not \['targt'\]"):
        env.reset(options={"targt": "rise"})
    assert named(env.reset(options={"target": 4})[1]) == [SLOT["arms down"]]

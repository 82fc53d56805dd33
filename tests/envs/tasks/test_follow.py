"""The task follow: its demonstrator, what is seen of him, and what is paid."""

import numpy as np
import pytest
from standing_env import SLOT, legal
from standing_task import make

from mplearn_envs.tasks import FollowTask


def schedule(task):
    return list(zip(task._ids, task._ends_s, strict=True))


def test_the_demonstrator_depends_on_the_seed_alone():
    task = FollowTask(deadline_s=20.0)
    env = make(task)
    seen = []
    for actions in ((0,) * 50, (SLOT["squat"], SLOT["rise"]) * 20):
        env.reset(seed=5)
        for action in actions:
            if env.step(action)[2]:
                break
        seen.append(schedule(task))
    common = min(len(s) for s in seen)
    assert common > 5 and seen[0][:common] == seen[1][:common]
    env.reset(seed=6)
    assert schedule(task) != seen[0][: len(schedule(task))]


def test_agreement_is_paid_while_both_do_the_same():
    """Against the integral over the true intervals."""
    task = FollowTask(agree=2.0)
    env = make(task, discount=0.9)
    repertoire = env.unwrapped.repertoire
    for seed in range(5):
        env.reset(seed=seed)
        time_s = 0.0
        for name in ("squat", "rise", "arms up", "arms down", "bow down"):
            *_, info = env.step(SLOT[name])
            assert not info["illegal"]
            end_s = time_s + info["duration_s"]
            expected, start_s = 0.0, 0.0
            for id, until_s in schedule(task):
                low, high = max(start_s, time_s), min(until_s, end_s)
                if repertoire.slots[id] == SLOT[name] and low < high:
                    rate = -np.log(0.9)
                    powers = 0.9 ** (low - time_s) - 0.9 ** (high - time_s)
                    expected += 2.0 * powers / rate
                start_s = until_s
            assert info["reward_terms"]["agree"] == pytest.approx(expected, abs=0.05)
            time_s = end_s


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_motion_is_shown_after_a_share_of_it_and_predicts(share):
    task = FollowTask(recognised_after=share)
    env = make(task)
    repertoire = env.unwrapped.repertoire
    observation, _ = env.reset(seed=4)
    assert not observation["task"][:32].any()
    time_s = 0.0
    for _ in range(40):
        observation, *_, info = env.step(0)
        time_s += info["duration_s"]
        shown = observation["task"]
        began_s, known = 0.0, []
        for id, end_s in schedule(task):
            if began_s + share * (end_s - began_s) <= time_s:
                known.append((id, began_s))
            began_s = end_s
        assert np.flatnonzero(shown[:32]).tolist() == [repertoire.slots[id] for id, _ in known[-1:]]
        after, later = shown[32:64], shown[64:96]
        assert after.sum() == pytest.approx(1.0) and later.sum() == pytest.approx(1.0)
        following = schedule(task)[len(known) :]
        assert not following or after[repertoire.slots[following[0][0]]] > 0.0
        if known:
            id, began_s = known[-1]
            usual_s = repertoire.skills.duration_s(id) / task.pace
            assert shown[97] == pytest.approx(max(0.0, 1.0 - time_s / task.deadline_s))
            assert shown[96] == pytest.approx(min((time_s - began_s) / usual_s, 3.0))
            if repertoire.after(id).mask.sum() == 2 and following:
                assert after.argmax() == repertoire.slots[following[0][0]]


def test_the_demonstrator_takes_his_time():
    for pace in (0.5, 1.0):
        task = FollowTask(pace=pace, variation=0.0, deadline_s=30.0)
        env = make(task)
        env.reset(seed=2)
        while not env.step(0)[2]:
            pass
        began_s = 0.0
        for id, end_s in schedule(task):
            usual_s = env.unwrapped.repertoire.skills.duration_s(id)
            assert end_s - began_s == pytest.approx(usual_s / pace)
            began_s = end_s


def test_who_knows_the_demonstrator_agrees_more_than_who_does_not():
    task = FollowTask(deadline_s=40.0)
    env = make(task)
    means = {}
    for knows in (True, False):
        agreement = []
        for seed in range(6):
            _, info = env.reset(seed=seed)
            rng, over = np.random.default_rng(seed), False
            while not over:
                options = [slot for slot in legal(info) if slot] or [0]
                wanted = info["task"]["demonstrator"]
                action = wanted if wanted in options else 0
                *_, over, _, info = env.step(action if knows else rng.choice(options))
            agreement.append(info["task"]["agreement"])
        means[knows] = np.mean(agreement)
    assert means[True] > 2 * means[False]


def test_what_is_missed_of_the_best_return_is_the_regret():
    """Nobody agrees more than always; whoever holds has all of it as his regret."""
    env = make(FollowTask(deadline_s=10.0), discount=0.9)
    _, info = env.reset(seed=3)
    best = info["task"]["best_return"]
    assert best == pytest.approx((1.0 - 0.9**10.0) / -np.log(0.9), rel=0.01)
    assert info["task"]["idle_return"] == 0.0
    total, discount, over = 0.0, 1.0, False
    while not over:
        _, reward, over, _, info = env.step(legal(info)[-1])
        total += discount * float(reward)
        discount *= info["discount"]
    assert 0.0 <= total < best

"""The task recite: ways round, and no shortcuts."""

from itertools import pairwise

import pytest
from standing_env import SLOT, legal
from standing_task import make, named, shortest_way

from mplearn_envs.tasks import ReciteTask


def test_requests_ask_for_ways_round():
    env = make(ReciteTask(length=3))
    repertoire = env.unwrapped.repertoire
    for seed in range(10):
        observation, info = env.reset(seed=seed)
        request = named(info)
        blocks = observation["task"][:-1].reshape(3, 32)
        assert blocks.argmax(axis=1).tolist() == request and blocks.sum() == 3
        assert request[0] not in legal(info)  # the shortcut is illegal
        for before, after in pairwise(request):
            assert not repertoire.after(repertoire.primitive(before)).mask[after]
        earned, terminated = 0.0, False
        for slot in request:
            for action in shortest_way(env, info, (slot,)):
                observation, _, terminated, _, info = env.step(action)
                earned += info["reward_terms"]["said"] / info["discount"]
        assert terminated and info["is_success"] and named(info) == []
        assert earned == pytest.approx(3.0)
        assert info["reward_terms"]["complete"] == pytest.approx(info["discount"])
        assert not observation["task"][:-1].any()


def test_a_shortcut_says_nothing():
    env = make(ReciteTask(request=("rise", "arms down")))
    env.reset()
    *_, info = env.step(SLOT["rise"])
    assert info["illegal"] and info["reward_terms"]["said"] == 0.0
    assert named(info) == [SLOT["rise"], SLOT["arms down"]]

"""The same again: in a new process, after other episodes, and in copies."""

import copy
import hashlib
import os
import pickle
import subprocess
import sys

import numpy as np
import pytest
from standing_env import SLOT, make, walk


def test_the_same_seed_gives_the_same_in_a_new_process():
    here = walk(make(), 6, 5)
    code = (
        "import standing_env as t, hashlib;"
        "print(hashlib.sha256(repr(t.walk(t.make(), 6, 5)).encode()).hexdigest())"
    )
    path = os.pathsep.join(p for p in sys.path if p)
    there = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": path},
    ).stdout.strip()
    assert there == hashlib.sha256(repr(here).encode()).hexdigest()


def test_an_episode_does_not_depend_on_what_was_before():
    env = make()
    walk(env, 5, 1)
    assert walk(env, 4, 2) == walk(make(), 4, 2)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))])
def test_copies_go_on_bit_for_bit(copied):
    env = make().unwrapped
    env.reset(seed=0)
    env.step(SLOT["bow down"])
    twin = copied(env)
    env.frame_callback = lambda: None  # not shared
    for action in (SLOT["bow up"], SLOT["squat"], 0):
        ours, theirs = env.step(action), twin.step(action)
        for key, value in ours[0].items():
            assert np.array_equal(value, theirs[0][key]), key
        assert ours[1:4] == theirs[1:4]


def test_returned_arrays_are_fresh():
    env = make()
    observation, info = env.reset()
    kept = copy.deepcopy(observation)
    for array in (*observation.values(), info["action_mask"], info["transition_prior"]):
        if isinstance(array, np.ndarray):
            array[...] = 0
    again, _ = env.reset()
    for key, value in kept.items():
        np.testing.assert_array_equal(again[key], value)


def test_frames_can_be_taken_within_a_step():
    env = make(pictures={"frame_rate_hz": 25.0}).unwrapped
    env.reset()
    heads = []
    env.frame_callback = lambda: heads.append(env.simulation.data.body("head").xpos[2])
    *_, info = env.step(SLOT["bow down"])
    assert len(heads) == pytest.approx(25 * info["duration_s"], abs=2)
    assert heads[0] - heads[-1] > 0.1 and np.abs(np.diff(heads)).max() < 0.05

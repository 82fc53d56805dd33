"""The same again: in a new process, after other episodes, and in copies."""

import copy
import hashlib
import os
import pickle
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from standing_env import ID, SLOT, make, walk

from mplearn_envs.environment.random_streams import RandomStreams


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


def test_every_primitive_goes_on_bit_for_bit_whatever_was_done_in_between(renderer):
    """All primitives of the built-in library, kicks and marches too, while legs move."""
    options = {"actions": {"novel_penalty": 0.0}, "max_episode_steps": None}
    options |= {"render_mode": "rgb_array", "pictures": {"width": 32, "height": 24}}
    env = gymnasium.make(ID, **options).unwrapped
    _, info = env.reset(seed=1)
    order = np.random.default_rng(0).permutation(np.flatnonzero(info["action_mask"])).tolist()
    assert len(order) == 23

    def seen(result):
        observation, reward, *_, info = result
        return (
            {key: value.tobytes() for key, value in observation.items()},
            reward,
            info["primitive"],
        )

    undisturbed = [seen(env.step(action)) for action in order]
    env.reset(seed=1)  # it is used by now
    for k, action in enumerate(order):
        if k % 5 == 0:
            env = copy.deepcopy(env)
        elif k % 5 == 1:
            env = pickle.loads(pickle.dumps(env))
        elif k % 5 == 2:
            state = pickle.loads(pickle.dumps(env.state()))
            env = gymnasium.make(ID, **options).unwrapped
            env.reset(seed=7)
            env.load_state(state)
        elif k % 5 == 3:
            env.frame_callback = lambda: None
        else:
            env.frame_callback = env.render
        assert seen(env.step(action)) == undisturbed[k], (k, info["primitive"])


def test_what_acts_and_what_happens_are_drawn_apart():
    """A walk drawn from the environment's own seed knows nothing of the demonstrator."""
    streams = RandomStreams.of(5)
    first = [rng.random(64).tolist() for rng in (*streams, np.random.default_rng(5))]
    assert len({number for row in first for number in row}) == 4 * 64
    assert np.abs(np.corrcoef(first)[np.triu_indices(4, 1)]).max() < 0.5
    agreed = {}
    for apart in (0, 10_000):
        env = gymnasium.make(ID, task="follow", dynamics="kinematic")
        shares = []
        for seed in range(25):
            _, info = env.reset(seed=seed)
            env.action_space.seed(seed + apart)
            over = False
            while not over:
                action = env.action_space.sample(probability=info["transition_prior"])
                *_, terminated, truncated, info = env.step(action)
                over = terminated or truncated
            shares.append(info["task"]["agreement"])
        agreed[apart] = np.mean(shares)
    assert abs(agreed[0] - agreed[10_000]) < 0.06  # 0.2 with one stream for both

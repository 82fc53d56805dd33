"""The vector environment that steps in threads: bit-identical to single ones."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from standing_library import standing_library

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError
from mplearn_envs.environment.vector import PrimitiveHumanoidVectorEnv
from mplearn_envs.tasks import GoalTask

ID = "mplearn/PrimitiveHumanoid-v0"
OPTIONS = {"max_episode_steps": 4}


def make(n, **options):
    return gymnasium.make_vec(ID, num_envs=n, library=standing_library(), **(OPTIONS | options))


def walk(vector, n, steps):
    _, infos = vector.reset(seed=11)
    rng = np.random.default_rng(1)
    seen = []
    for _ in range(steps):
        actions = np.array([rng.choice(np.flatnonzero(m)) for m in infos["action_mask"]])
        observations, rewards, over, truncated, infos = vector.step(actions)
        arrays = {**observations, "rewards": rewards, "over": over, "truncated": truncated}
        seen.append({key: value.copy() for key, value in arrays.items()})
    return seen


@pytest.mark.parametrize("dynamics", ["simulated", "kinematic"])
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_threads_change_nothing(dynamics, mode):
    threads = make(3, dynamics=dynamics, n_threads=3, autoreset_mode=mode)
    assert isinstance(threads, PrimitiveHumanoidVectorEnv)
    single = gymnasium.make_vec(
        ID,
        num_envs=3,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        library=standing_library(),
        dynamics=dynamics,
        **OPTIONS,
    )
    steps = 7 if dynamics == "simulated" else 30
    for ours, theirs in zip(walk(threads, 3, steps), walk(single, 3, steps), strict=True):
        assert ours.keys() == theirs.keys()
        for key, value in ours.items():
            np.testing.assert_array_equal(value, theirs[key], err_msg=key)
    np.testing.assert_array_equal(threads.action_masks().sum(axis=1) > 0, True)
    threads.close()
    threads.close()


def test_each_has_its_own_task():
    vector = make(4, dynamics="kinematic", task=GoalTask())
    observations, _ = vector.reset(seed=0)
    assert len(np.unique(observations["task"], axis=0)) > 1
    first, second, *_ = (env.unwrapped for env in vector.envs)
    assert first.task is not second.task and first.repertoire is second.repertoire
    vector.close()


def test_there_are_as_many_threads_as_processors_that_may_be_used(monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {3, 5, 8}, raising=False)
    vectors = {n: make(2, dynamics="kinematic", n_threads=n) for n in (None, 1)}
    assert [vector.unwrapped.n_threads for vector in vectors.values()] == [3, 1]
    for vector in vectors.values():
        vector.close()


def test_an_error_in_a_thread_is_raised():
    vector = make(2, dynamics="kinematic", actions={"illegal": "raise"})
    vector.reset()
    with pytest.raises(InvalidValueError, match="illegal here"):
        vector.step(np.array([0, 31]))
    with pytest.raises(InvalidValueError, match="2 actions"):
        vector.step(np.array([0]))
    vector.close()


@pytest.mark.parametrize("options", [{"num_envs": 0}, {"n_threads": 0}, {"n_threads": 1.5}])
def test_bad_numbers_are_refused(options):
    with pytest.raises(InvalidValueError, match="from 1"):
        PrimitiveHumanoidVectorEnv(**options)


def test_the_spec_says_when_episodes_are_truncated():
    assert make(2).spec.max_episode_steps == 4
    assert gymnasium.make_vec(ID, num_envs=1).spec.max_episode_steps == 100
    assert gymnasium.make(ID, max_episode_steps=7).spec.max_episode_steps == 7

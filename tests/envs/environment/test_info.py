"""What info holds: the same keys, types and shapes after a reset and after every step."""

import warnings

import gymnasium
import numpy as np
import pytest
from standing_library import standing_library

from mplearn_envs.tasks import GoalTask

ID = "mplearn/PrimitiveHumanoid-v0"
TASKS = ["free", "follow", "recite", "goal", GoalTask("posture"), GoalTask("primitive")]


def make(task, **options):
    options = {"dynamics": "kinematic", "disable_env_checker": True} | options
    return gymnasium.make(ID, library=standing_library(), task=task, **options)


def shape(value):
    """Return keys, types and shapes: all that a buffer must know."""
    if isinstance(value, dict):
        return {key: shape(each) for key, each in value.items()}
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape
    return type(value)


CASES = [("simulated", "free"), *(("kinematic", task) for task in TASKS)]


@pytest.mark.parametrize(("dynamics", "task"), CASES, ids=str)
def test_info_has_one_shape(task, dynamics):
    env = make(task, dynamics=dynamics, actions={"novel_penalty": 0.1})
    _, info = env.reset(seed=0)
    first, rng = shape(info), np.random.default_rng(0)
    assert first["infeasible"] == ("|i1", (32,)) and first["reward_terms"]["fall"] is float
    assert info["discount"] == 1.0 and not any(info["reward_terms"].values())
    for _ in range(12 if dynamics == "kinematic" else 4):
        _, reward, terminated, truncated, info = env.step(rng.integers(20))  # illegal ones, too
        assert shape(info) == first
        assert sum(info["reward_terms"].values()) == pytest.approx(reward)
        if terminated or truncated:
            _, info = env.reset()
            assert shape(info) == first


def test_a_vector_of_them_has_arrays_of_all():
    vector = gymnasium.make_vec(
        ID, num_envs=3, library=standing_library(), task="goal", dynamics="kinematic"
    )
    _, infos = vector.reset(seed=1)
    for _ in range(5):
        assert infos["infeasible"].shape == infos["action_mask"].shape == (3, 32)
        assert infos["task"]["slots"].shape == (3, 32)
        assert infos["reward_terms"]["hurry"].shape == (3,)
        *_, infos = vector.step([int(mask.nonzero()[0][-1]) for mask in infos["action_mask"]])


def test_minari_keeps_infos(tmp_path, monkeypatch):
    """All of them but texts, which HDF5 files of Minari do not hold."""
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    from minari.data_collector import EpisodeBuffer

    def appended(kept, info):
        for key, value in info.items():
            if isinstance(value, dict):
                appended(kept.setdefault(key, {}), value)
            elif not isinstance(value, str):
                kept.setdefault(key, []).append(value)

    env, infos = make("goal"), {}
    observation, info = env.reset(seed=2)
    appended(infos, info)
    seen, actions, rewards, ends = [observation], [], [], []
    for _ in range(5):
        actions.append(int(info["transition_prior"].argmax()))
        observation, reward, terminated, truncated, info = env.step(actions[-1])
        appended(infos, info)
        seen.append(observation)
        rewards.append(float(reward))
        ends.append((terminated, truncated))
        if terminated or truncated:
            break
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    buffer = EpisodeBuffer(
        observations={key: [each[key] for each in seen] for key in seen[0]},
        actions=actions,
        rewards=rewards,
        terminations=[end[0] for end in ends],
        truncations=[end[1] for end in ends],
        infos=infos,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that there is no link to the code
        dataset = minari.create_dataset_from_buffers(
            dataset_id="mplearn/infos-v0", buffer=[buffer], env=env.spec,
            observation_space=env.observation_space, action_space=env.action_space,
        )  # fmt: skip
    (episode,) = dataset.iterate_episodes()
    for key in ("action_mask", "infeasible", "duration_s", "illegal"):
        np.testing.assert_array_equal(episode.infos[key], infos[key])
    np.testing.assert_array_equal(episode.infos["task"]["slots"], infos["task"]["slots"])

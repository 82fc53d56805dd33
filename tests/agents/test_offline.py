"""Episodes as a Minari data set: what comes back is what happened."""

import gymnasium
import numpy as np
import pytest
from standing_library import standing_library

from mplearn.errors import InvalidValueError
from mplearn_agents.cli import main
from mplearn_agents.policies import RandomWalk
from mplearn_agents.rl.offline import export_episodes
from mplearn_envs.environment.options import ActionOptions
from mplearn_envs.tasks import GoalTask

minari = pytest.importorskip("minari")
pytest.importorskip("h5py")


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return standing_library().save(tmp_path_factory.mktemp("offline") / "library.mplearn")


def make(library):
    return gymnasium.make(
        "mplearn/PrimitiveHumanoid-v0",
        library=library,
        task="goal",
        dynamics="kinematic",
        disable_env_checker=True,
    )


def test_what_comes_back_is_what_happened(library, tmp_path, monkeypatch):
    env = make(str(library))
    _, played = export_episodes(env, RandomWalk(), 3, "mplearn/goal-random-v0", tmp_path, seed=4)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    dataset = minari.load_dataset("mplearn/goal-random-v0")
    assert dataset.total_episodes == 3
    assert dataset.observation_space == env.observation_space
    assert dataset.action_space == env.action_space
    again = dataset.recover_environment()
    for episode, known in zip(dataset.iterate_episodes(), played, strict=True):
        weights = np.cumprod(np.concatenate(([1.0], episode.infos["discount"][1:-1])))
        assert episode.rewards @ weights == pytest.approx(known.return_, abs=1e-5)
        assert episode.infos["duration_s"].sum() == pytest.approx(known.duration_s)
        (known_as,) = dataset.storage.get_episode_metadata([episode.id])
        seen, _ = again.reset(seed=int(known_as["seed"]))
        for t in range(len(episode) + 1):
            for key, values in episode.observations.items():
                np.testing.assert_array_equal(values[t], seen[key])
                assert values.dtype == env.observation_space[key].dtype
            if t < len(episode):
                mask = episode.observations["action_mask"][t]
                assert mask[episode.actions[t]]
                seen, reward, terminated, truncated, _ = again.step(episode.actions[t])
                assert episode.rewards[t] == pytest.approx(float(reward))
                assert (episode.terminations[t], episode.truncations[t]) == (terminated, truncated)
    env.close()
    again.close()


def test_the_environment_is_recovered_without_the_file_that_it_came_from(tmp_path, monkeypatch):
    path = standing_library().save(tmp_path / "gone.mplearn")
    env = gymnasium.make(
        "mplearn/PrimitiveHumanoid-v0",
        library=path,
        task=GoalTask(deadline_s=20.0),
        dynamics="kinematic",
        actions=ActionOptions(capacity=48),
    )
    export_episodes(env, RandomWalk(), 1, "mplearn/x-v0", tmp_path)
    path.unlink()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    again = minari.load_dataset("mplearn/x-v0").recover_environment().unwrapped
    assert again.library.version == standing_library().version
    assert again.task == GoalTask(deadline_s=20.0) and again.actions.capacity == 48


def test_what_cannot_be_stored_is_said(library, tmp_path):
    env = make(standing_library)  # a function: it may return another one each time
    with pytest.raises(InvalidValueError, match="a library that is not live"):
        export_episodes(env, RandomWalk(), 1, "mplearn/x-v0", tmp_path)
    env.close()
    env = make(str(library))
    with pytest.raises(InvalidValueError, match="Minari refuses the data set 'not an id'"):
        export_episodes(env, RandomWalk(), 1, "not an id", tmp_path)
    env.close()


def test_the_command(library, tmp_path, capsys):
    command = ["episodes", "mplearn/x-v0", "--library", library, "--out", tmp_path,
               "--episodes", 2, "--dynamics", "kinematic"]  # fmt: skip
    assert main([str(each) for each in command]) == 0
    assert "2 episodes, 200 macro steps" in capsys.readouterr().out

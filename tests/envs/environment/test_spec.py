"""A spec makes the same environment again, through JSON, whatever it was made with."""

import json
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from hypothesis import given, settings
from hypothesis import strategies as st
from standing_env import ID, legal
from standing_library import MOTIONS, standing_library

from mplearn.errors import InvalidValueError
from mplearn.learner import LearnerConfig
from mplearn.recording import Recording
from mplearn_envs.environment.options import ActionOptions, MotionOptions, PictureOptions
from mplearn_envs.environment.plain import from_plain, to_plain
from mplearn_envs.robot import ROLES, humanoid
from mplearn_envs.skills.feasibility import FeasibilityConfig
from mplearn_envs.tasks import FollowTask, FreeTask, GoalTask, ReciteTask, Task

ONLINE = "mplearn/OnlinePrimitiveHumanoid-v0"


class Nothing(Task):
    """A task of one's own, without arguments."""

    def bonuses(self, choice):
        return {"nothing": 1.0}

    def rates(self, report):
        return {}


def again(env):
    return gymnasium.make(EnvSpec.from_json(json.dumps(json.loads(env.spec.to_json()))))


def walked(env, n=4):
    rng, seen = np.random.default_rng(1), []
    observation, info = env.reset(seed=5)
    for _ in range(n):
        seen.append({k: np.asarray(v).tobytes() for k, v in observation.items()})
        observation, reward, terminated, truncated, info = env.step(rng.choice(legal(info)))
        seen.append((reward, terminated, truncated))
        if terminated or truncated:
            break
    return seen


@pytest.mark.parametrize(
    "options",
    [
        {"task": "goal"},
        {"task": GoalTask("posture", {"base_pitch": 0.8}, deadline_s=20.0)},
        {"task": GoalTask(target=("left", (0.0, 0.3, 0.6)), tolerance_m=0.5)},
        {"task": FollowTask(pace=0.7)},
        {"task": ReciteTask(request=("bow down", "squat"))},
        {"task": FreeTask(memory=3), "discount": 0.9},
        {"task": Nothing()},
        {"robot": "humanoid"},
        {"robot": replace(humanoid(), stance_knee_rad=0.6)},
        {"motion": MotionOptions(0.4, "smooth", FeasibilityConfig(torque_share=0.8))},
        {"motion": {"feasibility": {"torque_share": 0.8}}},
        {"actions": ActionOptions(capacity=48, hold_s=0.7, novel_penalty=0.2)},
        {"actions": {"illegal": "raise"}, "pictures": PictureOptions(64, 48, True)},
        {"max_episode_steps": 2},
    ],
)
def test_a_spec_makes_the_same_again(options, tmp_path):
    path = standing_library().save(tmp_path / "standing.mplearn")
    for library in (path, standing_library()):
        env = gymnasium.make(ID, library=library, dynamics="kinematic", **options)
        twin = again(env)
        assert walked(env) == walked(twin)
        for name in ("robot", "motion", "actions", "pictures", "discount", "dynamics"):
            assert getattr(env.unwrapped, name) == getattr(twin.unwrapped, name)
        assert twin.spec.to_json() == env.spec.to_json()


def test_a_vector_environment_and_an_online_one_are_made_again():
    vector = gymnasium.make_vec(
        ID, num_envs=2, library=standing_library(), task=GoalTask(deadline_s=9.0)
    )
    twin = gymnasium.make_vec(EnvSpec.from_json(vector.spec.to_json()))
    assert twin.num_envs == 2 and twin.envs[0].unwrapped.task == GoalTask(deadline_s=9.0)
    film = Recording(frames=np.zeros((50, 33)), rate_hz=50.0, channels=humanoid().channels)
    config = LearnerConfig(film.channels, 50.0, longest_pause_s=1.5)
    online = again(gymnasium.make(ONLINE, demonstrator=film, learner=config, warm_up_s=1.0))
    assert online.unwrapped.learner_config == config and online.unwrapped.warm_up_s == 1.0
    assert np.array_equal(online.unwrapped.demonstrator.recording.frames, film.frames)


def test_relative_files_are_found_from_elsewhere(tmp_path, monkeypatch):
    standing_library().save(tmp_path / "mine.mplearn")
    (tmp_path / "body.xml").write_text(humanoid().xml, "utf-8")
    roles = "\n".join(f'{role} = "{role}"' for role in ROLES)
    (tmp_path / "body.toml").write_text(f'mjcf = "body.xml"\n[segments]\n{roles}\n', "utf-8")
    monkeypatch.chdir(tmp_path)
    files = {"library": "mine.mplearn", "robot": "body.toml"}
    text = gymnasium.make(ID, dynamics="kinematic", **files).spec.to_json()
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path / "other")
    twin = gymnasium.make(EnvSpec.from_json(text))
    assert len(twin.unwrapped.library) == len(MOTIONS)
    assert twin.unwrapped.robot.name == "body"


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inside: st.lists(inside).map(tuple) | st.dictionaries(st.text(), inside),
    max_leaves=8,
)


@settings(max_examples=60, deadline=None)
@given(value=plain)
def test_plain_values_stay_what_they_are(value):
    assert from_plain(json.loads(json.dumps(to_plain(value)))) == value


@pytest.mark.parametrize("kind", ["no_such_module:X", "mplearn_envs.tasks:Nobody", "numpy:array"])
def test_a_type_that_there_is_not_is_refused(kind):
    with pytest.raises(InvalidValueError, match="cannot be made"):
        from_plain({"type": kind, "arguments": {}})

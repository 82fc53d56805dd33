"""What gymnasium, Stable-Baselines3 and others ask of an environment, in both modes."""

import copy
import multiprocessing
import pickle
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.mujoco.utils import check_mujoco_reset_state
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.env_match import check_environments_match
from standing_library import MOTIONS, standing_library

import mplearn_envs  # noqa: F401  (registers the environment)

ID = "mplearn/PrimitiveHumanoid-v0"
SLOT = {motion[0]: slot for slot, motion in enumerate(MOTIONS, start=1)}
TASKS = ("free", "goal", "follow", "recite")
MODES = ("simulated", "kinematic")


def make(**options):
    return gymnasium.make(ID, library=standing_library(), **options)


def make_kinematic():
    return make(dynamics="kinematic")


@pytest.fixture(autouse=True)
def _strict():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # gymnasium takes every earlier version for outdated; v0 is another library
        warnings.filterwarnings("ignore", ".*PrimitiveHumanoid-v0 is out of date")
        yield


@pytest.mark.parametrize("dynamics", MODES)
@pytest.mark.parametrize("task", TASKS)
def test_gymnasiums_checks_pass(task, dynamics):
    env = make(task=task, dynamics=dynamics)
    check_env(env.unwrapped, skip_render_check=True)
    checked = gymnasium.wrappers.PassiveEnvChecker(env.unwrapped)
    _, info = checked.reset(seed=0)
    for _ in range(5):
        action = checked.action_space.sample(probability=info["transition_prior"])
        *_, over, truncated, info = checked.step(action)
        if over or truncated:
            _, info = checked.reset()


@pytest.mark.parametrize("dynamics", MODES)
def test_environments_match_and_reset_restores_the_state(dynamics):
    options = {"dynamics": dynamics, "task": "follow"}
    check_environments_match(make(**options), make(**options), 12, seed=3)
    check_environments_match(make(**options), make(flat=True, **options), 6, skip_obs=True)
    check_mujoco_reset_state(make(dynamics=dynamics))


def test_the_name_of_the_package_may_come_first():
    env = gymnasium.make(f"mplearn_envs:{ID}", dynamics="kinematic")
    assert env.spec is not None and env.reset()[1]["action_mask"].any()
    again = gymnasium.make(env.spec)
    assert again.unwrapped.dynamics == "kinematic"


def test_closing_twice_is_allowed():
    env = make()
    env.reset()
    env.close()
    env.close()


@pytest.mark.parametrize("dynamics", MODES)
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_go_on_bit_for_bit(copied, task, dynamics):
    env = make(task=task, dynamics=dynamics)
    env.reset(seed=1)
    env.step(SLOT["bow down"])
    twin = copied(env)
    for action in (SLOT["bow up"], 0, SLOT["squat"]):
        ours, theirs = env.step(action), twin.step(action)
        for key, value in ours[0].items():
            np.testing.assert_array_equal(value, theirs[0][key])
        assert ours[1:4] == theirs[1:4] and ours[4]["reward_terms"] == theirs[4]["reward_terms"]
        if ours[2]:
            break


# ---- vectors


def walked(vector, steps=6):
    """Return rewards and observations of a fixed walk."""
    _, infos = vector.reset(seed=5)
    seen = []
    for _ in range(steps):
        actions = np.array([np.flatnonzero(mask)[-1] for mask in infos["action_mask"]])
        observations, rewards, *_, infos = vector.step(actions)
        seen.append((rewards.tobytes(), observations["posture"].tobytes()))
    vector.close()
    return seen


def test_gymnasiums_vector_environments_agree_in_processes_too():
    alone = walked(gymnasium.vector.SyncVectorEnv([make_kinematic]))
    spawned = gymnasium.vector.AsyncVectorEnv([make_kinematic], context="spawn")
    assert alone == walked(spawned)
    assert multiprocessing.active_children() == []


# ---- Stable-Baselines3


def test_stable_baselines_checks_pass():
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    for task in TASKS:
        checker.check_env(make(task=task, dynamics="kinematic").unwrapped)
        checker.check_env(make(task=task, dynamics="kinematic", flat=True).unwrapped)


def test_stable_baselines_vector_environments_work():
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

    seen = []
    for kind, options in ((DummyVecEnv, {}), (SubprocVecEnv, {"start_method": "spawn"})):
        vector = kind([make_kinematic], **options)
        vector.seed(3)
        observations = vector.reset()
        rewards = []
        for _ in range(4):
            masks = np.stack(vector.env_method("action_masks"))
            np.testing.assert_array_equal(masks, observations["action_mask"] == 1)
            actions = np.array([np.flatnonzero(mask)[-1] for mask in masks])
            observations, reward, _, _ = vector.step(actions)
            rewards.append(np.float32(reward).tobytes())
        vector.close()
        seen.append(rewards)
    assert seen[0] == seen[1]


def test_a_trained_policy_does_nothing_illegal():
    """10,000 steps of a policy of sb3-contrib, whose masks are those of the environment."""
    contrib = pytest.importorskip("sb3_contrib")
    from sb3_contrib.common.maskable.utils import get_action_masks, is_masking_supported
    from stable_baselines3.common.vec_env import DummyVecEnv

    def make_flat():
        return make(dynamics="kinematic", flat=True, task="goal", max_episode_steps=20)

    vector = DummyVecEnv([make_flat] * 40)
    assert is_masking_supported(vector)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        policy = {"net_arch": [32]}
        agent = contrib.MaskablePPO(
            "MlpPolicy", vector, n_steps=16, batch_size=320, n_epochs=2, seed=0,
            policy_kwargs=policy, device="cpu",
        )  # fmt: skip
        agent.learn(640)
    observations = vector.reset()
    illegal, performed = 0, set()
    for _ in range(250):
        actions, _ = agent.predict(observations, action_masks=get_action_masks(vector))
        observations, _, _, infos = vector.step(actions)
        illegal += sum(info["illegal"] for info in infos)
        performed.update(actions.tolist())
    assert illegal == 0 and len(performed) > 5


# ---- RLlib


def test_rllibs_checks_pass():
    """RLlib pins gymnasium 1.2: where it is installed, its checks and one worker are run."""
    pytest.importorskip("ray.rllib")
    from gymnasium.wrappers import OrderEnforcing
    from ray.rllib.utils.pre_checks.env import _check_done_and_truncated, _check_reward

    env = OrderEnforcing(make(dynamics="kinematic").unwrapped)
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    _, reward, terminated, truncated, _ = env.step(0)
    _check_reward(reward)
    _check_done_and_truncated(terminated, truncated)

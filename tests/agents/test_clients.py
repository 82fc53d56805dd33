"""Other people's reinforcement learning: they make it, step it and keep to its masks.

Stable-Baselines3 and sb3-contrib are in `test_compliance`, RLlib in `test_rllib`, Minari in
`test_offline`. These here are the extra `clients`, and d3rlpy, which pins another gymnasium: each
test is skipped where its client is not installed.
"""

import importlib
import importlib.util
import warnings

import gymnasium
import numpy as np
import pytest

import mplearn_envs  # noqa: F401  (registers the environment)


def make(version="v1", **options):
    given = {"dynamics": "kinematic", "task": "goal"} | options
    return gymnasium.make(f"mplearn/PrimitiveHumanoid-{version}", **given)


def client(name):
    """Return a client's module, whatever warnings its import gives; skip where it is not there."""
    if importlib.util.find_spec(name.partition(".")[0]) is None:
        pytest.skip(f"{name.partition('.')[0]} is not installed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importlib.import_module(name)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("version", ["v0", "v1"])
def test_skrl_knows_the_spaces_and_the_masks(version):
    torch = pytest.importorskip("torch")
    wrapped = client("skrl.envs.wrappers.torch").wrap_env(make(version), verbose=False)
    observation, info = wrapped.reset()
    spaces = client("skrl.utils.spaces.torch")
    for _ in range(3):
        seen = spaces.unflatten_tensorized_space(wrapped.observation_space, observation)
        mask = seen["action_mask"].numpy().ravel()
        np.testing.assert_array_equal(mask, info["action_mask"])
        action = int(np.flatnonzero(mask)[-1])
        observation, reward, over, _, info = wrapped.step(torch.tensor([[action]]))
        assert not info["illegal"] and np.isfinite(reward.item()) and not over.item()


@pytest.mark.filterwarnings("ignore")
def test_torchrls_checks_pass_and_a_rollout_keeps_to_the_masks():
    envs, utils = client("torchrl.envs"), client("torchrl.envs.utils")
    env = envs.GymWrapper(make(), categorical_action_encoding=True)
    utils.check_env_specs(env)
    masked = envs.TransformedEnv(env, envs.transforms.ActionMask())
    masked.set_seed(0)
    rollout = masked.rollout(6)
    legal = rollout["action_mask"].gather(1, rollout["action"].reshape(-1, 1))
    assert bool((legal > 0).all())


@pytest.mark.filterwarnings("ignore")
def test_tianshou_collects_with_its_masks():
    tianshou = client("tianshou.env")
    vector = tianshou.DummyVectorEnv([make, make])
    observations, infos = vector.reset(seed=1)
    for _ in range(3):
        masks = np.stack([info["action_mask"] for info in infos])
        assert all(
            np.array_equal(m, o["action_mask"]) for m, o in zip(masks, observations, strict=True)
        )
        actions = np.array([np.flatnonzero(mask)[-1] for mask in masks])
        observations, rewards, _, _, infos = vector.step(actions)
        assert np.isfinite(rewards).all() and not any(info["illegal"] for info in infos)
    vector.close()


@pytest.mark.filterwarnings("ignore")
def test_d3rlpy_learns_from_a_minari_data_set(tmp_path):
    client("h5py")
    client("minari")
    d3rlpy = client("d3rlpy")
    from mplearn_agents.policies import RandomWalk
    from mplearn_agents.rl.offline import export_episodes

    env = make("v0", max_episode_steps=8)
    written, _ = export_episodes(env, RandomWalk(), 2, "mplearn/clients-v0", tmp_path)
    observations, actions, rewards, ends = [], [], [], []
    for episode in written.iterate_episodes():
        flat = [
            gymnasium.spaces.flatten(
                env.observation_space, {k: v[t] for k, v in episode.observations.items()}
            )
            for t in range(len(episode.actions))
        ]
        observations += flat
        actions += episode.actions.tolist()
        rewards += episode.rewards.tolist()
        ends += [False] * (len(flat) - 1) + [True]
    data = d3rlpy.dataset.MDPDataset(
        np.array(observations, np.float32),
        np.array(actions)[:, None],
        np.array(rewards),
        np.array(ends),
    )
    learner = d3rlpy.algos.DiscreteBCConfig(batch_size=4).create(device="cpu:0")
    learner.fit(
        data,
        n_steps=2,
        n_steps_per_epoch=2,
        show_progress=False,
        logger_adapter=d3rlpy.logging.NoopAdapterFactory(),
    )
    assert 0 <= int(learner.predict(np.array(observations[:1], np.float32))[0]) < 32

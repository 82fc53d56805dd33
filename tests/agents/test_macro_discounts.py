"""Macro steps in PPO and DQN against brute force and against the peers' own constant gamma."""

import numpy as np
import pytest
from graph_world import DISCOUNT, GraphWorld, two_ways
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn_agents.rl.config import TrainingConfig
from mplearn_agents.rl.returns import advantages

pytest.importorskip("sb3_contrib")
torch = pytest.importorskip("torch")
torch.set_num_threads(1)


def brute_force(rewards, values, ends, discounts, traces):
    """Sum all deltas of the rest of the episode, each with its own product of discounts."""
    steps, n = rewards.shape
    out = np.zeros((steps, n))
    for i in range(n):
        for t in range(steps):
            weight = 1.0
            for k in range(t, steps):
                after = 0.0 if ends[k, i] else discounts[k, i] * values[k + 1, i]
                out[t, i] += weight * (rewards[k, i] + after - values[k, i])
                if ends[k, i]:
                    break
                weight *= discounts[k, i] * traces[k, i]
    return out


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), gae_lambda=st.sampled_from([0.0, 0.5, 0.95, 1.0]))
def test_advantages_are_those_of_brute_force(seed, gae_lambda):
    rng = np.random.default_rng(seed)
    shape = (12, 3)
    rewards, values = rng.normal(size=shape), rng.normal(size=(13, 3))
    discounts, ends = rng.uniform(0.2, 1.0, shape), rng.random(shape) < 0.2
    traces = gae_lambda ** rng.uniform(0.1, 4.0, shape)
    single = (x.astype(np.float32) for x in (discounts, traces))
    found = advantages(*(x.astype(np.float32) for x in (rewards, values)), ends, *single)
    expected = brute_force(rewards, values, ends, discounts, traces)
    np.testing.assert_allclose(found, expected, atol=2e-5)


def collected(world, n_steps=64):
    """Return the buffer of one rollout, before its network learned anything."""
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import DummyVecEnv

    from mplearn_agents.rl.algorithms import new_model

    class Stop(BaseCallback):
        def _on_step(self):
            return True

    envs = DummyVecEnv([world] * 2)
    model = new_model(TrainingConfig(), envs, {})
    model.rollout_buffer.buffer_size = model.n_steps = n_steps
    _, callback = model._setup_learn(10_000, Stop())
    model.collect_rollouts(envs, callback, model.rollout_buffer, n_steps)
    return model


def test_a_rollout_keeps_durations_and_what_truncation_cut_off():
    ring = {0: [1, 2], 1: [2, 3], 2: [3], 3: [1, 2]}
    model = collected(lambda: GraphWorld(ring, [0.5, 1.0, 2.0, 3.0], [0, 1, 2, 3], max_steps=7))
    buffer = model.rollout_buffer
    assert not buffer.generator_ready
    taken = buffer.actions[:, :, 0].astype(int)
    durations_s = np.array([0.5, 1.0, 2.0, 3.0])[taken]
    expected = DISCOUNT**durations_s
    np.testing.assert_allclose(buffer.durations_s, durations_s, rtol=1e-6)
    np.testing.assert_allclose(buffer.discounts, expected, rtol=1e-6)
    assert set(np.flatnonzero(buffer.cut_off.any(axis=1))) == set(range(6, 64, 7))
    starts = buffer.episode_starts > 0
    ends = np.vstack((starts[1:], [False, False]))
    last = {key: torch.as_tensor(np.array(value)) for key, value in model._last_obs.items()}
    with torch.no_grad():
        after = model.policy.predict_values(last).numpy().reshape(1, -1)
    rewards = buffer.rewards + expected * buffer.cut_off
    found = brute_force(
        rewards, np.vstack((buffer.values, after)), ends, expected, 0.97**durations_s
    )
    np.testing.assert_allclose(buffer.advantages, found, atol=1e-4)


def test_with_a_constant_discount_it_is_stable_baselines_own():
    from sb3_contrib.common.maskable.buffers import MaskableDictRolloutBuffer

    world = two_ways()
    model = collected(lambda: GraphWorld(world.edges, [0.5] * 6, world.reward, ends=(5,)))
    buffer = model.rollout_buffer
    peer = MaskableDictRolloutBuffer(
        64, world.observation_space, world.action_space, "cpu", 0.97**0.5, DISCOUNT**0.5, 2
    )
    for name in ("rewards", "values", "episode_starts"):
        getattr(peer, name)[:] = getattr(buffer, name)
    for each in (buffer, peer):
        each.compute_returns_and_advantage(torch.tensor([0.3, -0.2]), np.array([False, True]))
    np.testing.assert_allclose(buffer.advantages, peer.advantages, atol=1e-5)
    np.testing.assert_allclose(buffer.returns, peer.returns, atol=1e-5)


@pytest.mark.parametrize("algorithm", ["maskable-ppo", "ppo"])
def test_agents_learn_the_way_that_is_quick_not_the_one_of_few_steps(algorithm):
    from stable_baselines3.common.utils import set_random_seed
    from stable_baselines3.common.vec_env import DummyVecEnv

    from mplearn_agents.rl import ProjectIllegal, TrainedPolicy
    from mplearn_agents.rl.algorithms import RECIPES, new_model

    torch.set_num_threads(1)
    set_random_seed(0)
    make = two_ways if algorithm == "maskable-ppo" else lambda: ProjectIllegal(two_ways())
    config = TrainingConfig(algorithm=algorithm)
    envs = DummyVecEnv([make] * RECIPES[algorithm].n_envs)
    model = new_model(config, envs, {})
    model.learn(3072)
    agent, env = TrainedPolicy(model, config, {}), two_ways()
    observation, info = env.reset()
    walked = []
    while env.at != 5 and len(walked) < 10:
        walked.append(agent.act(observation, info))
        observation, _, _, _, info = env.step(walked[-1])
    assert walked == [2, 3, 4, 5]


def test_replayed_steps_keep_their_own_discounts():
    """The discount is told by the reward, also where old steps were overwritten."""
    from mplearn_agents.rl.semi_markov import MacroReplayBuffer

    space = spaces.Dict({"at": spaces.Box(0.0, 1.0, (1,))})
    memory = MacroReplayBuffer(8, space, spaces.Discrete(2))
    seen, action, over = {"at": np.zeros((1, 1))}, np.zeros((1, 1)), np.zeros(1)
    for k in range(12):
        memory.add(seen, seen, action, np.array([k / 20]), over, [{"discount": 1.0 - k / 20}])
    drawn = memory.sample(64)
    np.testing.assert_allclose(drawn.discounts, 1.0 - drawn.rewards, atol=1e-6)
    assert set(np.round(20 * drawn.rewards.numpy().ravel())) == set(range(4, 12))
    with pytest.raises(InvalidValueError, match="1 environment, not 2"):
        MacroReplayBuffer(8, space, spaces.Discrete(2), n_envs=2)


def test_steps_without_a_discount_are_refused():
    from mplearn_agents.rl.semi_markov import of_steps

    with pytest.raises(InvalidValueError, match=r"info\['discount'\].*\['action_mask'\]"):
        of_steps([{"action_mask": 1}], "discount")

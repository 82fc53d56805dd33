"""RLlib's PPO with masks and macro steps; in an environment of its own, for it pins Gymnasium."""

import copy

import numpy as np
import pytest
from standing_library import standing_library

ray = pytest.importorskip("ray", reason="the extra cluster is not installed")
torch = pytest.importorskip("torch")


@pytest.fixture(scope="module")
def options(tmp_path_factory):
    library = standing_library().save(tmp_path_factory.mktemp("rllib") / "library.mplearn")
    return {"task": "goal", "library": str(library), "dynamics": "kinematic"}


@pytest.fixture(scope="module")
def trained(options):
    from mplearn_agents.rl.rllib import algorithm

    ray.init(include_dashboard=False, log_to_driver=False)
    out = algorithm(options, workers=0)
    out.train()
    yield out
    out.stop()
    ray.shutdown()


@pytest.mark.filterwarnings("default")
def test_no_agent_takes_an_illegal_action(trained, options):
    from mplearn_agents.episodes import play
    from mplearn_agents.rl.rllib import ClusterPolicy, make_environment

    env = make_environment(options)
    episodes = play(env, ClusterPolicy(trained.get_module(), env), 20, seed=3)
    assert sum(episode.illegal for episode in episodes) == 0
    env.close()


@pytest.mark.filterwarnings("default")
def test_advantages_count_each_steps_own_duration(trained, options):
    from ray.rllib.env.single_agent_episode import SingleAgentEpisode
    from ray.rllib.evaluation.postprocessing import Postprocessing
    from ray.rllib.utils.postprocessing.episodes import add_one_ts_to_episodes_and_truncate

    from mplearn_agents.rl.returns import advantages
    from mplearn_agents.rl.rllib import FlatObservation, MacroStepAdvantages, make_environment

    env, rng = FlatObservation(make_environment(options)), np.random.default_rng(0)
    episodes, columns = [], []
    for k in range(3):
        seen, info = env.reset(seed=k)
        episode = SingleAgentEpisode(observations=[seen], infos=[info])
        ended = False
        while not ended and len(episode) < 5:
            action = int(rng.choice(np.flatnonzero(seen[-env.action_space.n :])))
            seen, reward, ended, _, info = env.step(action)
            episode.add_env_step(seen, action, reward, info, terminated=ended)
        columns.append(np.array(episode.observations[: len(episode) + 1]))
        episodes.append(episode)
    module = trained.get_module()
    batch = {"default_policy": {"obs": torch.as_tensor(np.concatenate(columns))}}
    with torch.no_grad():
        values = module.compute_values(batch["default_policy"]).numpy()
    longer = copy.deepcopy(episodes)
    add_one_ts_to_episodes_and_truncate(longer)  # as RLlib's learner does
    connector = MacroStepAdvantages()
    out = connector(rl_module={"default_policy": module}, batch=batch, episodes=longer)
    out = out["default_policy"]
    start, expected = 0, []
    for episode in episodes:
        n = len(episode)
        ends = np.zeros((n, 1), bool)
        ends[-1] = episode.is_terminated
        infos = episode.get_infos()[1:]
        discounts = np.array([[info["discount"]] for info in infos], np.float32)
        traces = np.array([[0.97 ** info["duration_s"]] for info in infos], np.float32)
        rewards = np.array(episode.get_rewards(), np.float32)[:, None]
        found = advantages(rewards, values[start : start + n + 1, None], ends, discounts, traces)
        expected += [*found[:, 0], 0.0]
        start += n + 1
    np.testing.assert_allclose(
        out[Postprocessing.VALUE_TARGETS].numpy(), np.array(expected) + values, atol=1e-5
    )
    env.close()

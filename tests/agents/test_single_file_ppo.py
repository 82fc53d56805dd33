"""The baseline in one file: its advantages, its masks, and that it learns."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from mplearn_agents.baselines import ppo  # noqa: E402
from mplearn_agents.rl import returns  # noqa: E402


def test_its_advantages_are_those_of_the_full_training():
    rng = np.random.default_rng(0)
    shape = (9, 3)
    rewards, values = rng.normal(size=shape), rng.normal(size=(10, 3))
    discounts, durations_s = rng.uniform(0.3, 1.0, shape), rng.uniform(0.2, 4.0, shape)
    ends = rng.random(shape) < 0.3
    found = ppo.advantages(rewards, values, ends, discounts, durations_s, 0.9)
    expected = returns.advantages(rewards, values, ends, discounts, 0.9**durations_s)
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_masked_actions_are_never_drawn_and_the_prior_is_the_untrained_policy():
    agent = ppo.Agent(5, 6)
    with torch.no_grad():
        for layer in agent.actor:
            if hasattr(layer, "weight"):
                layer.weight.zero_()
    mask = torch.tensor([[1.0, 0, 1, 1, 0, 1]])
    prior = torch.tensor([[0.0, 0, 0.7, 0.2, 0, 0.1]])
    policy = agent.policy(torch.randn(1, 5), prior, mask)
    wanted = np.maximum(prior.numpy(), ppo.LEAST_PRIOR) * mask.numpy()
    np.testing.assert_allclose(policy.probs.detach().numpy(), wanted / wanted.sum(), atol=1e-5)


@pytest.mark.parametrize("env", ["v0", "v1"])
def test_it_trains_on_both_versions(env, capsys):
    small = ["--steps", "96", "--envs", "2", "--rollout", "24", "--epochs", "1", "--batches", "2"]
    assert ppo.main(["--env", env, *small]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 and all("0 illegal actions" in line for line in lines)

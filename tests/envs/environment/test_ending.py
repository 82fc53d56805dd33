"""Ending instead of discounting: the same expected return, for learners that do not discount."""

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from standing_env import ID
from standing_library import standing_library

from mplearn_envs.environment.ending import EndInsteadOfDiscount


def make():
    return gymnasium.make(
        ID,
        library=standing_library(),
        dynamics="kinematic",
        discount=0.6,
        actions={"hold_s": 1.5},
        max_episode_steps=1000,
        disable_env_checker=True,
    )


def test_sums_until_the_end_are_discounted_returns_in_expectation():
    """Of the policy that draws by the prior, with steps of very unequal lengths."""
    plain, ending = make(), EndInsteadOfDiscount(make())

    def walked(env, rng, discounted):
        total, weight, over = 0.0, 1.0, False
        _, info = env.reset()
        while not over and weight > 1e-5:
            action = rng.choice(len(info["transition_prior"]), p=info["transition_prior"])
            _, reward, terminated, truncated, info = env.step(action)
            total += weight * float(reward)
            weight *= info["discount"] if discounted else 1.0
            over = terminated or truncated
        return total

    plain.reset(seed=1)
    ending.reset(seed=1)
    right = [walked(plain, np.random.default_rng(k), True) for k in range(100)]
    sums = [walked(ending, np.random.default_rng(k), False) for k in range(1500)]
    error = np.hypot(np.std(sums) / len(sums) ** 0.5, np.std(right) / len(right) ** 0.5)
    assert abs(np.mean(sums) - np.mean(right)) < 4 * error < 0.2


def test_ends_are_drawn_from_the_seed_and_survive_a_spec():
    ends = []
    for env in (EndInsteadOfDiscount(make()), EndInsteadOfDiscount(make())):
        env.reset(seed=3)
        n, over = 0, False
        while not over:
            *_, over, _, info = env.step(0)
            n += 1
        ends.append(n)
        assert info["ended"]
    assert ends[0] == ends[1]
    again = gymnasium.make(EnvSpec.from_json(EndInsteadOfDiscount(make()).spec.to_json()))
    assert isinstance(again, EndInsteadOfDiscount)
    with pytest.raises(gymnasium.error.ResetNeeded):
        EndInsteadOfDiscount(make()).step(0)

"""Who discounts by steps is told so, once; who does it right is not."""

import warnings

import gymnasium
import pytest
from standing_env import make

from mplearn_agents.rl.config import TrainingConfig
from mplearn_envs.environment.ending import EndInsteadOfDiscount
from mplearn_envs.environment.step_discount import StepDiscountWarning

WHAT = r"discounts by 0.99 a step.*info\['discount'\], 0.95\^duration.*EndInsteadOfDiscount"


def environment(**options):
    return make(dynamics="kinematic", task="goal", **options)


class Learner:
    """A learner as many have it."""

    def __init__(self, gamma=0.99):
        self.gamma = gamma

    def learn(self, env, steps=3):
        env.reset(seed=0)
        for _ in range(steps):
            env.step(0)


def test_a_learner_with_a_discount_a_step_is_warned_once():
    env, learner = environment(), Learner()
    with pytest.warns(StepDiscountWarning, match="Learner " + WHAT) as seen:
        learner.learn(env)
    assert len(seen) == 1
    learner.learn(env)  # no second time: warnings are errors here


@pytest.mark.parametrize(
    ("wrap", "gamma", "discount"),
    [(EndInsteadOfDiscount, 0.99, 0.95), (lambda env: env, 1.0, 0.95), (lambda env: env, 0.9, 1.0)],
)
def test_who_does_it_right_is_not(wrap, gamma, discount):
    Learner(gamma).learn(wrap(environment(discount=discount)))


def test_a_wrapper_that_normalises_by_a_discount_is_no_learner():
    env = gymnasium.wrappers.NormalizeReward(environment(), gamma=0.99)
    env.reset(seed=0)
    env.step(0)


def test_scripts_with_their_settings_in_args_are_seen():
    class Settings:
        gamma = 0.99

    def script(args):
        env = environment()
        env.reset(seed=0)
        env.step(0)

    with pytest.warns(StepDiscountWarning, match="Settings " + WHAT):
        script(Settings())


def test_stable_baselines_is_warned_and_our_own_algorithms_are_not():
    pytest.importorskip("sb3_contrib")
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import DummyVecEnv

    from mplearn_agents.rl.algorithms import new_model

    plain = PPO("MultiInputPolicy", environment(), n_steps=8, batch_size=8, device="cpu")
    with pytest.warns(StepDiscountWarning, match="PPO " + WHAT):
        plain.learn(8)
    with warnings.catch_warnings():
        warnings.simplefilter("error", StepDiscountWarning)
        ours = new_model(TrainingConfig(n_envs=2), DummyVecEnv([environment] * 2), {})
        ours.n_steps = ours.rollout_buffer.buffer_size = 8
        ours.learn(8)

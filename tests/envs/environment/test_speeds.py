"""The agent chooses the speed with the primitive."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from standing_env import SLOT, make

from mplearn.errors import InvalidValueError
from mplearn_envs.checks import check_action_mask

SPEEDS = (1.0, 0.5, 1.6)


def chosen(**options):
    return make(actions={"speeds": SPEEDS}, **({"dynamics": "kinematic"} | options))


def test_each_speed_has_a_block_of_actions_and_the_first_the_prior():
    env, usual = chosen(), make(dynamics="kinematic")
    n = usual.action_space.n
    assert env.action_space == gymnasium.spaces.Discrete(3 * n)
    _, info = env.reset(seed=0)
    _, plain = usual.reset(seed=0)
    np.testing.assert_array_equal(info["action_mask"], np.tile(plain["action_mask"], 3))
    np.testing.assert_array_equal(info["transition_prior"][:n], plain["transition_prior"])
    assert not info["transition_prior"][n:].any()
    check_env(env.unwrapped, skip_render_check=True)
    check_action_mask(chosen(), steps=10)


@pytest.mark.parametrize("dynamics", ["kinematic", "simulated"])
def test_a_motion_takes_as_long_as_its_speed_says(dynamics):
    """Up to a knot, where no limit asks for less; and the usual block is as without speeds."""
    env, usual = chosen(dynamics=dynamics), make(dynamics=dynamics)
    n, lasted = usual.action_space.n, []
    for block in range(3):
        env.reset(seed=1)
        *_, over, _, info = env.step(block * n + SLOT["squat"])
        assert not over and info["primitive_name"] == "squat"
        lasted.append((info["duration_s"], info["speed"]))
    usual.reset(seed=1)
    *_, info = usual.step(SLOT["squat"])
    assert lasted[0] == (info["duration_s"], info["speed"])
    for (duration_s, speed), factor in zip(lasted, SPEEDS, strict=True):
        assert speed <= 0.5 * factor + 1e-9
        assert duration_s * speed == pytest.approx(lasted[0][0] * lasted[0][1], rel=0.05)
    assert lasted[1][0] > 1.8 * lasted[0][0] and lasted[2][0] < lasted[0][0]


def test_speeds_that_cannot_be_are_refused():
    for wrong in ((), (1.0, 1.0), (0.0,), (1.0, 99.0)):
        with pytest.raises(InvalidValueError, match="speeds"):
            make(actions={"speeds": wrong})
    env = chosen()
    env.reset()
    with pytest.raises(InvalidValueError, match="an action is an integer in"):
        env.unwrapped.step(3 * env.unwrapped.capacity)

"""Walks: on a made-up environment whose truth is known, and on the humanoid."""

import gymnasium
import numpy as np
import pytest

from mplearn.errors import InvalidValueError, RobotError, UnknownPrimitiveError
from mplearn_agents.policies import (
    POLICIES,
    Greedy,
    PathToGoal,
    Policy,
    RandomWalk,
)
from mplearn_agents.suited import NEEDS_TASK
from mplearn_agents.walk import walk
from mplearn_envs.skills.feasibility import FeasibilityConfig


class Ring(gymnasium.Env):
    """Slots 1 to 4 in a ring; it falls each time it comes to 3, and holds where that is illegal."""

    action_space = gymnasium.spaces.Discrete(5)
    observation_space = gymnasium.spaces.Discrete(5)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.at = 4
        return 4, self._info()

    def step(self, action):
        info = {
            "illegal": False, "duration_s": 0.5, "tracking_rmse_rad": 0.01,
            "cog_deviation_m": 0.002, "zmp_margin_m": 0.05, "fallen": False,
        }  # fmt: skip
        if action == 0 or not self._info()["action_mask"][action]:
            return self.at, 0.0, False, False, self._info() | info | {"illegal": action != 0}
        self.at = action
        info |= {"duration_s": 2.0, "fallen": action == 3}
        return action, 1.0, action == 3, False, self._info() | info

    def _info(self):
        mask, prior = np.zeros(5, np.int8), np.zeros(5)
        mask[[0, self.at % 4 + 1]] = 1
        prior[self.at % 4 + 1] = 1.0
        name = f"slot {self.at}"
        return {
            "action_mask": mask, "transition_prior": prior, "primitive": 100 + self.at,
            "primitive_name": name,
        }  # fmt: skip


class EveryOther(Policy):
    """Holds, then walks on."""

    def __init__(self):
        self.holds = False

    def act(self, observation, info):
        self.holds = not self.holds
        return 0 if self.holds else int(np.argmax(info["transition_prior"]))


def test_a_walk_tells_what_happened():
    result = walk(Ring(), Greedy(), 7)
    assert result.primitives == (101, 102, 103, 101, 102, 103, 101)
    assert result.falls == 2
    assert [step.name for step in result.steps[:3]] == ["slot 1", "slot 2", "slot 3"]
    assert result.duration_s == 14.0
    assert sum(step.reward for step in result.steps) == 7.0


def test_holding_does_not_count():
    result = walk(Ring(), EveryOther(), 4)
    assert len(result.primitives) == 4
    assert [step.name for step in result.steps] == [
        "hold", "slot 1", "hold", "slot 2", "hold", "slot 3", "hold", "slot 1",
    ]  # fmt: skip
    assert result.duration_s == pytest.approx(4 * 0.5 + 4 * 2.0)


def test_a_policy_that_only_holds_is_stopped():
    class Hold(Policy):
        def act(self, observation, info):
            return 0

    result = walk(Ring(), Hold(), 3)
    assert len(result.steps) == 30
    assert result.primitives == ()


def test_an_illegal_action_is_no_primitive():
    class Wrong(Policy):
        def act(self, observation, info):
            return 2

    result = walk(Ring(), Wrong(), 1)
    assert result.primitives == ()
    assert all(step.illegal and step.name == "hold" for step in result.steps)


def test_a_walk_has_a_step():
    with pytest.raises(InvalidValueError, match="at least 1 step, not 0"):
        walk(Ring(), Greedy(), 0)


@pytest.fixture(scope="module")
def humanoid(library):
    env = gymnasium.make("mplearn/PrimitiveHumanoid-v0", library=library, disable_env_checker=True)
    yield env
    env.close()


def test_the_humanoid_walks_and_is_recorded(humanoid, library):
    result = walk(humanoid, RandomWalk(), 4, seed=8, record=True)
    assert result.falls == 0
    assert len(result.primitives) == 4
    for before, after in zip(result.primitives, result.primitives[1:], strict=False):
        follows = library.graph.prior(before)[list(library.graph.ids).index(after)] > 0
        assert follows or any(step.name == "hold" for step in result.steps)
    assert result.postures.shape == (len(result.step_of), 37)
    assert len(result.postures) == pytest.approx(result.duration_s * result.rate_hz, abs=4)
    assert (np.diff(result.step_of) >= 0).all()
    again = walk(humanoid, RandomWalk(), 4, seed=8, record=True)
    assert again.steps == result.steps
    np.testing.assert_array_equal(again.postures, result.postures)


def test_the_humanoid_goes_to_a_goal(humanoid, library):
    policy = PathToGoal.for_env(humanoid, "SQR")
    result = walk(humanoid, policy, 4, seed=0)
    assert library["SQR"].id in result.primitives


def test_goals_that_cannot_be_are_said(humanoid, library):
    with pytest.raises(UnknownPrimitiveError, match="no primitive 'jump'"):
        PathToGoal.for_env(humanoid, "jump")
    weak = gymnasium.make(
        "mplearn/PrimitiveHumanoid-v0",
        library=library,
        motion={"feasibility": FeasibilityConfig(torque_share=0.01)},
        disable_env_checker=True,
    )
    with pytest.raises(RobotError, match=r"cannot perform the goal 'SQD'.*torque"):
        PathToGoal.for_env(weak, "SQD")
    weak.close()


@pytest.mark.parametrize("name", POLICIES)
def test_every_policy_does_a_task_it_is_for(name, library_file):
    task = NEEDS_TASK.get(name, ("goal",))[0]
    env = gymnasium.make(
        "mplearn/PrimitiveHumanoid-v0",
        library=library_file,
        task=task,
        dynamics="kinematic",
        disable_env_checker=True,
    )
    result = walk(env, POLICIES[name](env), 1, seed=2, episodes=1)
    assert result.episodes == 1
    assert not any(step.illegal for step in result.steps)
    if name in ("quick-path", "short-path", "likely-path", "search"):
        assert result.successes == 1
    elif task == "follow":
        assert result.successes is None
    env.close()


def test_policies_say_which_task_they_need(humanoid):
    for name, tasks in NEEDS_TASK.items():
        assert "free" not in tasks
        with pytest.raises(InvalidValueError, match="task"):
            walk(humanoid, POLICIES[name](humanoid), 1)

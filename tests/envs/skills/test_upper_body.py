"""Motions whose legs the robot cannot follow are shown with arms and head, standing."""

import gymnasium
import numpy as np
import pytest
from standing_library import standing_library

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError, RobotError
from mplearn_agents.cli import main
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.repertoire import Repertoire

ID = "mplearn/PrimitiveHumanoid-v0"


@pytest.fixture(scope="module")
def jump():
    return standing_library(("jump",))


def test_arms_move_and_legs_stand():
    robot, library = humanoid(), standing_library(("arms up", "kick", "squat", "jump"))
    whole, upper = (Repertoire(library, robot, upper_body=each).skills for each in (False, True))
    legs = 3 + robot.leg_joints
    for primitive in library.primitives:
        one, other = whole[primitive.id], upper[primitive.id]
        assert not other.lifts and other.motion.flight_m < 0.01
        assert np.ptp(other.frames[:, [0, 1, 2, *legs]], axis=0).max() == 0
        rest = np.setdiff1d(np.arange(len(robot.channels)), [0, 1, 2, *legs])
        assert np.array_equal(one.frames[:, rest], other.frames[:, rest])
        assert upper.feasibility(primitive.id).feasible


def test_an_environment_performs_only_what_is_asked(jump):
    with pytest.raises(RobotError, match="can perform none"):
        gymnasium.make(ID, library=jump, dynamics="kinematic").reset(seed=0)
    env = gymnasium.make(ID, library=jump, dynamics="kinematic", motion={"upper_body": True})
    _, info = env.reset(seed=0)
    assert info["action_mask"].sum() > 1
    with pytest.raises(InvalidValueError, match="upper_body must be one of"):
        gymnasium.make(ID, library=jump, motion={"upper_body": 1.0})


def test_perform_says_that_it_shows_the_upper_body(jump, tmp_path, capsys):
    path = jump.save(tmp_path / "jump.mplearn")
    assert main(["perform", str(path), "--steps", "2", "--dynamics", "kinematic"]) == 0
    shown = capsys.readouterr().out
    assert "none of the 1 motions whole (flight of both feet" in shown
    assert "2 primitives" in shown
    assert main(["perform", str(path), "--steps", "2", "--upper-body"]) == 0
    assert "0 falls" in capsys.readouterr().out

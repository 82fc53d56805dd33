"""The robot's model and description."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from mplearn.body import robot_body
from mplearn.errors import RobotError
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.robot import humanoid
from mplearn_envs.robot.compiling import read_model


def test_the_committed_model_is_what_the_build_makes():
    """In a process of its own: dm_control warns where there is no screen."""
    code = "from mplearn_envs.robot.build import build_humanoid as b; print(end=b())"
    path = os.pathsep.join(p for p in sys.path if p)
    built = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert built.stdout == read_model("humanoid")


def test_the_robot_is_the_body_with_servos():
    robot, body = humanoid(), robot_body()
    model = robot.model()
    assert robot.joint_names == body.driven_names and len(robot.joint_names) == 30
    assert robot.name == body.name
    np.testing.assert_allclose(robot.position_limits, body.joint_limits[body.driven])
    assert model.nu == 30
    assert model.body_mass.sum() == pytest.approx(body.model().body_mass.sum())
    np.testing.assert_allclose(model.actuator_gainprm[:, 0], robot.per_joint("stiffness"))
    np.testing.assert_allclose(-model.actuator_biasprm[:, 2], robot.per_joint("damping"))
    np.testing.assert_allclose(model.actuator_forcerange[:, 1], robot.per_joint("torque"))
    assert robot.channels[:3] == ("base_height", "base_roll", "base_pitch")
    assert len(robot.leg_joints) == 12 and len(robot.upper_joints) == 18


def test_an_incomplete_description_is_refused():
    robot = humanoid()
    with pytest.raises(RobotError, match="one servo and one group"):
        replace(robot, groups=robot.groups[1:])
    with pytest.raises(RobotError, match="knee_x"):
        replace(robot, knees=("knee_l", "knee_x"))
    with pytest.raises(RobotError, match="does not compile"):
        replace(robot, xml="<mujoco><nonsense/></mujoco>")


def test_nobody_changes_a_robot_that_others_share():
    robot = humanoid()
    for array in (
        robot.leg_joints, robot.upper_joints, robot.position_limits,
        robot.signs, robot.attention_angles,
    ):  # fmt: skip
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0
    moved = rest_reference(robot)
    moved.q[:], moved.ground[:] = 0.0, 0.0
    assert rest_reference(robot).q[3] == 1.0  # upright, as before

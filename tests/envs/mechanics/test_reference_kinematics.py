"""Kinematics and velocity IK against MuJoCo, numpy and mink."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planners import humanoid_reference

from mplearn.maths.rotation_kernels import rotation_error
from mplearn.maths.yaw_roll_pitch import roll_pitch_matrix
from mplearn_envs.control.balance import BalanceController
from mplearn_envs.mechanics.kinematics import forward, mass_tree, rotate_quaternion
from mplearn_envs.mechanics.reference import rest_reference
from mplearn_envs.mechanics.velocity_ik import (
    add_leg_columns,
    errors,
    jacobian_rows,
    settle,
)
from mplearn_envs.planning.footwork import sole_heights
from mplearn_envs.robot import humanoid

MODEL = humanoid().model()
TREE = mass_tree(MODEL)


def random_posture(rng, scale=0.5):
    q = humanoid_reference().rest.copy()
    q[:3] += rng.normal(scale=0.1, size=3)
    q[3:7] = rng.normal(size=4)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7:] += rng.normal(scale=scale, size=len(q) - 7)
    return q


@pytest.mark.parametrize("seed", range(5))
def test_bodies_hinges_and_cog_are_mujocos(seed):
    q = random_posture(np.random.default_rng(seed))
    data = mujoco.MjData(MODEL)
    data.qpos[:] = q
    mujoco.mj_kinematics(MODEL, data)
    mujoco.mj_comPos(MODEL, data)
    pose = forward(TREE, q)
    np.testing.assert_allclose(pose.position, data.xpos[1:], atol=1e-12)
    np.testing.assert_allclose(pose.rotation.reshape(-1, 9), data.xmat[1:], atol=1e-12)
    np.testing.assert_allclose(pose.anchor, data.xanchor[1:], atol=1e-12)
    np.testing.assert_allclose(pose.axis, data.xaxis[1:], atol=1e-12)
    np.testing.assert_allclose(
        pose.moment / pose.carried[:, None], data.subtree_com[1:], atol=1e-12
    )
    np.testing.assert_allclose(pose.carried, MODEL.body_subtreemass[1:])


@pytest.mark.parametrize("seed", range(3))
def test_the_rows_jacobian_is_their_derivative(seed):
    rng = np.random.default_rng(seed)
    q = random_posture(rng, 0.2)
    q[3:7] = rotate_quaternion(np.array([1.0, 0, 0, 0]), rng.normal(scale=0.2, size=3))
    q[2] = 0.7  # well below the guard, where the height row is plain
    stance = humanoid_reference().stance
    pose = forward(TREE, q)
    jacobian = jacobian_rows(stance, pose)
    add_leg_columns(TREE, stance, pose, jacobian)
    here = errors(stance, pose, 0.6, np.eye(3))
    here[3:6] = here[9:12] = here[15:18] = 0.0  # rotations: relative to the pose itself
    for column in range(jacobian.shape[1]):
        step, h = np.zeros(jacobian.shape[1]), 1e-6
        step[column] = h
        moved = q.copy()
        moved[:3] += step[:3]
        moved[3:7] = rotate_quaternion(q[3:7], step[3:6])
        moved[7 + stance.leg_joints] += step[6:]
        after = forward(TREE, moved)
        there = errors(stance, after, 0.6, np.eye(3))
        for side in range(2):
            foot = stance.feet[side]
            there[6 * side + 3 : 6 * side + 6] = rotation_error(
                pose.rotation[foot], after.rotation[foot]
            )
        there[15:18] = rotation_error(pose.rotation[0], after.rotation[0])
        # the guarded height deviates from the plain one by less than 1e-3 of its slope here
        np.testing.assert_allclose((here - there) / h, jacobian[:, column], atol=2e-3)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(-1.5, 1.5), min_size=3, max_size=3),
    st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda x: np.linalg.norm(x) > 0.1),
)
def test_a_rotation_error_undoes_the_rotation(vector, quaternion):
    start = np.array(quaternion) / np.linalg.norm(quaternion)
    turned = rotate_quaternion(start, np.array(vector))
    matrices = np.empty((2, 9))
    mujoco.mju_quat2Mat(matrices[0], start)
    mujoco.mju_quat2Mat(matrices[1], turned)
    error = rotation_error(matrices[1].reshape(3, 3), matrices[0].reshape(3, 3))
    np.testing.assert_allclose(error, vector, atol=1e-7)


def settled(upper, height, roll, pitch):
    q = humanoid_reference().rest.copy()
    q[7 + humanoid_reference().upper] = upper
    return settle(
        TREE, humanoid_reference().stance, q, height, roll_pitch_matrix(roll, pitch), 1e-10, 60
    )


@pytest.mark.parametrize("seed", range(3))
def test_the_balanced_posture_is_minks(seed):
    mink = pytest.importorskip("mink")
    rng = np.random.default_rng(seed)
    limits = humanoid_reference().limits[3:]
    upper = np.clip(rng.normal(scale=0.6, size=len(limits)), limits[:, 0], limits[:, 1])
    height, roll, pitch = 0.72, 0.05 * rng.normal(), 0.3 * rng.random()
    ours, worst = settled(upper, height, roll, pitch)
    assert worst < 1e-9

    configuration = mink.Configuration(MODEL, q=_with(humanoid_reference().rest, upper))
    tasks = []
    for side, name in enumerate(humanoid().feet):
        foot = mink.FrameTask(name, "body", position_cost=1.0, orientation_cost=1.0)
        foot.set_target(
            mink.SE3.from_rotation_and_translation(
                mink.SO3.from_matrix(humanoid_reference().stance.foot_rotation[side]),
                humanoid_reference().stance.foot_position[side],
            )
        )
        tasks.append(foot)
    com = mink.ComTask(cost=np.array([1.0, 1.0, 0.0]))
    com.set_target(np.append(humanoid_reference().stance.cog, 0.0))
    pelvis = mink.FrameTask("pelvis", "body", position_cost=[0.0, 0.0, 1.0], orientation_cost=1.0)
    free = [6 + int(j) for j in humanoid_reference().upper]
    upper_body = mink.DofFreezingTask(MODEL, dof_indices=free)
    for _ in range(200):
        # mink weighs errors in the body's frame: a target above the body leaves height alone
        place = np.array([*configuration.q[:2], ours[2]])
        turn = mink.SO3.from_matrix(roll_pitch_matrix(roll, pitch))
        pelvis.set_target(mink.SE3.from_rotation_and_translation(turn, place))
        velocity = mink.solve_ik(
            configuration,
            [*tasks, com, pelvis],
            0.05,
            "daqp",
            limits=[],
            constraints=[upper_body],
        )
        configuration.integrate_inplace(velocity, 0.05)
    np.testing.assert_allclose(configuration.q[7:], ours[7:], atol=1e-4)
    np.testing.assert_allclose(configuration.q[:3], ours[:3], atol=1e-4)


def _with(q, upper):
    out = q.copy()
    out[7 + humanoid_reference().upper] = upper
    return out


def test_knees_never_get_straight():
    knees = [7 + humanoid().joint_names.index(n) for n in humanoid().knees]
    for height in np.linspace(0.80, 1.2, 9):
        q, _ = settled(np.zeros(len(humanoid_reference().upper)), height, 0.0, 0.3)
        assert (q[knees] > humanoid().guard_knee_rad - 1e-3).all()


def test_knees_do_not_get_straight_while_the_hips_rise():
    """A quick roll lifts one hip: what the guard allows moves, and must not be followed late."""
    controller, here = BalanceController(humanoid()), rest_reference(humanoid())
    knees = [7 + humanoid().joint_names.index(n) for n in humanoid().knees]
    for x in np.linspace(0.0, 1.0, 100):
        target = here.target.copy()
        target[1] = 0.35 * x * x * (3.0 - 2.0 * x)
        here = controller.update(here, target, 0.004)
        assert here.q[knees].min() > humanoid().guard_knee_rad


def test_the_height_is_reached_where_the_guard_is_far():
    q, worst = settled(np.zeros(len(humanoid_reference().upper)), 0.7, 0.0, 0.0)
    assert worst < 1e-9
    assert q[2] == pytest.approx(0.7, abs=1e-3)


def test_sole_heights_are_mujocos():
    rng = np.random.default_rng(1)
    frames = np.zeros((4, 33))
    frames[:, 0] = 0.885
    frames[:, 1:3] = rng.normal(scale=0.2, size=(4, 2))
    frames[:, 3:] = rng.normal(scale=0.3, size=(4, 30))
    data = mujoco.MjData(MODEL)
    for frame, ours in zip(frames, sole_heights(humanoid(), frames), strict=True):
        matrix = roll_pitch_matrix(frame[1], frame[2])
        data.qpos[:3] = 0.0, 0.0, frame[0]
        mujoco.mju_mat2Quat(data.qpos[3:7], matrix.ravel())
        data.qpos[7:] = frame[3:]
        mujoco.mj_kinematics(MODEL, data)
        for side, name in enumerate(("sole_l", "sole_r")):
            geom = MODEL.geom(name)
            turn = data.geom(name).xmat.reshape(3, 3)
            lowest = data.geom(name).xpos[2] - np.abs(turn[2]) @ geom.size
            assert ours[side] == pytest.approx(lowest, abs=1e-9)

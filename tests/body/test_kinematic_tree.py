"""The plain-array kinematics against MuJoCo, to 1e-10."""

import mujoco
import numpy as np
import pytest

from mplearn.body import KinematicTree, human_body, marker_set, robot_body
from mplearn.body.inverse_kinematics.follower import follower
from mplearn.body.kinematics.kernels import integrate
from mplearn.body.models.body import body_from_xml
from mplearn.errors import BodyError

ODD = """<mujoco><worldbody><body name="a" pos="0 0 1" quat="0.9 0.1 -0.3 0.2"><freejoint/>
<geom size="0.1"/>
<body name="b" pos="0.1 0.2 0.3" quat="0.5 0.5 -0.5 0.5">
<joint name="turn" axis="1 2 3" pos="0.1 -0.1 0.2"/><joint name="push" type="slide" axis="0 1 1"/>
<geom size="0.1"/><site name="p" pos="0.3 0.1 0"/>
<body name="c" pos="0 0 0.4"><joint name="bend" axis="0 1 0" pos="0 0 0.1"/><geom size="0.1"/>
<site name="s" pos="0.1 0.2 0.3"/></body></body></body></worldbody></mujoco>"""


def random_posture(tree, rng):
    q = np.concatenate((rng.normal(size=7), rng.uniform(*tree.limits.T)))
    q[3:7] /= np.linalg.norm(q[3:7])
    return q


def models():
    robot = robot_body()
    odd = mujoco.MjModel.from_xml_string(ODD)
    return [
        pytest.param(human_body().tree, human_body().model(), id="human"),
        pytest.param(
            human_body(1.62, {"thigh": 0.9, "head": 1.2}).tree,
            human_body(1.62, {"thigh": 0.9, "head": 1.2}).model(),
            id="human of another size",
        ),
        pytest.param(robot.tree, robot.model(), id="robot"),
        pytest.param(KinematicTree.from_model(odd), odd, id="turned frames, anchors, slides"),
    ]


@pytest.mark.parametrize(("tree", "model"), models())
def test_against_mujoco(tree, model):
    rng = np.random.default_rng(1)
    data = mujoco.MjData(model)
    for _ in range(20):
        q = random_posture(tree, rng)
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        pos, mat = tree.forward(q)
        np.testing.assert_allclose(pos, data.xpos[1:], atol=1e-10)
        np.testing.assert_allclose(mat.reshape(-1, 9), data.xmat[1:], atol=1e-10)
        np.testing.assert_allclose(tree.site_positions(q), data.site_xpos, atol=1e-10)
        jacobian = tree.jacobian(q, tree.site_body, tree.site_offset)
        expected = np.zeros((3, model.nv))
        for i in range(model.nsite):
            mujoco.mj_jacSite(model, data, expected, None, i)
            np.testing.assert_allclose(jacobian[i], expected, atol=1e-10)
        step = rng.normal(size=model.nv)
        moved, theirs = q.copy(), q.copy()
        integrate(moved, step)
        mujoco.mj_integratePos(model, theirs, step, 1.0)
        np.testing.assert_allclose(moved, theirs, atol=1e-12)


def test_the_jacobian_is_the_derivative_of_the_markers():
    tree = robot_body().tree
    bodies, offsets = marker_set("paper34").attach(tree)
    rng = np.random.default_rng(2)
    q, step = random_posture(tree, rng), rng.normal(size=tree.n_dofs)
    ahead, behind = q.copy(), q.copy()
    integrate(ahead, 1e-6 * step)
    integrate(behind, -1e-6 * step)
    numeric = (tree.points(ahead, bodies, offsets) - tree.points(behind, bodies, offsets)) / 2e-6
    np.testing.assert_allclose(tree.jacobian(q, bodies, offsets) @ step, numeric, atol=1e-7)


def test_scaling_is_the_same_for_arrays_and_xml():
    factors = np.full((20, 3), 1.1)
    tall = human_body(1.75 * 1.1)
    np.testing.assert_allclose(human_body().tree.scaled(factors).offset, tall.tree.offset)


def test_the_follower_of_the_robot_is_the_robot_where_its_clavicles_rest():
    robot = robot_body()
    seen = follower(robot)
    rng = np.random.default_rng(4)
    own, full = random_posture(robot.tree, rng), np.zeros(len(seen.tree.rest))
    full[seen.own] = own
    for name in robot.tree.body_names:
        np.testing.assert_allclose(
            seen.tree.forward(full)[0][seen.tree.body(name)],
            robot.tree.forward(own)[0][robot.tree.body(name)],
            atol=1e-12,
        )


@pytest.mark.parametrize(
    ("xml", "message"),
    [
        ("<mujoco><worldbody><body><geom size='1'/></body></worldbody></mujoco>", "free joint"),
        (ODD.replace('type="slide" axis="0 1 1"', 'type="ball"'), "hinges or slides"),
        (ODD, "head_top"),
        ("<mujoco><oops/></mujoco>", "does not compile"),
    ],
)
def test_models_that_are_no_bodies(xml, message):
    with pytest.raises(BodyError, match=message):
        body_from_xml("odd", xml)


def test_wrong_arguments():
    tree = robot_body().tree
    with pytest.raises(BodyError, match="shape"):
        tree.forward(np.zeros(10))
    with pytest.raises(BodyError, match="tail"):
        tree.body("tail")
    with pytest.raises(BodyError, match="positive"):
        tree.scaled(-np.ones_like(tree.offset))

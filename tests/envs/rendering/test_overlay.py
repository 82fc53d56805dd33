"""What is drawn on the floor is where the robot stands."""

import mujoco
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from mplearn_agents.film.film import zero_moment_points
from mplearn_agents.walk import WalkResult
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.rendering.overlay import BalanceMeter
from mplearn_envs.robot import humanoid


@pytest.fixture(scope="module")
def simulation():
    standing = Simulation(humanoid())
    standing.reset()
    return standing


def test_the_marks_of_a_standing_robot(simulation):
    before = simulation.state()
    marks = BalanceMeter(simulation.model).measure(simulation.data)
    np.testing.assert_array_equal(simulation.state(), before)  # it only looks
    soles = simulation.soles()[..., :2].reshape(-1, 2)
    expected = soles[ConvexHull(soles).vertices]
    assert ConvexHull(marks.polygon).volume == pytest.approx(ConvexHull(expected).volume)
    np.testing.assert_allclose(marks.cog, simulation.data.subtree_com[1], atol=1e-6)
    np.testing.assert_allclose(marks.zmp, marks.cog[:2], atol=2e-3)  # at rest they coincide


def test_a_push_moves_the_zmp_and_flying_leaves_none(simulation):
    meter, model = BalanceMeter(simulation.model), simulation.model
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = simulation.data.qpos, simulation.data.ctrl
    data.xfrc_applied[model.body("chest").id, 0] = 60.0  # a push forwards
    height = model.body("chest").ipos[2] + simulation.data.xpos[model.body("chest").id, 2]
    still = meter.measure(simulation.data).zmp[0]
    for _ in range(60):
        mujoco.mj_step(model, data)
    moved = meter.measure(data).zmp[0] - still
    weight = 9.81 * model.body_mass.sum()
    assert 0.3 * 60 * height / weight < moved < 1.5 * 60 * height / weight
    data.qpos[2] += 0.3
    flying = meter.measure(data)
    assert len(flying.polygon) == 0 and np.isnan(flying.zmp).all()


def test_one_foot_in_the_air_leaves_the_others_sole(simulation):
    data = mujoco.MjData(simulation.model)
    data.qpos[:] = simulation.data.qpos
    for name, angle in (("hip_pitch_l", -0.8), ("knee_l", 1.2)):
        data.joint(name).qpos[0] += angle
    marks = BalanceMeter(simulation.model).pose(data, np.zeros(2))
    right = simulation.soles()[1, :, :2]
    assert ConvexHull(marks.polygon).volume == pytest.approx(ConvexHull(right).volume, rel=1e-3)
    np.testing.assert_array_equal(marks.zmp, np.zeros(2))


def test_the_zmp_of_a_recorded_walk_is_the_pendulums(simulation):
    """A base that sways as a sine: the cart-table's ZMP in closed form."""
    t, omega = np.arange(200) / 50.0, 3.0
    postures = np.tile(simulation.data.qpos, (200, 1))
    postures[:, 1] += 0.02 * np.sin(omega * t)
    walk = WalkResult((), postures, np.zeros(200, dtype=np.int64), 50.0)
    found = zero_moment_points(walk, humanoid().xml)
    height = simulation.data.subtree_com[1, 2]
    sway = 0.02 * np.sin(omega * t) * (1 + height * omega**2 / 9.81)
    middle = simulation.data.subtree_com[1, 1]
    np.testing.assert_allclose(found[5:-5, 1], middle + sway[5:-5], atol=1e-3)


def test_the_marks_are_drawn(renderer, simulation):
    from mplearn_envs.rendering.renderer import Renderer

    model, data = simulation.model, simulation.data
    pictures = []
    for balance in (False, True):
        drawer = Renderer(model, 240, 180, balance=balance)
        drawer.camera.elevation = -30.0
        pictures.append(drawer.render(data).astype(int))
        drawer.close()
    added = (np.abs(pictures[1] - pictures[0]).max(axis=2) > 40) & (pictures[1].std(axis=2) > 40)
    assert 20 < added.sum() < 2000
    without, drawn = ((p[..., 0] - p[..., 1:].max(axis=2)).max() for p in pictures)
    assert drawn > 30 > without  # the ZMP is the one thing that is red

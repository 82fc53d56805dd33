"""Hull, margins and zero-moment points against scipy and mechanics."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay

from mplearn.errors import InvalidValueError
from mplearn_envs.mechanics.inverse_dynamics import InverseDynamics
from mplearn_envs.mechanics.reference import reference_robot
from mplearn_envs.mechanics.support import (
    convex_hull,
    pendulum_zmp,
    support_margin,
    zero_moment_point,
)
from mplearn_envs.robot import humanoid


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(4, 20))
def test_the_hull_and_the_inside_are_scipys(seed, n):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 2))
    hull = convex_hull(points)
    expected = points[ConvexHull(points).vertices]
    assert sorted(map(tuple, hull)) == sorted(map(tuple, expected))
    area = 0.5 * np.sum(hull[:, 0] * np.roll(hull[:, 1], -1) - hull[:, 1] * np.roll(hull[:, 0], -1))
    assert area == pytest.approx(ConvexHull(points).volume)  # positive: counter-clockwise
    probes = rng.normal(size=(50, 2))
    inside = Delaunay(hull).find_simplex(probes) >= 0
    np.testing.assert_array_equal(support_margin(hull, probes) >= 0, inside)


def test_margins_of_a_rectangle():
    hull = convex_hull(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0], [2.0, 0.0]]))
    assert len(hull) == 4
    points = np.array([[2.0, 1.0], [0.5, 1.0], [5.0, 1.0], [np.nan, 1.0]])
    np.testing.assert_allclose(support_margin(hull, points), [1.0, 0.5, -1.0, np.nan])


@pytest.mark.parametrize("yaw", [0.0, 0.3, -1.2])
def test_rounding_of_soles_side_by_side_costs_no_corner(yaw):
    rng = np.random.default_rng(0)
    sole = np.array([[0.15, 0.05], [0.15, -0.05], [-0.1, -0.05], [-0.1, 0.05]])
    aside = np.array([0.0, 0.1])
    corners = np.concatenate((sole + aside, sole - aside))
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    for _ in range(200):
        seen = (corners + rng.uniform(-1, 1, corners.shape) * 1e-17) @ turn.T
        seen += rng.uniform(-1, 1, corners.shape) * 1e-16
        margin = support_margin(convex_hull(rng.permutation(seen)), np.zeros(2))
        assert margin == pytest.approx(0.1, abs=1e-9)


def test_points_without_a_polygon_are_refused():
    with pytest.raises(InvalidValueError, match="no polygon"):
        convex_hull(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]))


def test_the_zmp_of_two_vertical_forces_is_their_centre():
    places, forces = np.array([[0.1, 0.2, 0.0], [0.3, -0.1, 0.0]]), np.array([100.0, 300.0])
    origin = np.array([0.05, 0.02, 0.9])
    force = np.array([20.0, -10.0, forces.sum()])
    moment = np.zeros(3)
    for place, lift in zip(places, forces, strict=True):
        share = np.append(force[:2] * lift / forces.sum(), lift)
        moment += np.cross(place - origin, share)
    expected = (places[:, :2] * forces[:, None]).sum(axis=0) / forces.sum()
    np.testing.assert_allclose(zero_moment_point(force, moment, origin), expected)
    assert np.isnan(zero_moment_point(np.zeros(3), moment, origin)).all()


def test_a_point_masss_zmp_is_the_pendulums():
    cog, acceleration = np.array([0.1, 0.2, 0.8]), np.array([1.0, -0.5, 0.3])
    force = 50.0 * (acceleration + np.array([0.0, 0.0, 9.81]))
    np.testing.assert_allclose(
        pendulum_zmp(cog, acceleration), zero_moment_point(force, np.zeros(3), cog)
    )


def test_static_torques_are_those_of_the_simulation():
    robot = humanoid()
    rest = reference_robot(robot).rest
    dynamics = InverseDynamics(robot)
    share = dynamics.along(np.repeat(rest[None], 6, axis=0), 0.02)
    model = robot.model()
    data = mujoco.MjData(model)
    data.qpos[:] = rest
    data.ctrl[:] = rest[7:]
    for _ in range(500):
        mujoco.mj_step(model, data)
    measured = np.abs(data.actuator_force) / robot.per_joint("torque")
    np.testing.assert_allclose(share[0], measured, atol=0.02)


@settings(max_examples=200, deadline=None)
@given(
    noise=st.lists(st.integers(-8, 8), min_size=16, max_size=16),
    sideways=st.booleans(),
    foot=st.tuples(st.floats(0.1, 0.3), st.floats(0.05, 0.15), st.floats(0.0, 0.2)),
)
def test_rounding_of_corners_on_one_line_changes_nothing(noise, sideways, foot):
    """Soles side by side: four corners lie on one line, but for the last bits of their numbers."""
    length, width, apart = foot
    x, y = (-length / 2, length / 2), (apart / 2 + width, apart / 2)
    corners = np.array([(a, s * b) for s in (1, -1) for a in x for b in y])
    corners = corners + 2.0**-56 * np.reshape(noise, (8, 2))
    corners = corners[:, ::-1] if sideways else corners
    margin = float(support_margin(convex_hull(corners), np.zeros(2)))
    assert margin == pytest.approx(min(length / 2, y[0]), abs=1e-8)

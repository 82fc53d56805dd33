"""Forces of the ground, against scipy's non-negative least squares and the friction cone."""

import numpy as np
import pytest
from scipy.optimize import nnls

from mplearn_envs.mechanics.ground_forces import contact_forces

WEIGHT = np.array([1.0, 1.0, 0.7, 1.0, 1.0, 1.0])
FRICTION = 0.6


@pytest.fixture
def points():
    x, y = np.meshgrid([-0.09, 0.15], [-0.145, -0.035, 0.035, 0.145])
    return np.column_stack((x.ravel(), y.ravel(), np.full(8, -0.93)))


def _sum(points, forces):
    return np.concatenate((forces.sum(axis=0), np.cross(points, forces).sum(axis=0)))


def _miss(points, forces, wrench):
    return np.linalg.norm(WEIGHT * (_sum(points, forces) - wrench))


def _best(points, wrench):
    slope = FRICTION / np.sqrt(2.0)
    edges = [np.array([a * slope, b * slope, 1.0]) for a in (1, -1) for b in (1, -1)]
    columns = [
        WEIGHT * np.concatenate((edge, np.cross(point, edge))) for point in points for edge in edges
    ]
    return nnls(np.array(columns).T, WEIGHT * wrench)[1]


def test_what_the_soles_can_do_they_do(points):
    rng = np.random.default_rng(0)
    for _ in range(20):
        forces = np.column_stack((rng.uniform(-10, 10, (8, 2)), rng.uniform(40, 100, 8)))
        wrench = _sum(points, forces)
        found = contact_forces(points, wrench, WEIGHT, FRICTION)
        assert _miss(points, found, wrench) < 0.01 * np.linalg.norm(wrench)


def test_what_they_cannot_do_is_nearly_as_near_as_can_be(points):
    rng = np.random.default_rng(0)
    for _ in range(20):
        wrench = np.concatenate((rng.normal(0, 200, 2), [600.0], rng.normal(0, 150, 3)))
        found = contact_forces(points, wrench, WEIGHT, FRICTION)
        assert _miss(points, found, wrench) < _best(points, wrench) + 0.02 * np.linalg.norm(wrench)


def test_forces_push_and_stay_in_the_cone(points):
    wrench = np.array([900.0, -400.0, 600.0, 200.0, 0.0, 50.0])
    forces = contact_forces(points, wrench, WEIGHT, FRICTION)
    assert (forces[:, 2] >= 0.0).all()
    assert (np.hypot(*forces[:, :2].T) <= FRICTION * forces[:, 2] + 1e-9).all()
    assert not contact_forces(points[:0], wrench, WEIGHT, FRICTION).size

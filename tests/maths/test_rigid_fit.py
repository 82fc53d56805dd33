"""Rigid fits against scipy's, and against motions that are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from mplearn.maths.rigid_fit import fit_rigid, fit_similarity, fit_upright

seeds = st.integers(0, 2**32 - 1)


def moved(rng, points, size=1.0):
    turn, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    return turn, shift, size * points @ turn.T + shift


@settings(deadline=None)
@given(seeds, st.integers(3, 9))
def test_a_rigid_motion_is_found_again(seed, n_points):
    rng = np.random.default_rng(seed)
    source = rng.normal(size=(n_points, 3))
    turn, shift, target = moved(rng, source)
    fit = fit_rigid(source, target)
    np.testing.assert_allclose(fit.rotation, turn, atol=1e-6)
    np.testing.assert_allclose(fit.translation, shift, atol=1e-6)
    np.testing.assert_allclose(fit.apply(source), target, atol=1e-6)


@settings(deadline=None)
@given(seeds)
def test_noisy_fits_are_scipys(seed):
    rng = np.random.default_rng(seed)
    source = rng.normal(size=(7, 3))
    target = moved(rng, source)[2] + 0.3 * rng.normal(size=(7, 3))
    fit = fit_rigid(source, target)
    middles = [points.mean(axis=0) for points in (source, target)]
    theirs, _ = Rotation.align_vectors(target - middles[1], source - middles[0])
    np.testing.assert_allclose(fit.rotation, theirs.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(fit.apply(middles[0]), middles[1], atol=1e-12)


@settings(deadline=None)
@given(seeds)
def test_a_reflection_is_never_the_answer(seed):
    rng = np.random.default_rng(seed)
    source, target = rng.normal(size=(2, 5, 3))
    assert np.linalg.det(fit_rigid(source, target).rotation) == pytest.approx(1.0)


@settings(deadline=None)
@given(seeds, st.floats(0.2, 5.0))
def test_a_size_is_found_and_a_mirror_image_told(seed, size):
    rng = np.random.default_rng(seed)
    source = rng.normal(size=(8, 3)) * [1.0, 2.0, 3.0]
    turn, _, target = moved(rng, source, size)
    fit = fit_similarity(source, target)
    assert fit.size == pytest.approx(size) and fit.mirrored == 0.0
    np.testing.assert_allclose(fit.rotation, turn, atol=1e-6)
    np.testing.assert_allclose(fit.apply(source), target, atol=1e-6)
    np.testing.assert_allclose(fit.apply(source[0]), target[0], atol=1e-6)
    flat = np.linalg.svd(source - source.mean(axis=0), compute_uv=False)
    image = fit_similarity(source, target * [1.0, -1.0, 1.0])
    assert image.mirrored == pytest.approx(size * flat[2] ** 2 / (flat**2).sum())


@settings(deadline=None)
@given(seeds)
def test_an_upright_fit_is_the_best_heading(seed):
    rng = np.random.default_rng(seed)
    source, target = rng.normal(size=(2, 6, 3))
    fit = fit_upright(source, target)

    def cost(yaw):
        turn = Rotation.from_euler("z", yaw).as_matrix()
        gap = target - source @ turn.T
        return ((gap - gap.mean(axis=0))[:, :2] ** 2).sum()

    own = ((target - fit.apply(source))[:, :2] ** 2).sum()
    grid = np.linspace(-np.pi, np.pi, 25)
    best = min(minimize_scalar(cost, bounds=(a, a + 0.3), method="bounded").fun for a in grid)
    assert own <= best + 1e-9
    np.testing.assert_array_equal(fit.apply(source)[:, 2], source[:, 2])

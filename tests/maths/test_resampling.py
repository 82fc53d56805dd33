"""Splines, linear interpolation, gaps and easing against scipy, numpy and closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import interp1d, make_interp_spline

from mplearn.errors import InvalidValueError
from mplearn.maths.easing import minimum_jerk, smooth_step
from mplearn.maths.resampling import (
    bridge_gaps,
    interpolate_each,
    interpolate_linearly,
    stretch,
)
from mplearn.maths.splines import interpolate


@pytest.mark.parametrize("n_knots", range(1, 9))
def test_a_spline_is_scipys(n_knots):
    rng = np.random.default_rng(n_knots)
    knots = rng.standard_normal((n_knots, 3))
    places = np.append(rng.uniform(0, n_knots - 1, 30), [0, n_knots - 1])
    if n_knots == 1:
        expected = np.repeat(knots, 32, axis=0)
    else:
        degree = min(3, n_knots - 1)
        expected = make_interp_spline(np.arange(n_knots), knots, k=degree)(places)
    np.testing.assert_allclose(interpolate(knots, places), expected, atol=1e-12)


@settings(deadline=None)
@given(st.integers(1, 40), st.integers(1, 60), st.integers(0, 2**32 - 1))
def test_linear_interpolation_is_scipys(n_frames, n_places, seed):
    rng = np.random.default_rng(seed)
    frames = rng.normal(size=(n_frames, 3))
    places = np.append(rng.uniform(0, n_frames - 1, n_places), [0.0, n_frames - 1.0])
    if n_frames == 1:
        expected = np.repeat(frames, n_places + 2, axis=0)
    else:
        expected = interp1d(np.arange(n_frames), frames, axis=0)(places)
    np.testing.assert_allclose(interpolate_linearly(frames, places), expected, atol=1e-13)
    stretched = stretch(frames, n_places)
    assert stretched.shape == (n_places, 3)
    np.testing.assert_array_equal(stretched[0], frames[0])
    if n_places > 1:
        np.testing.assert_array_equal(stretched[-1], frames[-1])


def test_beside_a_gap_stands_its_edge():
    frames = np.array([[0.0], [1.0], [np.nan], [np.nan], [4.0]])
    found = interpolate_linearly(frames, np.array([0.5, 1.2, 1.5, 2.5, 3.4, 3.5, 3.9]))
    np.testing.assert_array_equal(found.ravel(), [0.5, 1.0, np.nan, np.nan, np.nan, 4.0, 4.0])


@pytest.mark.parametrize("place", [-0.1, 2.1, np.nan, np.inf])
def test_there_is_nothing_before_the_first_frame_or_behind_the_last(place):
    with pytest.raises(InvalidValueError, match=r"places must lie in \[0, 2\]"):
        interpolate_linearly(np.zeros((3, 1)), np.array([0.0, place]))
    with pytest.raises(InvalidValueError, match="places"):
        stretch(np.zeros((0, 1)), 4)


def test_many_motions_are_interpolated_as_one_by_one():
    rng = np.random.default_rng(0)
    motions = [rng.normal(size=(n, 3)) for n in (1, 2, 40, 7)]
    motions[2][10:13] = np.nan
    shares = np.append(rng.uniform(size=20), [0.0, 1.0])
    together = interpolate_each([*motions[:3], np.asfortranarray(motions[3])], shares)
    for motion, found in zip(motions, together, strict=True):
        expected = interpolate_linearly(motion, shares * (len(motion) - 1))
        np.testing.assert_array_equal(found, expected)
    for bad in (-0.01, 1.01, np.nan):
        with pytest.raises(InvalidValueError, match=r"shares must lie in \[0, 1\]"):
            interpolate_each(motions, np.array([bad]))
    with pytest.raises(InvalidValueError, match="motion 1 has no frames"):
        interpolate_each([motions[0], np.zeros((0, 3))], shares)


@settings(deadline=None)
@given(st.integers(1, 30), st.integers(0, 2**32 - 1))
def test_gaps_are_bridged_like_numpys_interp(n_frames, seed):
    rng = np.random.default_rng(seed)
    whole = rng.normal(size=(n_frames, 4))
    frames = np.where(rng.random(whole.shape) < 0.4, np.nan, whole)
    filled = bridge_gaps(frames)
    for own, got in zip(frames.T, filled.T, strict=True):
        known = np.flatnonzero(~np.isnan(own))
        if len(known):
            np.testing.assert_allclose(got, np.interp(np.arange(n_frames), known, own[known]))
            np.testing.assert_array_equal(got[known], own[known])
        else:
            assert np.isnan(got).all()
    assert bridge_gaps(whole) is whole


@pytest.mark.parametrize(("ease", "order"), [(smooth_step, 1), (minimum_jerk, 2)])
def test_easing_is_the_polynomial_that_is_at_rest_at_both_ends(ease, order):
    n = 2 * order + 2  # of position and so many derivatives at both ends
    rows = [
        np.polynomial.polynomial.polyvander(np.array([x]), n - 1)[0]
        if k == 0
        else np.array([np.polynomial.Polynomial.basis(p).deriv(k)(x) for p in range(n)])
        for x in (0.0, 1.0)
        for k in range(order + 1)
    ]
    wanted = np.zeros(n)
    wanted[order + 1] = 1.0
    coefficients = np.linalg.solve(np.array(rows), wanted)
    x = np.linspace(0, 1, 21)
    expected = np.polynomial.polynomial.polyval(x, coefficients)
    np.testing.assert_allclose(ease(x), expected, atol=1e-12)

"""Distances between windows, against quadrature and against the sums written out."""

import numpy as np
import pytest
from densities import density_distance
from scipy.integrate import dblquad, quad

from mplearn.segmentation.windows import new_windows, push_point

ONE = np.ones(1)  # all channels alike


def parzen(points, sigma, x):
    n = points.shape[1]
    squared = ((points - x) ** 2).sum(axis=1)
    return np.exp(-squared / (2 * sigma**2)).mean() / (2 * np.pi * sigma**2) ** (n / 2)


@pytest.mark.parametrize("sigma", [0.3, 1.0, 4.0])
def test_closed_form_is_the_integral_in_one_dimension(sigma):
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(6, 1)), rng.normal(size=(6, 1)) + 0.7
    integral, _ = quad(
        lambda x: (parzen(a, sigma, x) - parzen(b, sigma, x)) ** 2, -40, 40, limit=400, points=[0]
    )
    closed = density_distance(a, b, sigma) / (4 * np.pi * sigma**2) ** 0.5
    assert closed == pytest.approx(integral, rel=1e-6)


def test_closed_form_is_the_integral_in_two_dimensions():
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(3, 2)), rng.normal(size=(3, 2)) + 0.5
    integral, _ = dblquad(
        lambda y, x: (parzen(a, 1.0, [x, y]) - parzen(b, 1.0, [x, y])) ** 2,
        -8,
        9,
        -8,
        9,
        epsabs=1e-8,
    )
    assert density_distance(a, b, 1.0) / (4 * np.pi) == pytest.approx(integral, rel=1e-5)


@pytest.mark.parametrize(("length", "count"), [(2, 8), (7, 40), (30, 35)])
def test_incremental_distances_are_those_of_the_windows(length, count):
    x = np.random.default_rng(3).normal(size=(160, 3)).cumsum(axis=0) * 0.3
    windows = new_windows(3, length, count)
    size = length + count
    for t in range(len(x)):
        push_point(x[t], ONE, t, 0.8, windows)
        if t < length - 1 or t % 7:
            continue
        for s in range(max(length - 1, t - count + 1), t + 1):
            expected = density_distance(x[s - length + 1 : s + 1], x[t - length + 1 : t + 1], 0.8)
            assert windows.distances[s % size] == pytest.approx(expected, abs=1e-12)


def test_rounding_does_not_build_up():
    x = np.random.default_rng(4).normal(size=(20_000, 2))
    windows = new_windows(2, 5, 50)
    for t in range(len(x)):
        push_point(x[t], ONE, t, 1.0, windows)
    t = len(x) - 1
    for s in range(t - 49, t + 1):
        expected = density_distance(x[s - 4 : s + 1], x[t - 4 : t + 1], 1.0)
        assert windows.distances[s % 55] == pytest.approx(expected, abs=1e-12)


def test_distance_is_bounded_symmetric_and_zero_for_the_same_window():
    rng = np.random.default_rng(5)
    a, b = rng.normal(size=(9, 4)), rng.normal(size=(9, 4)) + 100
    assert density_distance(a, a, 0.5) == 0.0
    assert density_distance(a, b, 0.5) == density_distance(b, a, 0.5)
    assert 0.0 < density_distance(a, b, 0.5) <= 2.0

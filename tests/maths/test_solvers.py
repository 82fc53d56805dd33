"""Small and banded systems against whole matrices of numpy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.maths.banded import factorise, multiply, solve
from mplearn.maths.solvers import solve_damped
from mplearn.maths.tree_solvers import bounded_solve, inverse_diagonal


def test_damped_least_squares_is_numpys():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(18, 18)), rng.normal(size=18)
    stacked = np.vstack((a, 0.1 * np.eye(18)))
    expected = np.linalg.lstsq(stacked, np.append(b, np.zeros(18)), rcond=None)[0]
    np.testing.assert_allclose(solve_damped(a, b, 0.1), expected, atol=1e-9)


@pytest.mark.parametrize("at_bounds", [False, True])
@pytest.mark.parametrize("dense", [True, False])
def test_bounded_least_squares_satisfies_the_optimality_conditions(dense, at_bounds):
    rng = np.random.default_rng(6)
    for _ in range(300):
        d = int(rng.integers(2, 12))
        a = rng.normal(size=(d + 3, d))
        normal, gradient = a.T @ a, rng.normal(size=d) * 3
        low, high = -rng.uniform(0, 1, d), rng.uniform(0, 1, d)
        free, step = rng.random(d) > 0.2, np.empty(d)
        if at_bounds:  # as joints do that were at theirs before
            side = rng.random(d)
            low[side < 0.4], high[side > 0.7] = 0.0, 0.0
        above = np.arange(-1, d - 1) if dense else np.array([rng.integers(-1, i) for i in range(d)])
        if not dense:  # nothing but between an unknown and those above it
            on_path = np.eye(d, dtype=bool)
            for i in range(d):
                on_path[i] |= on_path[above[i]] if above[i] >= 0 else False
            normal = np.where(on_path | on_path.T, normal, 0.0) + 10.0 * d * np.eye(d)
        bounded_solve(np.tril(normal), gradient, low, high, free, above, step)
        assert ((low <= step) & (step <= high)).all() and not step[~free].any()
        slope = gradient - normal @ step
        inner = free & (step > low) & (step < high)
        np.testing.assert_allclose(slope[inner], 0, atol=1e-8)
        assert (slope[free & (step <= low)] <= 1e-8).all()
        assert (slope[free & (step >= high)] >= -1e-8).all()
        out = np.empty(d)
        inverse_diagonal(np.tril(normal), free, above, out)
        np.testing.assert_allclose(
            out[free], np.diag(np.linalg.inv(normal[np.ix_(free, free)])), rtol=1e-6
        )


def whole(columns):
    """Return the matrices, shape (D, T, T), of their columns from the diagonal down."""
    n = len(columns)
    out = np.zeros((columns.shape[2], n, n))
    for t in range(n):
        for i in range(min(columns.shape[1], n - t)):
            out[:, t + i, t] = out[:, t, t + i] = columns[t, i]
    return out


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 30), st.integers(1, 5), st.integers(0, 2**32))
def test_banded_matrices_are_the_whole_ones(n_rows, n_band, seed):
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((n_rows, n_band, 2))
    columns[:, 0] = 2 * n_band + rng.uniform(0, 9, (n_rows, 2))
    matrices, x = whole(columns), rng.standard_normal((n_rows, 2))
    factor = columns.copy()
    factorise(factor)
    for d in range(2):
        expected = np.linalg.cholesky(matrices[d])
        np.testing.assert_allclose(multiply(factor, x)[:, d], expected @ x[:, d], atol=1e-10)
    solved = x.copy()
    solve(factor, solved)
    np.testing.assert_allclose(np.einsum("dij,jd->id", matrices, solved), x, atol=1e-10)

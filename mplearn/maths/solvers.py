"""Small least squares in compiled loops: damped, or between bounds; Cholesky for both."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..recording import BoolArray, FloatArray


@njit(cache=True)
def solve_damped(jacobian: FloatArray, rows: FloatArray, damping: float) -> FloatArray:
    """Return argmin |J x - rows|^2 + damping^2 |x|^2 [Wampler1986], by the normal equations.

    Args:
        jacobian: J, shape (m, n).
        rows: Shape (m,).
        damping: Positive.

    Returns:
        x, shape (n,).

    Example:
        >>> solve_damped(np.eye(2), np.array([1.0, 2.0]), 1.0)
        array([0.5, 1. ])
    """
    m, n = jacobian.shape
    normal = np.empty((n, n))
    x = np.empty(n)
    for i in range(n):
        total = 0.0
        for k in range(m):
            total += jacobian[k, i] * rows[k]
        x[i] = total
        for j in range(i + 1):
            total = 0.0
            for k in range(m):
                total += jacobian[k, i] * jacobian[k, j]
            normal[i, j] = total
        normal[i, i] += damping * damping
    cholesky(normal)
    cholesky_solve(normal, x)
    return x


@njit(cache=True)
def bounded_solve(
    normal: FloatArray,
    gradient: FloatArray,
    low: FloatArray,
    high: FloatArray,
    free: BoolArray,
    step: FloatArray,
) -> None:
    """Minimise the quadratic model between bounds by an active set.

    What runs into a bound is fixed there. Once nothing does, what a bound holds against its own
    slope is released, each unknown at most twice, so that the search ends.

    Args:
        normal: Symmetric positive definite, its lower triangle, shape (d, d).
        gradient: Descent direction at zero, shape (d,).
        low: Lower bounds, shape (d,).
        high: Upper bounds, shape (d,).
        free: Unknowns that may move at all, shape (d,).
        step: The solution, shape (d,), filled.

    Example:
        >>> step, bound = np.empty(2), np.array([1.0, 1.0])
        >>> bounded_solve(np.eye(2), np.array([0.5, 3.0]), -bound, bound, bound > 0, step)
        >>> step
        array([0.5, 1. ])
    """
    d = len(gradient)
    fixed = ~free
    releases = np.zeros(d, dtype=np.int64)
    step[:] = 0.0
    factor = np.empty_like(normal)
    solution = np.empty(d)
    while True:
        for i in range(d):
            solution[i] = step[i]
            if fixed[i]:
                factor[i, :i] = 0.0
                factor[i, i] = 1.0
                continue
            value = gradient[i]
            for j in range(d):
                if fixed[j]:
                    value -= (normal[i, j] if j < i else normal[j, i]) * step[j]
                    if j < i:
                        factor[i, j] = 0.0
                elif j <= i:
                    factor[i, j] = normal[i, j]
            solution[i] = value
        cholesky(factor)
        cholesky_solve(factor, solution)
        hit = False
        for i in range(d):
            if not fixed[i] and not low[i] <= solution[i] <= high[i]:
                solution[i] = min(max(solution[i], low[i]), high[i])
                fixed[i] = True
                hit = True
        step[:] = solution
        if hit:
            continue
        worst, released = 0.0, -1
        for i in range(d):
            if fixed[i] and free[i] and releases[i] < 2:
                slope = gradient[i]
                for j in range(d):
                    slope -= (normal[i, j] if j <= i else normal[j, i]) * step[j]
                inward = -slope if step[i] >= high[i] else slope
                if inward > worst and low[i] < high[i]:
                    worst, released = inward, i
        if released < 0:
            return
        fixed[released] = False
        releases[released] += 1


@njit(cache=True)
def cholesky(a: FloatArray) -> None:
    """Factor a symmetric positive definite matrix in place, lower triangle.

    Example:
        >>> a = np.array([[4.0, 0.0], [2.0, 5.0]])
        >>> cholesky(a)
        >>> a
        array([[2., 0.],
               [1., 2.]])
    """
    for i in range(len(a)):
        for j in range(i + 1):
            value = a[i, j]
            for k in range(j):
                value -= a[i, k] * a[j, k]
            a[i, j] = np.sqrt(value) if i == j else value / a[j, j]


@njit(cache=True)
def cholesky_solve(factor: FloatArray, x: FloatArray) -> None:
    """Solve L L' x = b in place.

    Example:
        >>> x = np.array([8.0])
        >>> cholesky_solve(np.array([[2.0]]), x)
        >>> x
        array([2.])
    """
    d = len(x)
    for i in range(d):
        value = x[i]
        for k in range(i):
            value -= factor[i, k] * x[k]
        x[i] = value / factor[i, i]
    for i in range(d - 1, -1, -1):
        x[i] /= factor[i, i]
        for k in range(i):
            x[k] -= factor[i, k] * x[i]


@njit(cache=True)
def inverse_diagonal(normal: FloatArray, free: BoolArray, out: FloatArray) -> None:
    """Fill the diagonal of the inverse of the free part of a matrix, given its lower triangle.

    Example:
        >>> out = np.zeros(2)
        >>> inverse_diagonal(np.diag([4.0, 2.0]), np.array([True, True]), out)
        >>> out
        array([0.25, 0.5 ])
    """
    rows = np.flatnonzero(free)
    factor = np.empty((len(rows), len(rows)))
    for i in range(len(rows)):
        for j in range(i + 1):
            factor[i, j] = normal[rows[i], rows[j]]
    cholesky(factor)
    column = np.empty(len(rows))
    for k in range(len(rows)):  # the inverse's diagonal: squared columns of L^-1
        for i in range(k, len(rows)):
            value = 1.0 if i == k else 0.0
            for j in range(k, i):
                value -= factor[i, j] * column[j]
            column[i] = value / factor[i, i]
        out[rows[k]] = 0.0
        for i in range(k, len(rows)):
            out[rows[k]] += column[i] ** 2

"""Small least squares in compiled loops, damped, by Cholesky."""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray
from .compiling import njit


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

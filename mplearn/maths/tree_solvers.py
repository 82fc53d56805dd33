"""Small symmetric systems on a tree: least squares between bounds, the diagonal of an inverse.

Two joints of a body share an entry of the normal matrix only if one carries the other. Factored
from the leaves to the root, L'L = A, such a matrix fills no entry that was zero [Featherstone2008,
6.5], so that a body of n joints on branches of d costs n d^2, not n^3.
"""

from __future__ import annotations

import numpy as np

from ..recording import BoolArray, FloatArray, IntArray
from .compiling import njit


@njit(cache=True)
def bounded_solve(
    normal: FloatArray,
    gradient: FloatArray,
    low: FloatArray,
    high: FloatArray,
    free: BoolArray,
    above: IntArray,
    step: FloatArray,
) -> None:
    """Minimise the quadratic model between bounds by an active set.

    What runs into a bound is fixed there. Once nothing does, what a bound holds against its own
    slope is released, each unknown at most twice, so that the search ends.

    Args:
        normal: Symmetric positive definite, its lower triangle, shape (d, d); zero but between an
            unknown and those above it.
        gradient: Descent direction at zero, shape (d,).
        low: Lower bounds, shape (d,).
        high: Upper bounds, shape (d,).
        free: Unknowns that may move at all, shape (d,).
        above: The next unknown above each, shape (d,), less than its own index; -1 for none. For a
            full matrix it is the one before.
        step: The solution, shape (d,), filled.

    Example:
        >>> step, bound = np.empty(2), np.array([1.0, 1.0])
        >>> above = np.array([-1, 0])
        >>> bounded_solve(np.eye(2), np.array([0.5, 3.0]), -bound, bound, bound > 0, above, step)
        >>> step
        array([0.5, 1. ])
    """
    d = len(gradient)
    fixed = ~free
    releases = np.zeros(d, dtype=np.int64)
    loose = np.empty(d, dtype=np.int64)  # the next unknown above that is not fixed
    step[:] = 0.0
    factor = np.empty_like(normal)
    solution, slope = np.empty(d), np.empty(d)
    while True:
        for i in range(d):
            j = above[i]
            loose[i] = loose[j] if j >= 0 and fixed[j] else j
        slopes(normal, gradient, step, above, slope)
        for i in range(d):
            solution[i] = 0.0 if fixed[i] else slope[i]
            if not fixed[i]:
                factor[i, i] = normal[i, i]
                j = loose[i]
                while j >= 0:
                    factor[i, j] = normal[i, j]
                    j = loose[j]
        factor_tree(factor, fixed, loose)
        solve_tree(factor, fixed, loose, solution)
        hit = False
        for i in range(d):
            solution[i] += step[i]
            if not fixed[i] and not low[i] <= solution[i] <= high[i]:
                solution[i] = min(max(solution[i], low[i]), high[i])
                fixed[i] = True
                hit = True
        step[:] = solution
        if hit:
            continue
        slopes(normal, gradient, step, above, slope)
        worst, released = 0.0, -1
        for i in range(d):
            if fixed[i] and free[i] and releases[i] < 2:
                inward = -slope[i] if step[i] >= high[i] else slope[i]
                if inward > worst and low[i] < high[i]:
                    worst, released = inward, i
        if released < 0:
            return
        fixed[released] = False
        releases[released] += 1


@njit(cache=True)
def slopes(
    normal: FloatArray, gradient: FloatArray, step: FloatArray, above: IntArray, out: FloatArray
) -> None:
    """Fill what is left of the descent direction after a step, gradient - A step, shape (d,).

    Example:
        >>> left = np.empty(2)
        >>> slopes(2 * np.eye(2), np.ones(2), np.array([0.5, 0.0]), np.array([-1, 0]), left)
        >>> left
        array([0., 1.])
    """
    for i in range(len(gradient)):
        left = gradient[i] - normal[i, i] * step[i]
        j = above[i]
        while j >= 0:
            left -= normal[i, j] * step[j]
            out[j] -= normal[i, j] * step[i]
            j = above[j]
        out[i] = left


@njit(cache=True)
def factor_tree(a: FloatArray, fixed: BoolArray, above: IntArray) -> None:
    """Factor a symmetric positive definite matrix on a tree in place, L'L = A, lower triangle.

    Args:
        a: The matrix, shape (d, d).
        fixed: Unknowns that have no part, shape (d,).
        above: The next unknown above each that has a part, shape (d,); -1 for none.

    Example:
        >>> a = np.array([[5.0, 0.0], [2.0, 4.0]])
        >>> factor_tree(a, np.array([False, False]), np.array([-1, 0]))
        >>> a
        array([[2., 0.],
               [1., 2.]])
    """
    for k in range(len(a) - 1, -1, -1):
        if fixed[k]:
            continue
        pivot = np.sqrt(a[k, k])
        a[k, k] = pivot
        i = above[k]
        while i >= 0:
            a[k, i] /= pivot
            i = above[i]
        i = above[k]
        while i >= 0:
            weight = a[k, i]
            j = i
            while j >= 0:
                a[i, j] -= weight * a[k, j]
                j = above[j]
            i = above[i]


@njit(cache=True)
def solve_tree(factor: FloatArray, fixed: BoolArray, above: IntArray, x: FloatArray) -> None:
    """Solve L'L x = b in place; arguments as in `factor_tree`.

    Example:
        >>> x = np.array([8.0])
        >>> solve_tree(np.array([[2.0]]), np.array([False]), np.array([-1]), x)
        >>> x
        array([2.])
    """
    d = len(x)
    for k in range(d - 1, -1, -1):
        if not fixed[k]:
            x[k] /= factor[k, k]
            i = above[k]
            while i >= 0:
                x[i] -= factor[k, i] * x[k]
                i = above[i]
    for k in range(d):
        if not fixed[k]:
            value = x[k]
            i = above[k]
            while i >= 0:
                value -= factor[k, i] * x[i]
                i = above[i]
            x[k] = value / factor[k, k]


@njit(cache=True)
def inverse_diagonal(normal: FloatArray, free: BoolArray, above: IntArray, out: FloatArray) -> None:
    """Fill the diagonal of the inverse of the free part of a matrix; see `bounded_solve`.

    Example:
        >>> out, free = np.zeros(2), np.array([True, True])
        >>> inverse_diagonal(np.diag([4.0, 2.0]), free, np.array([-1, 0]), out)
        >>> out
        array([0.25, 0.5 ])
    """
    d = len(normal)
    factor, fixed = normal.copy(), ~free
    loose = np.empty(d, dtype=np.int64)
    for i in range(d):
        j = above[i]
        loose[i] = loose[j] if j >= 0 and fixed[j] else j
    factor_tree(factor, fixed, loose)
    row = np.empty(d)
    for k in range(d):  # the inverse's diagonal: squared rows of L^-1
        if fixed[k]:
            continue
        i = k
        while i >= 0:
            row[i] = 0.0
            i = loose[i]
        row[k] = 1.0
        out[k] = 0.0
        i = k
        while i >= 0:
            row[i] /= factor[i, i]
            out[k] += row[i] ** 2
            j = loose[i]
            while j >= 0:
                row[j] -= row[i] * factor[i, j]
                j = loose[j]
            i = loose[i]

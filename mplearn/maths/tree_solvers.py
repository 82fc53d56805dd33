"""Small symmetric systems on a tree: least squares between bounds, the diagonal of an inverse.

Two joints of a body share an entry of the normal matrix only if one carries the other. Factored
from the leaves to the root, L'L = A, such a matrix fills no entry that was zero [Featherstone2008,
6.5], so that a body of n joints on branches of d costs n d^2, not n^3.

A row of the factor holds an unknown's entries with those above it, from the root down to its own:
what one unknown shares with another above it are then the first entries of both, side by side in
memory.
"""

from __future__ import annotations

import numpy as np

from ..recording import BoolArray, FloatArray, IntArray
from .compiling import njit

AT_BOUND = 1e-12  # what is nearer to a bound stands at it


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

    What stands at a bound, and is drawn beyond it, is fixed there from the start; what runs into
    one, from then on. Once nothing does, what a bound holds against its own slope is released, each
    unknown at most twice, so that the search ends.

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
    loose, depth = np.empty(d, dtype=np.int64), np.empty(d, dtype=np.int64)
    factor = np.empty_like(normal)
    solution, slope = np.empty(d), gradient.copy()
    held = False
    for i in range(d):
        step[i] = 0.0
        if free[i] and high[i] < AT_BOUND and gradient[i] > 0.0:
            step[i], fixed[i], held = high[i], True, True
        elif free[i] and low[i] > -AT_BOUND and gradient[i] < 0.0:
            step[i], fixed[i], held = low[i], True, True
    if held:
        slopes(normal, gradient, step, above, slope)
    while True:
        leave_out(fixed, above, loose, depth)
        for i in range(d):
            solution[i] = 0.0 if fixed[i] else slope[i]
        factor_tree(normal, fixed, loose, depth, factor)
        solve_tree(factor, fixed, loose, depth, solution)
        hit = False
        for i in range(d):
            solution[i] += step[i]
            if not fixed[i] and not low[i] <= solution[i] <= high[i]:
                solution[i] = min(max(solution[i], low[i]), high[i])
                fixed[i] = True
                hit = True
        step[:] = solution
        worst, released = 0.0, -1
        if hit or _at_bounds(fixed, free, releases):
            slopes(normal, gradient, step, above, slope)
        if hit:
            continue
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
def _at_bounds(fixed: BoolArray, free: BoolArray, releases: IntArray) -> bool:
    """Say whether a bound holds an unknown that may still be released."""
    held = False
    for i in range(len(fixed)):
        held |= fixed[i] and free[i] and releases[i] < 2
    return held


@njit(cache=True)
def leave_out(fixed: BoolArray, above: IntArray, loose: IntArray, depth: IntArray) -> None:
    """Fill, for each unknown, the next one above it that is not fixed, and how many there are.

    Args:
        fixed: Unknowns that have no part, shape (d,).
        above: The next unknown above each, shape (d,); -1 for none.
        loose: The next above each that has a part, shape (d,); -1 for none.
        depth: How many of those are above each, shape (d,).

    Example:
        >>> loose, depth = np.empty(3, int), np.empty(3, int)
        >>> leave_out(np.array([False, True, False]), np.array([-1, 0, 1]), loose, depth)
        >>> loose, depth
        (array([-1,  0,  0]), array([0, 1, 1]))
    """
    for i in range(len(above)):
        j = above[i]
        loose[i] = loose[j] if j >= 0 and fixed[j] else j
        depth[i] = 0 if loose[i] < 0 else depth[loose[i]] + 1


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
def factor_tree(
    normal: FloatArray, fixed: BoolArray, above: IntArray, depth: IntArray, factor: FloatArray
) -> None:
    """Factor a symmetric positive definite matrix on a tree, L'L = A.

    Args:
        normal: The matrix, its lower triangle, shape (d, d).
        fixed: Unknowns that have no part, shape (d,).
        above: The next unknown above each that has a part, shape (d,); -1 for none.
        depth: How many of those are above each, shape (d,); see `leave_out`.
        factor: Its rows, each from the root's entry to the unknown's own, shape (d, d), filled.

    Example:
        >>> a, factor = np.array([[5.0, 0.0], [2.0, 4.0]]), np.zeros((2, 2))
        >>> factor_tree(a, np.zeros(2, bool), np.array([-1, 0]), np.array([0, 1]), factor)
        >>> factor
        array([[2., 0.],
               [1., 2.]])
    """
    for i in range(len(normal)):
        j = -1 if fixed[i] else i
        while j >= 0:
            factor[i, depth[j]] = normal[i, j]
            j = above[j]
    for k in range(len(normal) - 1, -1, -1):
        if fixed[k]:
            continue
        row, n = factor[k], depth[k]
        pivot = np.sqrt(row[n])
        row[n] = pivot
        for j in range(n):
            row[j] /= pivot
        i = above[k]
        while i >= 0:
            other = factor[i]
            weight = row[depth[i]]
            for j in range(depth[i] + 1):
                other[j] -= weight * row[j]
            i = above[i]


@njit(cache=True)
def solve_tree(
    factor: FloatArray, fixed: BoolArray, above: IntArray, depth: IntArray, x: FloatArray
) -> None:
    """Solve L'L x = b in place; arguments as in `factor_tree`.

    Example:
        >>> x = np.array([8.0])
        >>> nothing = np.array([False])
        >>> solve_tree(np.array([[2.0]]), nothing, np.array([-1]), np.array([0]), x)
        >>> x
        array([2.])
    """
    d = len(x)
    for k in range(d - 1, -1, -1):
        if not fixed[k]:
            row = factor[k]
            x[k] /= row[depth[k]]
            i = above[k]
            while i >= 0:
                x[i] -= row[depth[i]] * x[k]
                i = above[i]
    for k in range(d):
        if not fixed[k]:
            row = factor[k]
            value = x[k]
            i = above[k]
            while i >= 0:
                value -= row[depth[i]] * x[i]
                i = above[i]
            x[k] = value / row[depth[k]]


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
    factor, fixed = np.empty_like(normal), ~free
    loose, depth = np.empty(d, dtype=np.int64), np.empty(d, dtype=np.int64)
    leave_out(fixed, above, loose, depth)
    factor_tree(normal, fixed, loose, depth, factor)
    inverse = np.zeros((d, d))  # the rows of L^-1, each from the root's entry on
    at = np.empty(d, dtype=np.int64)  # how far each row has come
    deepest = 0
    for k in range(d):
        at[k] = -1 if fixed[k] else k
        if not fixed[k]:
            out[k], inverse[k, depth[k]] = 0.0, 1.0
            deepest = max(deepest, depth[k])
    for _ in range(deepest + 1):  # all rows side by side: no entry waits for the one before it
        for k in range(d):
            i = at[k]
            if i < 0:
                continue
            n = depth[i]
            value = inverse[k, n] / factor[i, n]
            out[k] += value**2  # the diagonal is that of the squared rows
            for j in range(n):
                inverse[k, j] -= value * factor[i, j]
            at[k] = loose[i]

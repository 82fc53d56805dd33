"""One frame of inverse kinematics: a damped Gauss-Newton step, repeated, on the marker errors.

The frame's cost, over postures q between their bounds, is

    sum_m rho(|m - m(q)|) / sigma^2  +  sum_j (q_j - q_j(before))^2 / var_j  +  r_j q_j^2

with rho(r) = c^2 log(1 + r^2 / c^2) (Cauchy), so that a swapped or flying marker weighs nearly
nothing. The last term keeps joints that the markers determine badly near rest: r_j = w_j h_j /
(w_j + h_j), where h_j is what the markers say about the joint alone, so that an occluded joint is
held, not pulled to rest. It is the update step of an iterated extended Kalman filter with a
diagonal covariance: `var` is what is known about the posture before the frame, and the inverse of
the last normal matrix is what is known after.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mplearn.maths.solvers import bounded_solve, inverse_diagonal
from mplearn.recording import BoolArray, FloatArray, IntArray

from .kinematics import integrate, point_jacobian
from .linkage import Linkage, locate


@njit(cache=True)
def solve_frame(
    q: FloatArray,
    variance: FloatArray,
    markers: FloatArray,
    bodies: IntArray,
    offsets: FloatArray,
    weights: FloatArray,
    linkage: Linkage,
    low: FloatArray,
    high: FloatArray,
    free: BoolArray,
    rest_weight: FloatArray,
    outlier_m: float,
    widening: float,
    largest_step: float,
    max_iterations: int,
    tolerance: float,
    residuals: FloatArray,
) -> int:
    """Move a posture, in place, to the optimum of one frame's cost.

    Args:
        q: Posture before the frame, shape (7 + n,); holds the solution afterwards.
        variance: Of each degree of freedom before the frame, shape (6 + n,); after it afterwards.
        markers: Measured positions, shape (M, 3) [m]; NaN where missing.
        bodies: Body that carries each marker, shape (M,).
        offsets: Markers in their body's frame, shape (M, 3) [m].
        weights: 1 / sigma^2 of each marker, shape (M,) [1/m^2].
        linkage: The body's kinematics.
        low: Lower bounds of the step of each degree of freedom, shape (6 + n,).
        high: Upper bounds, shape (6 + n,).
        free: Which degrees of freedom may move, shape (6 + n,).
        rest_weight: Weight w of each joint's distance from zero, shape (n,).
        outlier_m: The scale c of the Cauchy loss [m]; infinite for least squares.
        widening: Factor on c in the first iteration, when the posture is still the last frame's.
        largest_step: Longest step of one iteration in any degree of freedom [m, rad].
        max_iterations: When to stop at the latest.
        tolerance: Stop when no degree of freedom moved further [m, rad].
        residuals: Distance of each marker from its place, shape (M,) [m], filled; NaN where
            missing.

    Returns:
        The number of iterations.
    """
    n_bodies, n = len(linkage.parent), len(linkage.axis)
    dofs = 6 + n
    pos, mat = np.empty((n_bodies, 3)), np.empty((n_bodies, 3, 3))
    axes, anchors = np.empty((n, 3)), np.empty((n, 3))
    points = np.empty_like(markers)
    jacobian = np.zeros((len(markers), 3, dofs))
    normal, gradient = np.empty((dofs, dofs)), np.empty(dofs)
    moved, step = np.zeros(dofs), np.empty(dofs)  # since the last frame; in this iteration
    iteration = 0
    while True:
        locate(q, linkage, bodies, offsets, pos, mat, axes, anchors, points)
        for m in range(len(markers)):
            residuals[m] = np.sqrt(
                (markers[m, 0] - points[m, 0]) ** 2
                + (markers[m, 1] - points[m, 1]) ** 2
                + (markers[m, 2] - points[m, 2]) ** 2
            )
        if iteration == max_iterations:
            break
        point_jacobian(
            points,
            bodies,
            pos[0],
            mat[0],
            axes,
            anchors,
            linkage.slides,
            linkage.parent,
            linkage.first,
            jacobian,
        )
        c = outlier_m * widening if iteration == 0 else outlier_m
        normal_equations(
            jacobian, markers, points, residuals, bodies, weights, c, linkage, normal, gradient
        )
        for i in range(dofs):
            if i >= 6 and normal[i, i] > 0.0:
                pull = rest_weight[i - 6] * normal[i, i] / (rest_weight[i - 6] + normal[i, i])
                normal[i, i] += pull
                gradient[i] -= pull * q[i + 1]
            normal[i, i] += 1.0 / variance[i]
            gradient[i] -= moved[i] / variance[i]
        bounded_solve(normal, gradient, low - moved, high - moved, free, step)
        longest = np.max(np.abs(step))
        if longest > largest_step:
            step *= largest_step / longest
        integrate(q, step)
        moved += step
        iteration += 1
        if longest < tolerance:
            break
    inverse_diagonal(normal, free, variance)
    return iteration


@njit(cache=True)
def normal_equations(
    jacobian: FloatArray,
    markers: FloatArray,
    points: FloatArray,
    residuals: FloatArray,
    bodies: IntArray,
    weights: FloatArray,
    c: float,
    linkage: Linkage,
    normal: FloatArray,
    gradient: FloatArray,
) -> None:
    """Fill J'WJ (lower triangle) and J'W(error); only the joints above a marker have a part."""
    normal[:] = 0.0
    gradient[:] = 0.0
    chain = np.empty(len(gradient), dtype=np.int64)
    for m in range(len(markers)):
        if np.isnan(residuals[m]) or weights[m] == 0.0:
            continue
        weight = weights[m] / (1.0 + (residuals[m] / c) ** 2)
        e0 = weight * (markers[m, 0] - points[m, 0])
        e1 = weight * (markers[m, 1] - points[m, 1])
        e2 = weight * (markers[m, 2] - points[m, 2])
        length = 0
        b = bodies[m]
        while b >= 0:
            for j in range(linkage.first[b + 1] - 1, linkage.first[b] - 1, -1):
                chain[length] = 6 + j
                length += 1
            b = linkage.parent[b]
        for k in range(5, -1, -1):
            chain[length] = k
            length += 1
        for a in range(length):
            i = chain[a]
            x, y, z = jacobian[m, 0, i], jacobian[m, 1, i], jacobian[m, 2, i]
            gradient[i] += x * e0 + y * e1 + z * e2
            x, y, z = weight * x, weight * y, weight * z
            for d in range(a, length):
                j = chain[d]
                normal[i, j] += (
                    x * jacobian[m, 0, j] + y * jacobian[m, 1, j] + z * jacobian[m, 2, j]
                )

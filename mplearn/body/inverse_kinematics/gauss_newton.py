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

from mplearn.maths.tree_solvers import bounded_solve, inverse_diagonal
from mplearn.recording import BoolArray, FloatArray, IntArray

from ..kinematics.kernels import integrate
from ..kinematics.linkage import Linkage, locate


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
    moments, motions = np.empty((n_bodies, 16)), np.empty((dofs, 6))
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
        c = outlier_m * widening if iteration == 0 else outlier_m
        normal_equations(
            q,
            markers,
            points,
            residuals,
            bodies,
            weights,
            c,
            linkage,
            mat,
            axes,
            anchors,
            moments,
            motions,
            normal,
            gradient,
        )
        for i in range(dofs):
            if i >= 6 and normal[i, i] > 0.0:
                pull = rest_weight[i - 6] * normal[i, i] / (rest_weight[i - 6] + normal[i, i])
                normal[i, i] += pull
                gradient[i] -= pull * q[i + 1]
            normal[i, i] += 1.0 / variance[i]
            gradient[i] -= moved[i] / variance[i]
        bounded_solve(normal, gradient, low - moved, high - moved, free, linkage.above, step)
        longest = np.max(np.abs(step))
        if longest > largest_step:
            step *= largest_step / longest
        integrate(q, step)
        moved += step
        iteration += 1
        if longest < tolerance:
            break
    inverse_diagonal(normal, free, linkage.above, variance)
    return iteration


@njit(cache=True)
def normal_equations(
    q: FloatArray,
    markers: FloatArray,
    points: FloatArray,
    residuals: FloatArray,
    bodies: IntArray,
    weights: FloatArray,
    c: float,
    linkage: Linkage,
    mat: FloatArray,
    axes: FloatArray,
    anchors: FloatArray,
    moments: FloatArray,
    motions: FloatArray,
    normal: FloatArray,
    gradient: FloatArray,
) -> None:
    """Fill J'WJ, where one unknown is above the other (lower triangle), and J'W(error).

    No Jacobian is formed: a marker at p moves by v + w x p with an unknown, so that all markers
    that it carries come in by their weight, its first and second moments, and the sums of the
    weighted errors and their moments. These are added up from the leaves to the base, as composite
    rigid bodies are [Featherstone2008, 6.2].
    """
    parent, above = linkage.parent, linkage.above
    moments[:] = 0.0
    x0, y0, z0 = q[0], q[1], q[2]
    for m in range(len(markers)):
        if np.isnan(residuals[m]) or weights[m] == 0.0:
            continue
        w = weights[m] / (1.0 + (residuals[m] / c) ** 2)
        x, y, z = points[m, 0] - x0, points[m, 1] - y0, points[m, 2] - z0
        ex = w * (markers[m, 0] - points[m, 0])
        ey = w * (markers[m, 1] - points[m, 1])
        ez = w * (markers[m, 2] - points[m, 2])
        s = moments[bodies[m]]
        s[0] += w
        s[1] += w * x
        s[2] += w * y
        s[3] += w * z
        s[4] += w * (y * y + z * z)
        s[5] += w * (x * x + z * z)
        s[6] += w * (x * x + y * y)
        s[7] -= w * x * y
        s[8] -= w * x * z
        s[9] -= w * y * z
        s[10] += ex
        s[11] += ey
        s[12] += ez
        s[13] += y * ez - z * ey
        s[14] += z * ex - x * ez
        s[15] += x * ey - y * ex
    for b in range(len(parent) - 1, 0, -1):
        for k in range(16):
            moments[parent[b], k] += moments[b, k]
    # each unknown's motion: (wx, wy, wz, vx, vy, vz), v that of the point at the base's place
    motions[:6] = 0.0
    for k in range(3):
        motions[k, 3 + k] = 1.0
        for i in range(3):
            motions[3 + k, i] = mat[0, i, k]
    for j in range(len(axes)):
        ax, ay, az = axes[j, 0], axes[j, 1], axes[j, 2]
        t = motions[6 + j]
        if linkage.slides[j]:
            t[0], t[1], t[2], t[3], t[4], t[5] = 0.0, 0.0, 0.0, ax, ay, az
            continue
        x, y, z = anchors[j, 0] - x0, anchors[j, 1] - y0, anchors[j, 2] - z0
        t[0], t[1], t[2] = ax, ay, az
        t[3], t[4], t[5] = y * az - z * ay, z * ax - x * az, x * ay - y * ax
    for j in range(len(axes)):
        b = linkage.joint_body[j]
        _row(6 + j, motions[6 + j], moments[b], motions, above, normal, gradient)
    for k in range(6):
        _row(k, motions[k], moments[0], motions, above, normal, gradient)


@njit(cache=True)
def _row(
    k: int,
    t: FloatArray,
    s: FloatArray,
    motions: FloatArray,
    above: IntArray,
    normal: FloatArray,
    gradient: FloatArray,
) -> None:
    """Fill a row of the normal equations from an unknown's motion and the moments it carries."""
    wx, wy, wz, vx, vy, vz = t[0], t[1], t[2], t[3], t[4], t[5]
    fx = s[0] * vx + wy * s[3] - wz * s[2]
    fy = s[0] * vy + wz * s[1] - wx * s[3]
    fz = s[0] * vz + wx * s[2] - wy * s[1]
    nx = s[2] * vz - s[3] * vy + s[4] * wx + s[7] * wy + s[8] * wz
    ny = s[3] * vx - s[1] * vz + s[7] * wx + s[5] * wy + s[9] * wz
    nz = s[1] * vy - s[2] * vx + s[8] * wx + s[9] * wy + s[6] * wz
    i = k
    while i >= 0:
        r = motions[i]
        normal[k, i] = r[0] * nx + r[1] * ny + r[2] * nz + r[3] * fx + r[4] * fy + r[5] * fz
        i = above[i]
    gradient[k] = wx * s[13] + wy * s[14] + wz * s[15] + vx * s[10] + vy * s[11] + vz * s[12]

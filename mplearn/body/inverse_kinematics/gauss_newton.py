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

from typing import NamedTuple

import numpy as np

from mplearn.maths.tree_solvers import bounded_solve, inverse_diagonal
from mplearn.recording import BoolArray, FloatArray, IntArray

from ...maths.compiling import njit
from ..kinematics.kernels import integrate, locate
from ..kinematics.linkage import Configuration, Linkage, empty_configuration


class Markers(NamedTuple):
    """Where M markers sit on a body, and how exactly they are measured.

    Attributes:
        bodies: Body that carries each marker, shape (M,).
        offsets: Markers in their body's frame, shape (M, 3) [m].
        weights: 1 / sigma^2 of each marker, shape (M,) [1/m^2].
    """

    bodies: IntArray
    offsets: FloatArray
    weights: FloatArray


class Seen(NamedTuple):
    """What was seen of M markers in a frame.

    Attributes:
        measured: Their positions, shape (M, 3) [m]; NaN where missing.
        expected: Where the body has them, shape (M, 3) [m].
        residuals: Distances between both, shape (M,) [m]; NaN where missing.
    """

    measured: FloatArray
    expected: FloatArray
    residuals: FloatArray


class Moves(NamedTuple):
    """What the degrees of freedom may do in a frame.

    Attributes:
        low: Lower bounds of the step of each, shape (6 + n,).
        high: Upper bounds, shape (6 + n,).
        free: Which of them may move, shape (6 + n,).
        rest_weight: Weight w of each joint's distance from zero, shape (n,).
    """

    low: FloatArray
    high: FloatArray
    free: BoolArray
    rest_weight: FloatArray


class Search(NamedTuple):
    """How the optimum is searched for.

    Attributes:
        outlier_m: The scale c of the Cauchy loss [m]; infinite for least squares.
        max_iterations: When to stop at the latest.
        tolerance: Stop when no degree of freedom moved further [m, rad].
        widening: Factor on c in the first iteration, when the posture is still the last frame's.
        largest_step: Longest step of one iteration in any degree of freedom [m, rad].
        noise_m: Where half of the markers move against others on their body by more than this [m],
        rough_tolerance: the search stops when no degree of freedom moved further than this.
    """

    outlier_m: float
    max_iterations: int
    tolerance: float
    widening: float = 1.0
    largest_step: float = 0.5
    noise_m: float = np.inf
    rough_tolerance: float = 0.0


# the sums over the markers that a body carries, each weighted, about the base's place
WEIGHT, X, Y, Z = range(4)  # weights and first moments
XX, YY, ZZ, XY, XZ, YZ = range(4, 10)  # second moments, as of inertia
FX, FY, FZ, NX, NY, NZ = range(10, 16)  # errors and their moments
N_SUMS = 16


class Equations(NamedTuple):
    """Memory of the normal equations.

    Attributes:
        carried: Sums over the markers of each body with all that it carries, by the names above,
            shape (B, 16).
        motions: Each unknown's motion, (wx, wy, wz, vx, vy, vz), v that of the point at the base's
            place, shape (6 + n, 6).
        normal: J'WJ where one unknown is above the other (lower triangle), shape (6 + n, 6 + n).
        gradient: J'W(error), shape (6 + n,).
    """

    carried: FloatArray
    motions: FloatArray
    normal: FloatArray
    gradient: FloatArray


@njit(cache=True)
def empty_equations(linkage: Linkage) -> Equations:
    """Return memory for `normal_equations` to fill."""
    dofs = len(linkage.above)
    return Equations(
        np.empty((len(linkage.parent), N_SUMS)),
        np.empty((dofs, 6)),
        np.empty((dofs, dofs)),
        np.empty(dofs),
    )


@njit(cache=True)
def solve_frame(
    q: FloatArray,
    variance: FloatArray,
    frame: FloatArray,
    markers: Markers,
    linkage: Linkage,
    moves: Moves,
    search: Search,
    residuals: FloatArray,
) -> int:
    """Move a posture, in place, to the optimum of one frame's cost.

    Args:
        q: Posture before the frame, shape (7 + n,); holds the solution afterwards.
        variance: Of each degree of freedom before the frame, shape (6 + n,); after it afterwards.
        frame: Measured positions, shape (M, 3) [m]; NaN where missing.
        markers: Where they sit on the body.
        linkage: The body's kinematics.
        moves: What its degrees of freedom may do.
        search: How the optimum is searched for.
        residuals: Distance of each marker from its place, shape (M,) [m], filled; NaN where
            missing.

    Returns:
        The number of iterations.
    """
    dofs = len(variance)
    configuration, equations = empty_configuration(linkage), empty_equations(linkage)
    normal, gradient = equations.normal, equations.gradient
    rest_weight = moves.rest_weight
    points = np.empty_like(frame)
    seen = Seen(frame, points, residuals)
    moved, step = np.zeros(dofs), np.empty(dofs)  # since the last frame; in this iteration
    iteration = 0
    while True:
        locate(q, linkage, markers.bodies, markers.offsets, configuration, points)
        for m in range(len(frame)):
            residuals[m] = np.sqrt(
                (frame[m, 0] - points[m, 0]) ** 2
                + (frame[m, 1] - points[m, 1]) ** 2
                + (frame[m, 2] - points[m, 2]) ** 2
            )
        if iteration == search.max_iterations:
            break
        c = search.outlier_m * search.widening if iteration == 0 else search.outlier_m
        normal_equations(q, seen, markers, c, linkage, configuration, equations)
        for i in range(dofs):
            if i >= 6 and normal[i, i] > 0.0:
                pull = rest_weight[i - 6] * normal[i, i] / (rest_weight[i - 6] + normal[i, i])
                normal[i, i] += pull
                gradient[i] -= pull * q[i + 1]
            normal[i, i] += 1.0 / variance[i]
            gradient[i] -= moved[i] / variance[i]
        low, high = moves.low - moved, moves.high - moved
        bounded_solve(normal, gradient, low, high, moves.free, linkage.above, step)
        longest = np.max(np.abs(step))
        if longest > search.largest_step:
            step *= search.largest_step / longest
        integrate(q, step)
        moved += step
        iteration += 1
        if longest < search.tolerance:
            break
        near = iteration > 1 and longest < search.rough_tolerance
        if near and rough(seen, markers.bodies, len(linkage.parent), search.noise_m):
            break
    inverse_diagonal(normal, moves.free, linkage.above, variance)
    return iteration


@njit(cache=True)
def rough(seen: Seen, bodies: IntArray, n_bodies: int, noise_m: float) -> bool:
    """Say whether noise moves most markers against the others on their body by more than this.

    What is the same for all markers of a body is no noise: the body does not fit there.
    """
    frame, points, residuals = seen
    sums = np.zeros((n_bodies, 4))  # how many markers it carries, and their errors
    for m in range(len(frame)):
        if residuals[m] == residuals[m]:
            sums[bodies[m], 0] += 1.0
            for k in range(3):
                sums[bodies[m], 1 + k] += frame[m, k] - points[m, k]
    apart, known = 0, 0
    for m in range(len(frame)):
        on = sums[bodies[m]]
        if residuals[m] == residuals[m] and on[0] > 2.0:
            squared = 0.0
            for k in range(3):
                squared += (frame[m, k] - points[m, k] - on[1 + k] / on[0]) ** 2
            known += 1
            apart += squared > noise_m**2 * (1.0 - 1.0 / on[0])
    return 2 * apart > known


@njit(cache=True)
def normal_equations(
    q: FloatArray,
    seen: Seen,
    markers: Markers,
    c: float,
    linkage: Linkage,
    configuration: Configuration,
    equations: Equations,
) -> None:
    """Fill the equations, of markers at points that were measured in a frame.

    No Jacobian is formed: a marker at p moves by v + w x p with an unknown, so that all markers
    that it carries come in by their weight, its first and second moments, and the sums of the
    weighted errors and their moments. These are added up from the leaves to the base, as composite
    rigid bodies are [Featherstone2008, 6.2].

    Args:
        q: Posture, shape (7 + n,).
        seen: Where the markers were measured, and where the body has them.
        markers: Where they sit on the body.
        c: Scale of the Cauchy loss [m].
        linkage: The body's kinematics.
        configuration: Where it is.
        equations: Filled.
    """
    frame, points, residuals = seen
    carried, motions, normal, gradient = equations
    parent, above = linkage.parent, linkage.above
    axes, anchors = configuration.axis, configuration.anchor
    bodies, weights = markers.bodies, markers.weights
    joint_body, slides = linkage.joint_body, linkage.slides
    carried[:] = 0.0
    x0, y0, z0 = q[0], q[1], q[2]
    for m in range(len(frame)):
        if np.isnan(residuals[m]) or weights[m] == 0.0:
            continue
        w = weights[m] / (1.0 + (residuals[m] / c) ** 2)
        x, y, z = points[m, 0] - x0, points[m, 1] - y0, points[m, 2] - z0
        ex = w * (frame[m, 0] - points[m, 0])
        ey = w * (frame[m, 1] - points[m, 1])
        ez = w * (frame[m, 2] - points[m, 2])
        s = carried[bodies[m]]
        s[WEIGHT] += w
        s[X] += w * x
        s[Y] += w * y
        s[Z] += w * z
        s[XX] += w * (y * y + z * z)
        s[YY] += w * (x * x + z * z)
        s[ZZ] += w * (x * x + y * y)
        s[XY] -= w * x * y
        s[XZ] -= w * x * z
        s[YZ] -= w * y * z
        s[FX] += ex
        s[FY] += ey
        s[FZ] += ez
        s[NX] += y * ez - z * ey
        s[NY] += z * ex - x * ez
        s[NZ] += x * ey - y * ex
    for b in range(len(carried) - 1, 0, -1):
        for k in range(N_SUMS):
            carried[parent[b], k] += carried[b, k]
    motions[:6] = 0.0
    for k in range(3):
        motions[k, 3 + k] = 1.0
        for i in range(3):
            motions[3 + k, i] = configuration.rotation[0, i, k]
    for j in range(len(axes)):
        ax, ay, az = axes[j, 0], axes[j, 1], axes[j, 2]
        t = motions[6 + j]
        if slides[j]:
            t[0], t[1], t[2], t[3], t[4], t[5] = 0.0, 0.0, 0.0, ax, ay, az
            continue
        x, y, z = anchors[j, 0] - x0, anchors[j, 1] - y0, anchors[j, 2] - z0
        t[0], t[1], t[2] = ax, ay, az
        t[3], t[4], t[5] = y * az - z * ay, z * ax - x * az, x * ay - y * ax
    for j in range(len(axes)):
        _row(6 + j, carried[joint_body[j]], motions, above, normal, gradient)
    for k in range(6):
        _row(k, carried[0], motions, above, normal, gradient)


@njit(cache=True, inline="always")
def _row(
    k: int,
    s: FloatArray,
    motions: FloatArray,
    above: IntArray,
    normal: FloatArray,
    gradient: FloatArray,
) -> None:
    """Fill a row of the equations from an unknown's motion and the sums that it carries."""
    t = motions[k]
    wx, wy, wz, vx, vy, vz = t[0], t[1], t[2], t[3], t[4], t[5]
    fx = s[WEIGHT] * vx + wy * s[Z] - wz * s[Y]
    fy = s[WEIGHT] * vy + wz * s[X] - wx * s[Z]
    fz = s[WEIGHT] * vz + wx * s[Y] - wy * s[X]
    nx = s[Y] * vz - s[Z] * vy + s[XX] * wx + s[XY] * wy + s[XZ] * wz
    ny = s[Z] * vx - s[X] * vz + s[XY] * wx + s[YY] * wy + s[YZ] * wz
    nz = s[X] * vy - s[Y] * vx + s[XZ] * wx + s[YZ] * wy + s[ZZ] * wz
    i = k
    while i >= 0:
        r = motions[i]
        normal[k, i] = r[0] * nx + r[1] * ny + r[2] * nz + r[3] * fx + r[4] * fy + r[5] * fz
        i = above[i]
    gradient[k] = wx * s[NX] + wy * s[NY] + wz * s[NZ] + vx * s[FX] + vy * s[FY] + vz * s[FZ]

"""Support polygon, zero-moment point, and how far a point is from tipping the robot over."""

from __future__ import annotations

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.maths.compiling import inlined, njit
from mplearn.recording import FloatArray, IntArray

GRAVITY = 9.81
_SLANT = 0.5 * (np.sqrt(5.0) - 1.0)


def convex_hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull, counter-clockwise, shape (H, 2) (Andrew's chain).

    Args:
        points: Points in the plane, shape (N, 2) [m].

    Raises:
        InvalidValueError: There are fewer than three points that span a polygon.
    """
    hull = _chain(np.ascontiguousarray(points, dtype=np.float64))
    if len(hull) < 3:
        raise InvalidValueError(f"{len(points)} points on a line or in one place span no polygon")
    return hull


@njit(cache=True)
def _chain(points: FloatArray) -> FloatArray:
    """Andrew's monotone chain: sort along a line, then make the lower and the upper half.

    The line is aslant, for of two soles side by side four corners share their x but for rounding.
    """
    order = np.argsort(points[:, 0] + _SLANT * points[:, 1])
    n = points.shape[0]
    hull = np.empty((2 * n + 2, 2))
    size = 0
    for half in range(2):
        first = size
        for k in range(n):
            point = points[order[k if half == 0 else n - 1 - k]]
            while size - first > 1 and not _left_turn(hull[size - 2], hull[size - 1], point):
                size -= 1
            hull[size] = point
            size += 1
        size -= 1  # the last point starts the other half
    return hull[:size].copy()


@njit(cache=True, nogil=True)
def hull_of(points: FloatArray) -> FloatArray:
    """Return `convex_hull` for compiled code, which must give points that span a polygon."""
    return _chain(points)


@njit(cache=True, nogil=True)
def hull_margin(hull: FloatArray, x: float, y: float) -> float:
    """Return `support_margin` of one point, for compiled code [m]."""
    point = np.empty((1, 2))
    point[0, 0], point[0, 1] = x, y
    return float(_margins(hull, point)[0])


@inlined
def _left_turn(a: FloatArray, b: FloatArray, c: FloatArray) -> bool:
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return bool(area > 1e-12)


def support_margin(hull: FloatArray, point: FloatArray) -> FloatArray:
    """Return the distance to the nearest edge of a convex polygon, negative outside.

    Args:
        hull: Corners, counter-clockwise, shape (H, 2) [m].
        point: One or many points, shape (..., 2) [m].

    Returns:
        Margins, shape (...) [m]. Outside, it is the distance to the most violated edge's line,
        which at most equals the distance to the polygon.
    """
    points = np.ascontiguousarray(point, dtype=np.float64)
    return _margins(hull, points.reshape(-1, 2)).reshape(points.shape[:-1])


@njit(cache=True)
def _margins(hull: FloatArray, points: FloatArray) -> FloatArray:
    out = np.full(points.shape[0], np.inf)
    for i in range(hull.shape[0]):
        ax, ay = hull[i - 1, 0], hull[i - 1, 1]
        ex, ey = hull[i, 0] - ax, hull[i, 1] - ay
        length = np.sqrt(ex * ex + ey * ey)
        for k in range(points.shape[0]):
            inside = (ex * (points[k, 1] - ay) - ey * (points[k, 0] - ax)) / length
            # NaN must not pass for a point inside
            if not inside >= out[k]:
                out[k] = inside
    return out


@njit(cache=True)
def margins_along(corners: FloatArray, up: IntArray, points: FloatArray) -> FloatArray:
    """Return how far points are inside the soles that stand, one moment after the other.

    Args:
        corners: Corners of both soles, shape (S, 2, 4, 2) [m].
        up: Side of the foot in the air, -1 for none, shape (S,).
        points: Points, shape (S, 2) [m].

    Returns:
        Distances to the nearest edge, negative outside (see `support_margin`), shape (S,) [m].
    """
    out = np.empty(points.shape[0])
    for t in range(points.shape[0]):
        if up[t] < 0:
            standing = np.concatenate((corners[t, 0], corners[t, 1]))
        else:
            standing = corners[t, 1 - up[t]].copy()
        out[t] = _margins(_chain(standing), points[t : t + 1])[0]
    return out


def zero_moment_point(force: FloatArray, moment: FloatArray, origin: FloatArray) -> FloatArray:
    """Return where on the floor the ground's reaction has no horizontal moment.

    Args:
        force: Force of the ground on the robot, shape (..., 3) [N].
        moment: Its moment about ``origin``, shape (..., 3) [N m].
        origin: Any point, shape (..., 3) [m].

    Returns:
        Points, shape (..., 2) [m]; NaN where the ground does not carry.
    """
    x, y, z = np.moveaxis(np.asarray(origin), -1, 0)
    lift = np.where(force[..., 2] > 1.0, force[..., 2], np.nan)
    return np.stack(
        (
            x - (moment[..., 1] + z * force[..., 0]) / lift,
            y + (moment[..., 0] - z * force[..., 1]) / lift,
        ),
        axis=-1,
    )


def pendulum_zmp(cog: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Return the zero-moment point of a mass concentrated in the COG (the inverted pendulum).

    Args:
        cog: COG, shape (..., 3) [m].
        acceleration: Its acceleration, shape (..., 3) [m/s^2].
    """
    lift = acceleration[..., 2:] + GRAVITY
    return np.asarray(cog[..., :2] - cog[..., 2:] * acceleration[..., :2] / lift)

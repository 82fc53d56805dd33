"""Support polygon, zero-moment point, and how far a point is from tipping the robot over."""

from __future__ import annotations

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray

GRAVITY = 9.81


def convex_hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull, counter-clockwise, shape (H, 2) (Andrew's chain).

    Args:
        points: Points in the plane, shape (N, 2) [m].

    Raises:
        InvalidValueError: There are fewer than three points that span a polygon.
    """
    ordered = np.unique(np.round(points, 9), axis=0).tolist()  # by x, then y
    halves = []
    for sequence in (ordered, ordered[::-1]):
        chain: list[list[float]] = []
        for x, y in sequence:
            while len(chain) > 1 and _turns_right(chain[-2], chain[-1], x, y):
                chain.pop()
            chain.append([x, y])
        halves.append(chain[:-1])
    hull = np.array(halves[0] + halves[1])
    if len(hull) < 3:
        raise InvalidValueError(f"{len(points)} points on a line or in one place span no polygon")
    return hull


def _turns_right(a: list[float], b: list[float], x: float, y: float) -> bool:
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) <= 0


def support_margin(hull: FloatArray, point: FloatArray) -> FloatArray:
    """Return the distance to the nearest edge of a convex polygon, negative outside.

    Args:
        hull: Corners, counter-clockwise, shape (H, 2) [m].
        point: One or many points, shape (..., 2) [m].

    Returns:
        Margins, shape (...) [m]. Outside, it is the distance to the most violated edge's line, which
        at most equals the distance to the polygon.
    """
    edge = np.roll(hull, -1, axis=0) - hull
    inward = np.stack((-edge[:, 1], edge[:, 0]), axis=1)
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    distance = np.asarray(point) @ inward.T - np.sum(hull * inward, axis=1)  # (..., H)
    return np.asarray(distance.min(axis=-1))


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

"""Where to step so that who was pushed can come to rest: the capture point.

Who steps to the divergent component of motion (DCM) can come to rest there [Pratt2006]. Until the
foot lands the DCM runs away from the foot that stands, so which foot, where and when are chosen
together ([Khadiv2016] adapts time as well as place), as far as a leg reaches.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import kernel
from mplearn.maths.plane import turn_in_plane
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.support import hull_margin, hull_of

LONGEST_S = 0.5  # of a step that catches
_TRY_S = 0.02
_INSET_M = 0.008  # the zero-moment point stays so far inside a sole
_BEYOND_M = 0.015  # the foot lands a little beyond the DCM
_LAG_S = 0.05  # in which a foot gathers speed
# What a step costs: the DCM outside the soles [1/m], hurry, length [1/m], time [1/s].
_PRICES = (20.0, 2.0, 0.5, 0.3)


class Reach(NamedTuple):
    """Where a foot can land, as the other one sees it, and how soon.

    Attributes:
        ahead: Farthest ahead [m].
        behind: Farthest back [m].
        narrow: Least distance aside [m]: legs do not cross.
        wide: Largest distance aside [m].
        fastest: Mean speed of a foot on its way [m/s].
        soonest: Shortest time of a step [s].
    """

    ahead: float
    behind: float
    narrow: float
    wide: float
    fastest: float
    soonest: float


class Step(NamedTuple):
    """A step to take.

    Attributes:
        side: Which foot, 0 left, 1 right.
        time_s: How long it takes [s].
        place: Where it lands: x, y [m] and yaw [rad], shape (3,).
        missing_m: How far the DCM will be outside the soles then [m].
    """

    side: int
    time_s: float
    place: FloatArray
    missing_m: float


@kernel
def outline(corners: FloatArray, place: FloatArray, inset: float) -> FloatArray:
    """Return the corners of a sole that stands somewhere, its edges moved inwards, (4, 2) [m].

    Args:
        corners: Its corners in the foot's frame, shape (4, 3) [m].
        place: x, y [m] and yaw [rad], shape (3,).
        inset: How far each edge is moved [m].
    """
    out = np.empty((4, 2))
    middle_x, middle_y = corners[:, 0].mean(), corners[:, 1].mean()
    for k in range(4):
        x = corners[k, 0] + (inset if corners[k, 0] < middle_x else -inset)
        y = corners[k, 1] + (inset if corners[k, 1] < middle_y else -inset)
        x, y = turn_in_plane(x, y, place[2])
        out[k, 0], out[k, 1] = place[0] + x, place[1] + y
    return out


@kernel
def support_hull(corners: FloatArray, feet: FloatArray, up: int, inset: float) -> FloatArray:
    """Return the support polygon of soles with their edges moved inwards, shape (H, 2) [m].

    Args:
        corners: Of both soles in their feet's frames, shape (2, 4, 3) [m].
        feet: Where they are: x, y [m] and yaw [rad], shape (2, 3).
        up: Side of the foot in the air, -1 for none.
        inset: How far each edge is moved [m].
    """
    if up >= 0:
        return hull_of(outline(corners[1 - up], feet[1 - up], inset))
    left, right = outline(corners[0], feet[0], inset), outline(corners[1], feet[1], inset)
    return hull_of(np.concatenate((left, right)))


@kernel
def nearest_inside(hull: FloatArray, x: float, y: float) -> tuple[float, float]:
    """Return the point of a convex polygon (H, 2), counter-clockwise, nearest to another."""
    if hull_margin(hull, x, y) >= 0.0:
        return x, y
    best, found_x, found_y = np.inf, x, y
    for i in range(hull.shape[0]):
        ax, ay = hull[i - 1]
        ex, ey = hull[i, 0] - ax, hull[i, 1] - ay
        along = ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)
        along = min(max(along, 0.0), 1.0)
        px, py = ax + along * ex, ay + along * ey
        far = (px - x) ** 2 + (py - y) ** 2
        if far < best:
            best, found_x, found_y = far, px, py
    return found_x, found_y


@kernel
def landing_place(
    corners: FloatArray,
    stands: FloatArray,
    side: int,
    dcm: FloatArray,
    rate: float,
    time_s: float,
    reach: Reach,
) -> tuple[FloatArray, float]:
    """Return where a foot shall land, and how far the DCM will be outside the soles then [m].

    Meanwhile the zero-moment point is where in the standing sole it brakes most.

    Args:
        corners: Of both soles in their feet's frames, shape (2, 4, 3) [m].
        stands: Where the other foot stands, shape (3,).
        side: Which foot lands.
        dcm: The DCM now, shape (2,) [m].
        rate: Of the pendulum [1/s].
        time_s: Until it lands [s].
        reach: Where it can.
    """
    sole = outline(corners[1 - side], stands, _INSET_M)
    zmp_x, zmp_y = nearest_inside(hull_of(sole), dcm[0], dcm[1])
    growth = np.exp(rate * time_s)
    then_x, then_y = zmp_x + (dcm[0] - zmp_x) * growth, zmp_y + (dcm[1] - zmp_y) * growth
    away = 1.0 if side == 0 else -1.0
    x, y = turn_in_plane(then_x - stands[0], then_y - stands[1], -stands[2])
    farther = 1.0 + _BEYOND_M / (np.hypot(x, y) + 1e-9)
    x = min(max(farther * x - corners[side, :, 0].mean(), -reach.behind), reach.ahead)
    y = min(max(away * farther * y, reach.narrow), reach.wide)
    dx, dy = turn_in_plane(x, away * y, stands[2])
    place = np.array([stands[0] + dx, stands[1] + dy, stands[2]])
    both = hull_of(np.concatenate((sole, outline(corners[side], place, _INSET_M))))
    return place, max(0.0, -hull_margin(both, then_x, then_y))


@kernel
def choose_step(
    corners: FloatArray, feet: FloatArray, dcm: FloatArray, rate: float, reach: Reach, only: int
) -> Step:
    """Return the step that catches the DCM best: inside the soles, without hurry, near and soon.

    Args:
        corners: Of both soles in their feet's frames, shape (2, 4, 3) [m].
        feet: Where they are: x, y [m] and yaw [rad], shape (2, 3).
        dcm: The DCM now, shape (2,) [m].
        rate: Of the pendulum [1/s].
        reach: Where a foot can land, and how soon.
        only: The one foot that can step; -1 for either.
    """
    best = np.inf
    found = Step(max(only, 0), LONGEST_S, feet[max(only, 0)].copy(), np.inf)
    for side in range(2):
        if only == 1 - side:
            continue
        for k in range(int((LONGEST_S - reach.soonest) / _TRY_S) + 1):
            time_s = reach.soonest + k * _TRY_S
            place, missing = landing_place(corners, feet[1 - side], side, dcm, rate, time_s, reach)
            far = np.hypot(place[0] - feet[side, 0], place[1] - feet[side, 1])
            hurry = max(0.0, far / (time_s - _LAG_S) / reach.fastest - 1.0)
            price = _PRICES[0] * missing + _PRICES[1] * hurry
            price += _PRICES[2] * far + _PRICES[3] * time_s
            if price < best:
                best = price
                found = Step(side, time_s, place, missing)
    return found

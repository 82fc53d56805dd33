"""Where to step so that who was pushed can come to rest: the capture point.

Who steps to the divergent component of motion (DCM) can come to rest there [Pratt2006]. Until the
foot lands the DCM runs away from the foot that stands, so which foot, where and when are chosen
together ([Khadiv2016] adapts time as well as place), as far as a leg reaches.
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np

from mplearn.maths.compiling import inner_kernel, kernel
from mplearn.maths.plane import turn_in_plane
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.support import hull_margin, hull_of

BESIDE, IN_FRONT, BEHIND, DOWN = (cast("int", np.int64(way)) for way in range(4))
LONGEST_S = 0.5  # of a step that catches
_SOONEST_S = 0.1  # in which a foot in the air lands
_LANDS_S = 0.04  # in which one does that comes down at once
_SLACK_M = 0.02  # so near past the other foot is past it, too
_TRY_S = 0.02
_TRY_NEXT_S = 0.04
_LIFTS_S = 0.02  # from where a foot has landed to where the other one is lifted
_INSET_M = 0.008  # the zero-moment point stays so far inside a sole
_BEYOND_M = 0.015  # the foot lands a little beyond the DCM
_LAG_S = 0.05  # in which a foot gathers speed
# What a step costs: the DCM outside the soles [1/m], hurry, length [1/m], time [1/s].
_PRICES = (20.0, 2.0, 0.5, 0.3)


class Falling(NamedTuple):
    """How a robot stands that will fall unless it steps.

    Attributes:
        corners: Of both soles in their feet's frames, shape (2, 4, 3) [m].
        feet: Where they are: x, y [m] and yaw [rad], shape (2, 3).
        dcm: The DCM, shape (2,) [m].
        rate: Of the pendulum [1/s].
    """

    corners: FloatArray
    feet: FloatArray
    dcm: FloatArray
    rate: float


class OnItsWay(NamedTuple):
    """How the foot moves that steps.

    Attributes:
        since_s: For how long it has been on its way [s].
        crosses: Whether it was in the air: it may cross the other one, or come down at once.
        high_m: How high it is [m].
        sinks: How fast it comes down [m/s].
    """

    since_s: float
    crosses: bool
    high_m: float
    sinks: float


class Reach(NamedTuple):
    """Where a foot can land, as the other one sees it, and how soon.

    Attributes:
        ahead: Farthest ahead [m].
        behind: Farthest back [m].
        narrow: Least distance aside [m]: legs do not cross.
        wide: Largest distance aside [m].
        fastest: Mean speed of a foot on its way [m/s].
        soonest: Shortest time of a step [s].
        clear: How far ahead or back a foot is past the other one [m].
        apart: How far aside it is past it [m].
        across: How far beyond the other one a foot can land that crosses it there [m]; at 0 none
            does.
        inwards: How far on its own side of the DCM a foot lands that crosses [m]: what is left
            drives the robot to the side of the other one, which is free to step.
        down_s: Shortest time in which a foot that is in the air comes down, for the other one to
            step.
        close: How far aside of that it is then [m]; at 0 none comes down so.
        gently: Largest acceleration with which it ends its way down [m/s^2]: one that hits the
            floor throws the robot up, and no foot stands.
        inside: How far inside the soles the DCM shall be when it lands [m].
    """

    ahead: float
    behind: float
    narrow: float
    wide: float
    fastest: float
    soonest: float
    clear: float = 0.26
    apart: float = 0.13
    across: float = 0.0
    inwards: float = 0.0
    down_s: float = 0.1
    close: float = 0.0
    gently: float = np.inf
    inside: float = 0.0


class Step(NamedTuple):
    """A step to take.

    Attributes:
        side: Which foot, 0 left, 1 right.
        time_s: How long it takes [s].
        place: Where it lands: x, y [m] and yaw [rad], shape (3,).
        missing_m: How far the DCM will be outside the soles then, or nearer to their edge than it
            shall be [m].
        way: `BESIDE`; on which way it crosses the other foot's: `IN_FRONT`, `BEHIND`; or `DOWN`:
            at once, for the other foot to step.
    """

    side: int
    time_s: float
    place: FloatArray
    missing_m: float
    way: int


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
    falling: Falling, side: int, time_s: float, reach: Reach, way: int
) -> tuple[FloatArray, float]:
    """Return where a foot shall land, and how far the DCM will be outside the soles then [m].

    Or nearer to their edge than it shall be. Meanwhile the zero-moment point is where in the
    standing sole it brakes most.

    Args:
        falling: How the robot stands.
        side: Which foot lands.
        time_s: Until it lands [s].
        reach: Where it can.
        way: On which way it goes there.
    """
    corners, stands = falling.corners, falling.feet[1 - side]
    sole = outline(corners[1 - side], stands, _INSET_M)
    then_x, then_y = _dcm_then(sole, falling.dcm, falling.rate, time_s)
    away = 1.0 if side == 0 else -1.0
    x, y = turn_in_plane(then_x - stands[0], then_y - stands[1], -stands[2])
    farther = 1.0 + _BEYOND_M / (np.hypot(x, y) + 1e-9)
    x, y = farther * x - corners[side, :, 0].mean(), away * farther * y
    if way in (BESIDE, DOWN):
        x = min(max(x, -reach.behind), reach.ahead)
        y = min(max(y, reach.narrow if way == BESIDE else reach.close), reach.wide)
    else:
        y = min(max(y + reach.inwards, -reach.across), reach.narrow)
        if way == IN_FRONT:
            x = min(max(x, reach.clear), reach.ahead)
        else:
            x = min(max(x, -reach.behind), -reach.clear)
    dx, dy = turn_in_plane(x, away * y, stands[2])
    place = np.array([stands[0] + dx, stands[1] + dy, stands[2]])
    both = hull_of(np.concatenate((sole, outline(corners[side], place, _INSET_M))))
    return place, max(0.0, reach.inside - hull_margin(both, then_x, then_y))


@inner_kernel
def _dcm_then(sole: FloatArray, dcm: FloatArray, rate: float, time_s: float) -> tuple[float, float]:
    """Return where a DCM (2,) will be that the corners of a sole (4, 2) brake as they can [m]."""
    zmp_x, zmp_y = nearest_inside(hull_of(sole), dcm[0], dcm[1])
    growth = np.exp(rate * time_s)
    return zmp_x + (dcm[0] - zmp_x) * growth, zmp_y + (dcm[1] - zmp_y) * growth


@kernel
def way_round(
    stands: FloatArray, here: FloatArray, place: FloatArray, reach: Reach
) -> tuple[float, float, float]:
    """Return where a foot goes first so that it does not hit the other one, and how far it has.

    One that is, or shall be, where the other one stands goes straight.

    Args:
        stands: Where the other foot stands: x, y [m] and yaw [rad], shape (3,).
        here: Where the foot is, shape (2,) at least.
        place: Where it shall be.
        reach: How far away it is past the other foot.

    Returns:
        x, y of the corner that it goes round first, or of its place, and the length of its way [m].
    """
    ax, ay = turn_in_plane(here[0] - stands[0], here[1] - stands[1], -stands[2])
    bx, by = turn_in_plane(place[0] - stands[0], place[1] - stands[1], -stands[2])
    far = np.hypot(bx - ax, by - ay)
    half_x, half_y = reach.clear - _SLACK_M, reach.apart - _SLACK_M
    upon = (abs(ax) < half_x and abs(ay) < half_y) or (abs(bx) < half_x and abs(by) < half_y)
    if upon or not _hits(ax, ay, bx, by, half_x, half_y):
        return place[0], place[1], far
    corner_x = np.array([reach.clear, reach.clear, -reach.clear, -reach.clear])
    corner_y = np.array([reach.apart, -reach.apart, -reach.apart, reach.apart])
    best, first = np.inf, 0
    for k in range(4):
        if _hits(ax, ay, corner_x[k], corner_y[k], half_x, half_y):
            continue
        start = np.hypot(corner_x[k] - ax, corner_y[k] - ay)
        for turn in (-1, 0, 1):
            j = (k + turn) % 4
            if _hits(corner_x[j], corner_y[j], bx, by, half_x, half_y):
                continue
            length = start + np.hypot(corner_x[j] - corner_x[k], corner_y[j] - corner_y[k])
            length += np.hypot(bx - corner_x[j], by - corner_y[j])
            if length < best:
                best, first = length, k
    dx, dy = turn_in_plane(corner_x[first], corner_y[first], stands[2])
    return stands[0] + dx, stands[1] + dy, best


@inner_kernel
def _hits(ax: float, ay: float, bx: float, by: float, half_x: float, half_y: float) -> bool:
    """Return whether the way from one point to another leads through a box around the origin."""
    first, last = 0.0, 1.0
    for a, d, half in ((ax, bx - ax, half_x), (ay, by - ay, half_y)):
        if abs(d) < 1e-9:
            if abs(a) >= half:
                return False
        else:
            s, t = (-half - a) / d, (half - a) / d
            first, last = max(first, min(s, t)), min(last, max(s, t))
    return first < last


@inner_kernel
def _falls_s(reach: Reach, high_m: float, sinks: float) -> float:
    """Return in what time a foot comes down by a cubic that ends no harder than it may [s]."""
    a = reach.gently
    return 0.0 if a == np.inf else (np.sqrt(sinks * sinks + 6.0 * a * high_m) - sinks) / a


@inner_kernel
def _price(missing: float, far: float, time_s: float, lag: float, reach: Reach) -> float:
    """Return what a step costs that misses so much and has so far to go."""
    hurry = max(0.0, far / max(time_s - lag, _TRY_S) / reach.fastest - 1.0)
    return _PRICES[0] * missing + _PRICES[1] * hurry + _PRICES[2] * far + _PRICES[3] * time_s


@inner_kernel
def _price_of_next(
    falling: Falling, side: int, place: FloatArray, time_s: float, reach: Reach
) -> float:
    """Return what the other foot's step costs after one foot has come down at a place."""
    feet, then, best = falling.feet.copy(), np.empty(2), np.inf
    sole = outline(falling.corners[1 - side], feet[1 - side], _INSET_M)
    then[0], then[1] = _dcm_then(sole, falling.dcm, falling.rate, time_s)
    feet[side] = place
    landed = Falling(falling.corners, feet, then, falling.rate)
    for k in range(int((LONGEST_S - reach.soonest) / _TRY_NEXT_S)):
        next_s = reach.soonest + k * _TRY_NEXT_S
        there, missing = landing_place(landed, 1 - side, next_s + _LIFTS_S, reach, BESIDE)
        far = way_round(place, feet[1 - side], there, reach)[2]
        best = min(best, _price(missing, far, next_s, _LAG_S, reach))
    return best


@kernel
def choose_step(falling: Falling, reach: Reach, only: int, foot: OnItsWay) -> Step:
    """Return the step that catches the DCM best: inside the soles, without hurry, near and soon.

    Only where the other one could not step, for its foot stood alone, feet cross, or come down for
    it to step next; then both steps count.

    Args:
        falling: How the robot stands.
        reach: Where a foot can land, and how soon.
        only: The one foot that can step; -1 for either.
        foot: How that one moves.
    """
    feet, since_s, best = falling.feet, foot.since_s, np.inf
    found = Step(max(only, 0), LONGEST_S, feet[max(only, 0)].copy(), np.inf, BESIDE)
    lag = max(_LAG_S - since_s, 0.0)
    n_ways = 4 if only >= 0 and foot.crosses else 1
    for side in range(2):
        if only == 1 - side:
            continue
        for way in range(n_ways):
            crossing = way in (IN_FRONT, BEHIND)
            if (way == DOWN and reach.close == 0.0) or (crossing and reach.across == 0.0):
                continue
            soonest = max(reach.soonest - since_s, _SOONEST_S)
            if way == DOWN:
                falls_s = _falls_s(reach, foot.high_m, foot.sinks)
                soonest = max(reach.down_s - since_s, _LANDS_S, falls_s)
            for k in range(int((LONGEST_S - since_s - soonest) / _TRY_S) + 1):
                time_s = soonest + k * _TRY_S
                place, missing = landing_place(falling, side, time_s, reach, way)
                far = way_round(feet[1 - side], feet[side], place, reach)[2]
                if way == DOWN:
                    price = _price(0.0, far, time_s, lag, reach)
                    if price < best:
                        later = _price_of_next(falling, side, place, time_s, reach)
                        price += min(_PRICES[0] * missing, later)
                else:
                    price = _price(missing, far, time_s, lag, reach)
                if price < best:
                    best = price
                    found = Step(side, time_s, place, missing, way)
    return found

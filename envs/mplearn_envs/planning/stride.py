"""Where feet, weight and base shall be at every knot of a plan."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.easing import minimum_jerk, smooth_step
from mplearn.maths.plane import turn_in_plane, wrap_angle
from mplearn.maths.quaternions import quaternion_product, vector_quaternion
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.mechanics.pendulum import plan_cog
from mplearn_envs.mechanics.reference import Reference, ReferenceRobot

from .footwork import Footwork
from .timeline import BESIDE, GATHER_M, Timeline, shift_time_s

SAME_PLACE_M = 0.1  # a foot that lands so near to where it stood lands there
SAME_YAW_RAD = 0.25
APART_M = 0.02  # between soles beside each other
CARRY_M = 0.12  # from this height on a foot follows the motion of the leg alone
CLEAR_S = 0.2  # in which a foot gets clear of the ground, and comes back to it [s]
_STILL_M = 1e-5
RESTS_S = 0.4  # where the weight has so long to come to rest, it rests where it shall


def plan_ground(
    robot: ReferenceRobot,
    timeline: Timeline,
    footwork: Footwork | None,
    start: FloatArray,
    knot_s: float,
) -> FloatArray:
    """Return where each foot stands or would: x, y [m] and yaw [rad], shape (K, 2, 3).

    Args:
        robot: The reference robot.
        timeline: The plan's times.
        footwork: The motion's feet.
        start: Where they stand at first, shape (2, 3).
        knot_s: Time between knots [s].
    """
    out = np.empty((len(timeline.progress), 2, 3))
    here, first = start.copy(), 0
    for part, last in zip(timeline.stretches, timeline.ends, strict=True):
        out[first:last] = here
        relative = None
        if part.lands == BESIDE:
            relative = left_from_right(robot.ground)
        elif part.lands >= 0 and footwork is not None:
            relative = footwork.left_from_right[min(part.lands, len(footwork.rise) - 1)]
        if relative is not None:
            exact = part.lands != BESIDE and footwork is not None and not footwork.free
            place = landing(robot, here, part.up, relative, exact=exact)
            n = last - first
            clear = _clearing(
                n, knot_s, timeline.patience
            )  # a foot that moves while it touches the ground drags
            x = (np.arange(n) + 1.0 - 0.5 * clear) / (n - clear)
            x = smooth_step(np.clip(x, 0.0, 1.0))[:, None]
            way = here[part.up] * (1.0 - x) + place * x
            out[first:last, part.up] = passing(robot, here[1 - part.up], part.up, way)
            here[part.up] = place
        first = last
    return out


def left_from_right(ground: FloatArray) -> FloatArray:
    """Return the left foot in the right one's frame, x, y [m] and yaw [rad], for feet (2, 3)."""
    x, y, turn = ground[0] - ground[1]
    return np.array((*turn_in_plane(x, y, -ground[1, 2]), wrap_angle(turn)))


def landing(
    robot: ReferenceRobot,
    ground: FloatArray,
    side: int,
    relative: FloatArray,
    *,
    exact: bool = False,
) -> FloatArray:
    """Return where a foot lands: x, y [m] and yaw [rad], shape (3,).

    It does not land on the other foot, however narrow the demonstrator stands, and where it stood
    if that is near, unless the place is meant exactly.
    """
    stands = ground[1 - side]
    dx, dy, turn = relative
    if side == 1:  # the right foot in the left one's frame
        (dx, dy), turn = turn_in_plane(-dx, -dy, -turn), -turn
    length, width = np.ptp(robot.corners, axis=1).max(axis=0)[:2]
    if abs(dx) < length:
        clear = width + APART_M + 0.5 * length * abs(np.sin(turn))
        dy = max(dy, clear) if side == 0 else min(dy, -clear)
    moved = stands + np.array((*turn_in_plane(dx, dy, stands[2]), turn)) - ground[side]
    moved[2] = wrap_angle(moved[2])
    near = np.hypot(moved[0], moved[1]) < SAME_PLACE_M and abs(moved[2]) < SAME_YAW_RAD
    if near and not exact:
        return np.array(ground[side])
    return np.asarray(ground[side] + moved)


def passing(robot: ReferenceRobot, stands: FloatArray, side: int, way: FloatArray) -> FloatArray:
    """Return the way of a foot, shape (n, 3), led round the foot that stands, shape (3,).

    Where it begins and ends stays.
    """
    dx, dy = (way[:, :2] - stands[:2]).T
    x, y = turn_in_plane(dx, dy, -stands[2])
    length, width = np.ptp(robot.corners, axis=1).max(axis=0)[:2]
    clear = width + APART_M + 0.5 * length * np.abs(np.sin(way[:, 2] - stands[2]))
    beside = smooth_step(np.clip(2.0 * (1.5 - np.abs(x) / length), 0.0, 1.0))
    out = beside * np.maximum(0.0, clear - (y if side == 0 else -y))
    out = np.maximum(0.0, out - np.linspace(out[0], out[-1], len(out)))
    aside = turn_in_plane(0.0, 1.0 if side == 0 else -1.0, stands[2])
    return np.asarray(way + np.outer(out, (*aside, 0.0)))


def left_share(middles: FloatArray, up: IntArray, zmp: FloatArray) -> FloatArray:
    """Return which share of the weight the left foot carries, shape (T,).

    Args:
        middles: Middles of the soles, shape (T, 2, 2) [m].
        up: Side of the foot in the air, -1 for none, shape (T,).
        zmp: Zero-moment points, shape (T, 2) [m].
    """
    left, right = middles[:, 0], middles[:, 1]
    across = left - right
    share = np.clip(np.sum((zmp - right) * across, axis=1) / np.sum(across**2, axis=1), 0.0, 1.0)
    share[up == 0], share[up == 1] = 0.0, 1.0
    return np.asarray(share)


def recentred(q: FloatArray, ground: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a posture (7 + n,) and its feet (2, 3) seen from between the feet, x ahead."""
    middle, yaw = ground[:, :2].mean(axis=0), float(ground[:, 2].mean())
    if not (np.any(np.abs(middle) > 1e-9) or abs(yaw) > 1e-9):
        return q, ground
    q, ground = q.copy(), ground.copy()
    q[:2] = turn_in_plane(q[0] - middle[0], q[1] - middle[1], -yaw)
    q[3:7] = quaternion_product(vector_quaternion(0.0, 0.0, -yaw), q[3:7])
    x, y = (ground[:, :2] - middle).T
    ground[:, :2] = np.stack(turn_in_plane(x, y, -yaw), axis=1)
    ground[:, 2] -= yaw
    return q, ground


def _clearing(n_knots: int, knot_s: float, patience: float) -> float:
    """Return in how many of so many knots a foot gets clear of the ground, or back to it."""
    return min(CLEAR_S * patience / knot_s, n_knots / 3.0)


class Weight(NamedTuple):
    """Where the weight shall be.

    Attributes:
        zmp: Zero-moment points at the start and the K knots after it, shape (K + 1, 2) [m].
        end: Where the COG shall rest at last, shape (2,) [m].
        settled: Whether there is time for that.
        still: Whether it is there from the beginning.
    """

    zmp: FloatArray
    end: FloatArray
    settled: bool
    still: bool

    def path(self, height: float, knot_s: float, off: FloatArray | float = 0.0) -> FloatArray:
        """Return the COG at the K knots, shape (K, 2) [m].

        Args:
            height: Height of the COG [m].
            knot_s: Time between knots [s].
            off: By how much the zero-moment point of all masses differs from the pendulum's, shape
                (K + 1, 2) [m].
        """
        start = self.zmp[0]
        path = plan_cog(self.zmp - off, start, self.end, self.settled, height, knot_s)
        return np.asarray(path[1:])


def plan_weight(
    timeline: Timeline, middles: FloatArray, start: FloatArray, knot_s: float
) -> Weight:
    """Plan the zero-moment point so that the weight is over the foot that carries.

    Args:
        timeline: The plan's times.
        middles: Middles of the soles, shape (K, 2, 2) [m].
        start: Where the COG rests, shape (2,) [m].
        knot_s: Time between knots [s].
    """
    zmp = np.empty((len(middles) + 1, 2))
    zmp[0] = here = start
    first, rests_s, still = 0, 0.0, True
    for i, (part, last) in enumerate(zip(timeline.stretches, timeline.ends, strict=True)):
        n = last - first
        standing = middles[last - 1]
        following = timeline.stretches[i + 1].up if i + 1 < len(timeline.stretches) else -1
        if part.up >= 0:
            there = standing[1 - part.up]
        else:
            there = standing[1 - following] if following >= 0 else standing.mean(axis=0)
        far = float(np.linalg.norm(there - here))
        over = 1 if part.up >= 0 else min(n, round(shift_time_s(far) / knot_s))
        begin = n - over if part.up < 0 and following >= 0 else 0  # not before it must
        x = np.clip((np.arange(n) + 1.0 - begin) / max(over, 1), 0.0, 1.0)[:, None]
        zmp[first + 1 : last + 1] = here * (1.0 - x) + there * x
        stays = far < _STILL_M
        rests_s = rests_s + n * knot_s if stays else (n - begin - over) * knot_s
        still &= stays
        here, first = there, last
    if still:
        return Weight(np.broadcast_to(start, zmp.shape).copy(), start, True, True)
    return Weight(zmp, here, rests_s >= RESTS_S, False)


def plan_rise(
    timeline: Timeline, rise: FloatArray, start: Reference, blended: FloatArray, knot_s: float
) -> FloatArray:
    """Return the heights of the soles along a plan, shape (K, 2) [m].

    However slowly the demonstrator raised a foot, it leaves the ground at once, and comes back to
    it at last.

    Args:
        timeline: The plan's times.
        rise: Heights in the motion, shape (K, 2) [m].
        start: Where the reference robot is.
        blended: Heights when a foot stays up, blended with those at the start, shape (K, 2).
        knot_s: Time between knots [s].
    """
    out, first = rise.copy(), 0
    was_up = start.lifted
    for i, (part, last) in enumerate(zip(timeline.stretches, timeline.ends, strict=True)):
        side, here = part.up, slice(first, last)
        if side < 0:
            out[here] = 0.0
        else:
            out[here, 1 - side] = 0.0
            n = last - first
            ticks, clear = np.arange(n) + 1.0, _clearing(n, knot_s, timeline.patience)
            ramp = minimum_jerk(ticks / n)
            leaves = smooth_step(np.minimum(ticks / clear, 1.0))
            lands = smooth_step(np.minimum((n - ticks) / clear, 1.0))
            begins_up = i == 0 and start.up[side] > 0
            lowers = begins_up and part.first == part.last
            before = start.swing[side - 2] if begins_up else 0.0
            if part.lands == BESIDE:
                out[here, side] = (before * (1.0 - ramp) + GATHER_M * leaves) * lands
            elif lowers:
                out[here, side] = before * (1.0 - ramp)
            elif part.first == part.last:
                out[here, side] = rise[last - 1, side] * ramp
            else:
                if begins_up:
                    out[here, side] = blended[here, side]
                if was_up != side:
                    out[here, side] *= leaves
                if part.lands >= 0:
                    out[here, side] *= lands
            was_up = -1 if lowers or part.lands != -1 else side
        first = last
    return np.maximum(out, 0.0)

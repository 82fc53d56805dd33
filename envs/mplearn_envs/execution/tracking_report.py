"""What happened while a plan was performed, from the states that were recorded."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.recording import FloatArray
from mplearn_envs.control.ankle_feedback import support
from mplearn_envs.mechanics.heels import bearing_corners
from mplearn_envs.mechanics.momentum import ground_reaction, momenta
from mplearn_envs.mechanics.reference import Reference, reference_robot, sole_middles
from mplearn_envs.mechanics.support import margins_along
from mplearn_envs.planning.plan import Plan
from mplearn_envs.robot import Robot
from mplearn_envs.robot.feet import TOUCHES_M

FALL_TILT_RAD = 0.6
FALL_DROP_M = 0.2


class TrackingReport(NamedTuple):
    """What happened while a plan was performed, at its S reference postures (fewer after a fall).

    Attributes:
        time_s: Time since the start, shape (S,) [s].
        tracking_error_rad: Root mean square over the joints of actual minus wanted angle, (S,)
            [rad].
        cog_deviation_m: Distance of the COG's projection from where it should be over the feet that
            carry, shape (S,) [m]; with both feet down that is the middle of the soles.
        zmp_margin_m: Distance of the zero-moment point from the edge of the soles that stand, (S,)
            [m].
        fallen: Whether the robot fell; the last sample is when.
        duration_s: How long it took [s].
        n_steps: How many steps the robot took to survive.
        end: Where the reference robot is at the end if not where it was planned.

    Example:
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.planning import Planner
        >>> from mplearn_envs.robot import humanoid
        >>> plan = Planner(humanoid()).hold(rest_reference(humanoid()), 0.5)
        >>> report = TrackingReport.as_planned(plan)
        >>> report.fallen, report.duration_s, report.fallen_at(0.5).fallen
        (False, 0.5, True)
    """

    time_s: FloatArray
    tracking_error_rad: FloatArray
    cog_deviation_m: FloatArray
    zmp_margin_m: FloatArray
    fallen: bool
    duration_s: float
    n_steps: int = 0
    end: Reference | None = None

    @classmethod
    def as_planned(cls, plan: Plan) -> TrackingReport:
        """Return what happens where a plan is taken at its word."""
        n_knots = len(plan.q) - 1
        return cls(
            np.arange(1.0, n_knots + 1.0) * plan.knot_s,
            np.zeros(n_knots),
            np.zeros(n_knots),
            plan.zmp_margin_m[1:],
            False,
            plan.duration_s,
        )

    def fallen_at(self, share: float) -> TrackingReport:
        """Return what happens where the robot falls after a share of the time."""
        n = 1 + int(share * (len(self.time_s) - 1))
        time_s, error, deviation, margin = (part[:n] for part in self[:4])
        return TrackingReport(time_s, error, deviation, margin, True, float(time_s[-1]))


def assess(robot: Robot, plan: Plan, q: FloatArray, v: FloatArray, fallen: bool) -> TrackingReport:
    """Compare what was recorded with what was planned.

    Args:
        robot: The robot.
        plan: What it performed.
        q: Postures at the plan's reference postures, the start included, shape (S + 1, 7 + n).
        v: Velocities there, shape (S + 1, 6 + n).
        fallen: Whether it fell.

    Example:
        >>> import numpy as np
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.planning import Planner
        >>> from mplearn_envs.robot import humanoid
        >>> plan = Planner(humanoid()).hold(rest_reference(humanoid()), 0.5)
        >>> velocity = np.zeros((len(plan.q), plan.q.shape[1] - 1))
        >>> report = assess(humanoid(), plan, plan.q, velocity, fallen=False)
        >>> float(report.tracking_error_rad.max().round(9))
        0.0
    """
    ref = reference_robot(robot)
    n = len(q)
    cog, linear, angular, soles = momenta(ref.tree, ref.inertia, ref.stance.feet, ref.corners, q, v)
    zmp = ground_reaction(float(ref.tree.mass.sum()), cog, linear, angular, plan.knot_s)
    share, ground, heel = plan.share[:n], plan.ground[:n], plan.heel[:n]
    bearing = bearing_corners(soles, heel)
    seen = support(share, _feet(soles, bearing)).see(cog[:, :2])
    planned = np.concatenate((sole_middles(ref, ground, heel), ground[..., 2:]), axis=-1)
    wanted = support(share, planned).see(plan.cog[:n, :2])
    soles = bearing[1:]
    landed = soles[..., 2].min(axis=2).max(axis=1) < TOUCHES_M
    up = np.where(landed, -1, plan.up[1:n])
    margin = margins_along(np.ascontiguousarray(soles[..., :2]), up, zmp)
    margin[~np.isfinite(margin)] = -1.0  # nothing carries, or numbers have lost their meaning
    error = q[1:, 7:] - plan.q[1:n, 7:]
    time = np.arange(1.0, n) * plan.knot_s
    return TrackingReport(
        time,
        np.sqrt(np.mean(error**2, axis=1)),
        np.linalg.norm(seen - wanted, axis=1)[1:],
        np.maximum(margin, -1.0),
        fallen,
        float(time[-1]),
    )


def _feet(soles: FloatArray, bearing: FloatArray) -> FloatArray:
    """Return where feet are, shape (S, 2, 3): middle of what they stand on [m] and yaw [rad].

    Args:
        soles: Corners of the soles, front ones first, shape (S, 2, 4, 3) [m].
        bearing: Corners of what they stand on, same shape [m].
    """
    ahead = soles[..., :2, :2].sum(axis=2) - soles[..., 2:, :2].sum(axis=2)
    yaw = np.arctan2(ahead[..., 1], ahead[..., 0])
    return np.concatenate((bearing[..., :2].mean(axis=2), yaw[..., None]), axis=-1)


@njit(cache=True, nogil=True)
def has_fallen(q: FloatArray, wanted: FloatArray, drop_m: float) -> bool:
    """Return whether the base is far from upright, from its height, or not finite.

    Args:
        q: Actual posture, shape (7 + n,).
        wanted: Wanted posture, shape (7 + n,).
        drop_m: By how much it may be lower than wanted [m].

    Example:
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.robot import humanoid
        >>> q = rest_reference(humanoid()).q
        >>> low = q.copy()
        >>> low[2] -= 0.4
        >>> has_fallen(q, q, drop_m=0.3), has_fallen(low, q, drop_m=0.3)
        (False, True)
    """
    up, wanted_up = _up(q), _up(wanted)
    cosine = up[0] * wanted_up[0] + up[1] * wanted_up[1] + up[2] * wanted_up[2]
    return not (cosine > np.cos(FALL_TILT_RAD) and q[2] > wanted[2] - drop_m)


@njit(cache=True, nogil=True)
def _up(q: FloatArray) -> tuple[float, float, float]:
    """Return the vertical in the base's frame."""
    w, x, y, z = q[3], q[4], q[5], q[6]
    return 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)

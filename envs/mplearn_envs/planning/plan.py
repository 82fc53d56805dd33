"""Motions to be performed, plans that perform them, and what planning goes by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mplearn.maths.plane import turn_in_plane
from mplearn.maths.quaternions import quaternion_product, vector_quaternion
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.mechanics.reference import Reference

from .footwork import Footwork
from .stance import Stance


@dataclass(frozen=True)
class PlannerConfig:
    """How motions become commands.

    Attributes:
        period_s: Time between commands [s].
        knot_steps: Commands from one solution of the inverse kinematics to the next.
        blend_s: Time in which the present posture gives way to the primitive's [s]: less in short
            motions, more where there is far to go.
        blend_velocity: Share of the velocity limits that the blending may take.
        zmp_margin_m: How far inside the soles the zero-moment point stays, if slowing down can
            make it [m].
        model_error: By which share masses and gains may be wrong: the zero-moment point stays
            farther inside by this share of its distance from the COG, which is what moving masses
            make of it.
        cache_size: Number of plans that are kept.

    Example:
        >>> PlannerConfig(period_s=0.002, knot_steps=10).knot_steps
        10
    """

    period_s: float = 0.004
    knot_steps: int = 5
    blend_s: float = 0.5
    blend_velocity: float = 0.3
    zmp_margin_m: float = 0.015
    model_error: float = 0.1
    cache_size: int = 256


class Motion(NamedTuple):
    """What shall be performed.

    Attributes:
        frames: Tracked coordinates at human speed, shape (T, U) [m, rad].
        rate_hz: Frames per second [1/s].
        footwork: What the feet do; None where both stay down.
        flight_m: How high both soles are at once, at most, see `read_flight` [m].
        stance: How it stands before a foot leaves the ground; None as the robot does.

    Example:
        >>> import numpy as np
        >>> Motion(np.zeros((101, 21)), rate_hz=50.0).duration_s
        2.0
    """

    frames: FloatArray
    rate_hz: float
    footwork: Footwork | None = None
    flight_m: float = 0.0
    stance: Stance | None = None

    @property
    def duration_s(self) -> float:
        """Length at human speed [s]."""
        return (len(self.frames) - 1) / self.rate_hz


class Plan(NamedTuple):
    """A motion, ready to be performed.

    Attributes:
        commands: Servo commands, shape (N, n) [rad].
        q: Reference postures, shape (K + 1, 7 + n), the first being the start.
        knot_s: Time between reference postures [s].
        error: Largest error of feet, COG and base that is left at each of them, shape (K + 1,).
        end: Where the reference robot is at the end.
        speed: Speed that was possible, as a share of the human's.
        cog: COG of each posture, shape (K + 1, 3) [m].
        zmp: Zero-moment point at each posture, all masses moving as planned, (K + 1, 2) [m].
        zmp_margin_m: Its distance from the edge of the soles that stand, negative outside, shape
            (K + 1,) [m].
        ground: Where each foot stands or would: x, y [m] and yaw [rad], shape (K + 1, 2, 3).
        up: Side of the foot in the air at each posture, 0 left, 1 right, -1 none, shape (K + 1,).
        share: Which share of the weight the left foot carries, shape (K + 1,).
        heel: By how much each heel is raised, shape (K + 1, 2) [rad].

    Example:
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.planning import Planner
        >>> from mplearn_envs.robot import humanoid
        >>> plan = Planner(humanoid()).hold(rest_reference(humanoid()), 1.0)
        >>> plan.duration_s, plan.steps, bool(plan.zmp_margin_m.min() > 0)
        (1.0, False, True)
    """

    commands: FloatArray
    q: FloatArray
    knot_s: float
    error: FloatArray
    end: Reference
    speed: float
    cog: FloatArray
    zmp: FloatArray
    zmp_margin_m: FloatArray
    ground: FloatArray
    up: IntArray
    share: FloatArray
    heel: FloatArray

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return (len(self.q) - 1) * self.knot_s

    @property
    def steps(self) -> bool:
        """Whether a foot is in the air or the weight moves."""
        return bool((self.up >= 0).any() or np.ptp(self.cog[:, :2], axis=0).max() > 1e-3)

    def part(self, first: int, last: int) -> Plan:
        """Return it from one reference posture to another; `end` stays that of the whole.

        Args:
            first: The posture at which the part begins, from 0 to K - 1.
            last: That at which it ends, from ``first + 1`` to K.

        Example:
            >>> from mplearn_envs.mechanics import rest_reference
            >>> from mplearn_envs.planning import Planner
            >>> from mplearn_envs.robot import humanoid
            >>> plan = Planner(humanoid()).hold(rest_reference(humanoid()), 1.0)
            >>> round(plan.part(10, 35).duration_s, 3)
            0.5
        """
        n_steps = len(self.commands) // (len(self.q) - 1)
        return self._replace(
            commands=self.commands[first * n_steps : last * n_steps],
            **{name: getattr(self, name)[first : last + 1] for name in _SERIES},
        )


_SERIES = ("q", "error", "cog", "zmp", "zmp_margin_m", "ground", "up", "share", "heel")


def joined(plans: Sequence[Plan]) -> Plan:
    """Return plans one after another as one, seen from where the first one begins.

    Args:
        plans: One or more, each of which begins where the one before ends.

    Example:
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.planning import Planner
        >>> from mplearn_envs.robot import humanoid
        >>> planner = Planner(humanoid())
        >>> first = planner.hold(rest_reference(humanoid()), 1.0)
        >>> joined([first, planner.hold(first.end, 0.5)]).duration_s
        1.5
    """
    if len(plans) == 1:
        return plans[0]
    place = np.zeros(3)  # x, y, yaw of the present plan's origin
    moved = []
    for plan in plans:
        moved.append(_moved(plan, place))
        ground = moved[-1].ground[-1]
        place = np.append(ground[:, :2].mean(axis=0), ground[:, 2].mean())

    def series(name: str) -> Any:
        return np.concatenate([getattr(plan, name)[int(i > 0) :] for i, plan in enumerate(moved)])

    return moved[-1]._replace(
        commands=np.concatenate([plan.commands for plan in moved]),
        **{name: series(name) for name in _SERIES},
    )


def _moved(plan: Plan, place: FloatArray) -> Plan:
    """Return a plan as seen from where its origin is at x, y [m] and yaw [rad]."""
    if not place.any():
        return plan
    turn = vector_quaternion(0.0, 0.0, place[2])
    q, ground, cog = plan.q.copy(), plan.ground.copy(), plan.cog.copy()
    q[:, 3:7] = np.stack(quaternion_product(turn, tuple(q[:, 3:7].T)), axis=1)
    zmp = plan.zmp.copy()
    for points in (q, ground, cog, zmp):
        x, y = turn_in_plane(points[..., 0], points[..., 1], place[2])
        points[..., 0], points[..., 1] = x + place[0], y + place[1]
    ground[..., 2] += place[2]
    return plan._replace(q=q, ground=ground, cog=cog, zmp=zmp)

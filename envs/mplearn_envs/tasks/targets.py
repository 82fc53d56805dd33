"""What a goal is, and how people give one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.measurement import Measured
from mplearn_envs.repertoire import HEIGHT_SCALE, Repertoire

SIDES = ("left", "right")


class Goal(NamedTuple):
    """What shall be reached.

    Attributes:
        side: 0: the left hand, 1: the right one; of a hand's goal.
        point: Where the hand shall be, from the middle of the soles, x forward, shape (3,) [m].
        posture: Base height, roll, pitch and joint angles, shape (3 + n,) [m, rad]; of a posture's
            goal. NaN where it does not matter.
        slots: Slots of the primitives at whose end the goal is reached.
        least_time_s: Least time until then [s].
    """

    side: int
    point: FloatArray
    posture: FloatArray
    slots: tuple[int, ...]
    least_time_s: float


def hand_bodies(repertoire: Repertoire) -> tuple[int, ...]:
    """Return the bodies of the left and of the right hand.

    Raises:
        InvalidValueError: The robot has none.
    """
    robot = repertoire.robot
    roles = dict(robot.segments)
    if not {"hand_l", "hand_r"} <= set(roles):
        raise InvalidValueError(
            f"robot {robot.name!r} has no hands among its segments {sorted(roles)}; "
            "choose another kind of goal"
        )
    model = robot.model()
    return tuple(model.body(roles[role]).id for role in ("hand_l", "hand_r"))


def hand_target(target: Any) -> tuple[int, FloatArray]:
    """Return the side, 0 or 1, and the point (3,) [m] of what a person gave.

    Raises:
        InvalidValueError: It is no hand's target.
    """
    try:
        side, point = target
        point = np.array(point, dtype=np.float64)
        if side not in SIDES or point.shape != (3,) or not np.isfinite(point).all():
            raise ValueError
    except (TypeError, ValueError):
        raise InvalidValueError(
            f"a hand's target is ('left' or 'right', (x, y, z)) [m], not {target!r}"
        ) from None
    return SIDES.index(side), point


def posture_target(target: Any, repertoire: Repertoire) -> FloatArray:
    """Return the posture, shape (3 + n,), of what a person gave; NaN where it does not matter.

    Raises:
        InvalidValueError: It is no posture's target.
    """
    channels = repertoire.robot.channels
    if not isinstance(target, Mapping) or not target or not set(target) <= set(channels):
        raise InvalidValueError(
            f"a posture's target maps some of the channels {channels[:4]}... to values, "
            f"not {target!r}"
        )
    posture = np.full(len(channels), np.nan)
    for channel, value in target.items():
        posture[channels.index(channel)] = value
    if not np.isfinite([posture[channels.index(channel)] for channel in target]).all():
        raise InvalidValueError(f"a posture's target must be finite, not {target!r}")
    return posture


def posture_gap(wanted: FloatArray, there: Measured) -> float:
    """Return the largest difference of a coordinate that matters [rad]."""
    apart = np.abs(there.posture - wanted)
    apart[0] *= HEIGHT_SCALE
    return float(np.nanmax(apart))

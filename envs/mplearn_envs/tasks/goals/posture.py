"""Take a posture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.execution.sensors import Measured
from mplearn_envs.skills.repertoire import HEIGHT_SCALE

from .base import Goal, GoalKind

_MOST = 10.0  # of a coordinate, in what is shown [m, rad]


@dataclass(frozen=True, eq=False)
class PostureGoal(Goal):
    """A posture.

    Attributes:
        posture: Base height, roll, pitch and joint angles, shape (3 + n,) [m, rad]; NaN where it
            does not matter.
        tolerance: How near each coordinate must come [rad], see `posture_gap`.
        channels: Names of the coordinates.
    """

    posture: FloatArray
    tolerance: float
    channels: tuple[str, ...]

    def __str__(self) -> str:
        """Say what is wanted."""
        matters = np.flatnonzero(~np.isnan(self.posture)).tolist()
        wanted = {self.channels[k]: round(float(self.posture[k]), 3) for k in matters}
        return f"the posture {wanted}"

    def show(self, now: Measured) -> FloatArray:
        """Return wanted coordinates, and wanted minus present ones, shape (2 (3 + n),)."""
        wanted = np.where(np.isnan(self.posture), now.posture, self.posture)
        apart = np.clip(wanted - now.posture, -2 * _MOST, 2 * _MOST)
        return np.concatenate((np.clip(wanted, -_MOST, _MOST), apart))

    def gap(self, id: int | None, there: Measured) -> float:
        """Return the largest difference of a coordinate that matters [rad]."""
        return posture_gap(self.posture, there.posture)


@dataclass(frozen=True)
class PostureGoals(GoalKind):
    """Goals of postures; drawn ones are not reached at the start.

    Attributes:
        tolerance_rad: How near each coordinate must come [rad].

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> from mplearn_envs.robot import humanoid
        >>> from mplearn_envs.skills.repertoire import Repertoire
        >>> repertoire = Repertoire(LibrarySource(None).now(), humanoid())
        >>> goals = PostureGoals(repertoire, tolerance_rad=0.2)
        >>> str(goals.given({humanoid().channels[1]: 0.1}))
        "the posture {'base_roll': 0.1}"
    """

    tolerance_rad: float

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the bounds of what goals show, shape (2 (3 + n),) each."""
        width = len(self.repertoire.robot.channels)
        high = np.concatenate((np.full(width, _MOST), np.full(width, 2 * _MOST)))
        return -high, high

    def given(self, target: Any) -> PostureGoal:
        """Return the goal of a mapping of some of the robot's channels to values [m, rad].

        Raises:
            InvalidValueError: It is no posture's target.
        """
        channels = self.repertoire.robot.channels
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
        return PostureGoal(posture, self.tolerance_rad, channels)

    def at(self, id: int, there: Measured, start: Measured) -> Iterator[PostureGoal]:
        """Yield the posture, unless that is the one of the start."""
        if posture_gap(there.posture, start.posture) > self.tolerance_rad:
            yield PostureGoal(there.posture, self.tolerance_rad, self.repertoire.robot.channels)


def posture_gap(wanted: FloatArray, there: FloatArray) -> float:
    """Return the largest difference of a coordinate that is not NaN [rad]; heights are scaled."""
    apart = np.abs(there - wanted)
    apart[0] *= HEIGHT_SCALE
    return float(np.nanmax(apart))

"""What is assumed of activities, in seconds."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InvalidValueError
from ..segmentation.base import check_positive


@dataclass(frozen=True)
class ActivityConfig:
    """Settings of `find_activities`.

    Attributes:
        step_s: Postures are averaged over steps of this length [s].
        apart_s: Nearer in time than this, postures are alike because little time has passed; they
            are no neighbours [s]. An activity lasts twice as long at least: in less, nothing could
            come back to the posture in its middle.
        reach_s: Within this time an activity comes back to its postures [s].
        neighbours_s: Number of neighbours that are looked at, as the time that they fill [s].
        recurrence: Links that a stretch must hold, as a share of those that it would hold if they
            were spread evenly over `reach_s`.
        mixing: Two stretches are one activity if neighbours lie in the other one at least at this
            share of what they would if both were mixed evenly.

    Example:
        >>> import numpy as np
        >>> from mplearn.activities import find_activities
        >>> t = np.arange(6000) / 50.0
        >>> arms, legs = np.sin(4 * t) * (t < 60), np.sin(5 * t) * (t >= 60)
        >>> quick = ActivityConfig(reach_s=4.0)  # postures come back within seconds
        >>> np.unique(find_activities(np.stack((arms, legs), axis=1), 50.0, quick)).tolist()
        [0, 1]
    """

    step_s: float = 0.1
    apart_s: float = 0.8
    reach_s: float = 8.0
    neighbours_s: float = 1.0
    recurrence: float = 0.9
    mixing: float = 0.5

    def __post_init__(self) -> None:
        times = ("step_s", "apart_s", "reach_s", "neighbours_s")
        check_positive(self, *times, "recurrence", "mixing")
        if not self.step_s <= self.apart_s < self.reach_s:
            raise InvalidValueError(
                f"step_s, apart_s and reach_s must increase, not {self.step_s}, {self.apart_s} and "
                f"{self.reach_s}"
            )

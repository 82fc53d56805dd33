"""What a learner needs to know before the first frame."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from ..arguments import is_one_of, names_of, require_kind, require_numbers
from ..errors import InvalidValueError
from ..people import PeopleConfig
from ..segmentation import require_segmenter
from ..state import from_settings, newer, to_settings
from ..tree import TreeConfig

LOWEST_HZ, HIGHEST_HZ = 20.0, 250.0
"""Rates at which a learner can watch [1/s]."""


def learnable_rate(rate_hz: float) -> float:
    """Return the rate nearest to a recording's, by a whole factor, at which it can be learned.

    >>> learnable_rate(500.0), learnable_rate(1000.0), learnable_rate(15.0), learnable_rate(120.0)
    (250.0, 250.0, 30.0, 120.0)
    """
    if rate_hz > HIGHEST_HZ:
        return rate_hz / math.ceil(rate_hz / HIGHEST_HZ)
    if rate_hz < LOWEST_HZ:
        return rate_hz * math.ceil(LOWEST_HZ / rate_hz)
    return rate_hz


@dataclass(frozen=True)
class LearnerConfig:
    """The stream, and how to learn from it.

    Attributes:
        channels: Names of a frame's columns. Columns of markers (``"LSHO.x", "LSHO.y", ...``) are
            turned into the robot's joint angles by on-line inverse kinematics; all other channels
            [rad] or [m] are learned as they come.
        rate_hz: Frames per second, 20 to 250 [1/s].
        observe: What markers become: ``"robot"``, joint angles of the robot; or ``"markers"``:
            they are learned as positions.
        segmenter: Name of the segmenter, one of `mplearn.segmentation.SEGMENTERS`.
        scaffolding: Whether known primitives help to cut what comes ([Kulic2012], end of 2.1).
            ``"inside"``: where a motion under way is one of them, a boundary is less likely inside
            it. True: the more so, and a boundary is likelier at its end, which may be its cause
            then; but a recording played again and again is cut a little otherwise each time.
        tree: How primitives are formed.
        people: What makes motions of different people one primitive.
        longest_pause_s: Two primitives with a longer pause between them do not count as
            consecutive [s].
        false_alarms: Share of the motions, and of the transitions, like those learned that may be
            reported as an anomaly, in (0, 1). Before 1 / false_alarms were seen, none is.

    Example:
        >>> from mplearn.tree import TreeConfig
        >>> config = LearnerConfig(("hip", "knee"), rate_hz=50.0, tree=TreeConfig(min_exemplars=3))
        >>> LearnerConfig.from_dict(config.to_dict()) == config
        True
    """

    channels: tuple[str, ...]
    rate_hz: float = 100.0
    observe: Literal["robot", "markers"] = "robot"
    segmenter: str = "kohlmorgen-lemm"
    scaffolding: Literal["inside", True, False] = newer("inside", absent=False)
    tree: TreeConfig = field(default_factory=TreeConfig)
    people: PeopleConfig = field(default_factory=PeopleConfig)
    longest_pause_s: float = 2.0
    false_alarms: float = 0.01

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", names_of("channels", self.channels))
        require_numbers(self)
        require_kind("tree", self.tree, TreeConfig)
        require_kind("people", self.people, PeopleConfig)
        if not self.channels:
            raise InvalidValueError("a learner needs at least one channel")
        if not LOWEST_HZ <= self.rate_hz <= HIGHEST_HZ:
            raise InvalidValueError(f"rate_hz must lie in [20, 250], not {self.rate_hz}")
        if not is_one_of(self.observe, ("robot", "markers")):
            raise InvalidValueError(f"observe must be 'robot' or 'markers', not {self.observe!r}")
        require_segmenter(self.segmenter)
        if not is_one_of(self.scaffolding, (True, False, "inside")):
            raise InvalidValueError(
                f"scaffolding must be True, False or 'inside', not {self.scaffolding!r}"
            )
        if not self.longest_pause_s > 0:
            raise InvalidValueError(f"longest_pause_s must be positive, not {self.longest_pause_s}")
        if not 0 < self.false_alarms < 1:
            raise InvalidValueError(f"false_alarms must lie in (0, 1), not {self.false_alarms}")

    @classmethod
    def from_dict(cls, settings: Mapping[str, Any]) -> LearnerConfig:
        """Return the configuration that `to_dict` turned into plain values.

        What is not named takes its default.

        Raises:
            StateError: A setting is not known, or has no such value; its place says which.
        """
        return from_settings(cls, dict(settings))

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as plain values, which JSON can hold."""
        return to_settings(self)

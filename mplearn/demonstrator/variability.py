"""How one execution differs from the next: the sizes of all that is random."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from mplearn.errors import InvalidValueError

Range = tuple[float, float]


@dataclass(frozen=True)
class Variability:
    """Sizes of the variation between executions, and of the measurement's defects.

    Attributes:
        duration: Durations vary uniformly by this share both ways.
        amplitude: Amplitudes vary uniformly by this share both ways.
        joint_amplitude: So does each joint on its own, in addition.
        timing_s: Standard deviation of a joint's begin and end within a motion [s].
        side_lag_s: Standard deviation of the lag between the arms [s].
        scatter_rad: Standard deviation of the angle in which a joint comes to rest [rad].
        placement_m: Standard deviation of where a foot is put down [m].
        drift_rad: Standard deviation of the posture's drift over minutes, per joint [rad].
        sway: Factor on standing sway, breathing and gaze; 1 is a person's.
        fluid: Share of joins at which the next motion starts before the last has ended.
        overlap_s: Range of that overlap [s].
        pause: Share of joins with a pause.
        pause_s: Range of the pauses [s].
        dwell_s: Range of the stop at all other joins [s].
        noise_m: Standard deviation of a marker's coordinate [m].
        occlusion: Share of marker measurements that are missing.
        occlusion_s: Range of the length of one occlusion [s].

    Example:
        >>> from dataclasses import replace
        >>> from mplearn.demonstrator import demonstrate
        >>> clean = Variability.none()  # each execution the same, nothing hidden
        >>> shown = demonstrate(["BAR", "BAL"], seed=1, variability=clean)
        >>> bool(np.isfinite(shown.recording.frames).all())
        True
        >>> replace(Variability(), noise_m=0.005).noise_m  # cheap cameras
        0.005
    """

    duration: float = 0.20
    amplitude: float = 0.15
    joint_amplitude: float = 0.05
    timing_s: float = 0.03
    side_lag_s: float = 0.02
    scatter_rad: float = 0.02
    placement_m: float = 0.008
    drift_rad: float = 0.02
    sway: float = 1.0
    fluid: float = 0.5
    overlap_s: Range = (0.1, 0.3)
    pause: float = 0.05
    pause_s: Range = (0.4, 0.9)
    dwell_s: Range = (0.0, 0.1)
    noise_m: float = 0.002
    occlusion: float = 0.01
    occlusion_s: Range = (0.05, 0.5)

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            low, high = value if isinstance(value, tuple) else (value, value)
            if not (np.isfinite((low, high)).all() and 0.0 <= low <= high):
                raise InvalidValueError(f"{item.name} must be finite and >= 0, not {value}")
        for name, limit in {
            "duration": 0.5, "amplitude": 0.5, "joint_amplitude": 0.5, "fluid": 1.0, "pause": 1.0,
            "occlusion": 0.5,
        }.items():  # fmt: skip
            if getattr(self, name) > limit:
                raise InvalidValueError(
                    f"{name} must be in [0, {limit}], not {getattr(self, name)}"
                )
        if self.fluid + self.pause > 1.0:
            raise InvalidValueError(
                f"fluid and pause are shares of the joins, together at most 1, "
                f"not {self.fluid} + {self.pause}"
            )
        if self.occlusion > 0.0 and self.occlusion_s[0] <= 0.0:
            raise InvalidValueError(f"occlusion_s must be above 0, not {self.occlusion_s}")

    @classmethod
    def none(cls) -> Variability:
        """Return no variation at all: every execution the same, measured without defects."""
        return cls(
            duration=0.0, amplitude=0.0, joint_amplitude=0.0, timing_s=0.0, side_lag_s=0.0,
            scatter_rad=0.0, placement_m=0.0, drift_rad=0.0, sway=0.0, fluid=0.0, pause=0.0,
            dwell_s=(0.1, 0.1), noise_m=0.0, occlusion=0.0,
        )  # fmt: skip

"""From a stream of markers to the learner's features: gaps, calibration, inverse kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mplearn.errors import FrameError, InvalidValueError
from mplearn.recording import FloatArray

from .body import Body
from .features import feature_channels, features_of
from .first_posture import TooFewMarkersError
from .inverse_kinematics import IKConfig, InverseKinematics
from .robot import robot_body

if TYPE_CHECKING:
    from mplearn.mocap.gaps import GapTracker

PATIENCE = 5  # times the calibration's length that a stream may take to show its markers


class MotionObserver:
    """Watches a person: marker frames in, features of the robot's posture out.

    The first frames are gathered until the person's size is known; then all of them come out at
    once, and from there on one for each frame. Features are finite and continuous, whatever is
    missing.

    Args:
        marker_names: Names of the M markers of every frame.
        rate_hz: Frames per second [1/s].
        body: The body to see the person as; the robot where not given.
        calibration_s: How long to gather before the first features [s].
        config: Assumptions of the inverse kinematics.
        fill_gaps: Whether markers are followed through their gaps first (`GapTracker`).

    Attributes:
        channels: Names of the features; see `feature_channels`.
        ik: The inverse kinematics, for residuals and uncertainty.

    Raises:
        BodyError: The markers belong to no known set.
    """

    def __init__(
        self,
        marker_names: Sequence[str],
        rate_hz: float,
        body: Body | None = None,
        *,
        calibration_s: float = 0.6,
        config: IKConfig | None = None,
        fill_gaps: bool = True,
    ) -> None:
        if not 0.05 <= calibration_s <= 10:
            raise InvalidValueError(f"calibration_s must lie in [0.05, 10] s, not {calibration_s}")
        self.body = body or robot_body()
        self.marker_names = tuple(marker_names)
        self.rate_hz = float(rate_hz)
        self.calibration_s = calibration_s
        self.ik = InverseKinematics(self.body, marker_names, rate_hz=rate_hz, config=config)
        self.channels = feature_channels(self.body)
        self.fill_gaps = fill_gaps
        self._gaps: GapTracker | None = None
        if fill_gaps:
            from mplearn.mocap.gaps import GapTracker

            self._gaps = GapTracker(len(self.marker_names), self.rate_hz)
        self._gathered: list[FloatArray] = []
        self._last_pitch = 0.0

    def update(self, frame: FloatArray) -> FloatArray:
        """Take one frame and return the features of those that are ready.

        Args:
            frame: Markers x, y, z in turn, shape (3M,) [m]; NaN where missing.

        Returns:
            Shape (k, D): k = 0 while gathering, then all gathered frames at once, then k = 1.

        Raises:
            FrameError: The frame has another width, or holds infinite values.
            BodyError: The markers cannot be a person's, with the reason.
        """
        frame = np.asarray(frame, dtype=np.float64)
        if frame.shape != (3 * len(self.marker_names),):
            raise FrameError(
                f"a frame must have shape ({3 * len(self.marker_names)},) for "
                f"{len(self.marker_names)} markers, not {frame.shape}"
            )
        if np.isinf(frame).any():
            raise FrameError("a frame holds infinite values; a missing marker is NaN")
        markers = frame.reshape(-1, 3)
        if self.ik.calibration is not None:
            return self._follow(markers[None])
        self._gathered.append(markers.copy())
        needed = max(2, round(self.calibration_s * self.rate_hz))
        if len(self._gathered) % needed:
            return np.empty((0, len(self.channels)))
        try:
            return self.flush()
        except TooFewMarkersError:
            if len(self._gathered) >= PATIENCE * needed:
                raise
            return np.empty((0, len(self.channels)))

    def flush(self) -> FloatArray:
        """Return the features of what is gathered, as at the end of a short stream, shape (k, D).

        Raises:
            BodyError: The gathered frames are no calibration, with the reason.
        """
        if not self._gathered:
            return np.empty((0, len(self.channels)))
        gathered = np.array(self._gathered)
        self.ik.calibrate(gathered)
        self._gathered.clear()
        return self._follow(gathered)

    def observe(self, frames: FloatArray) -> FloatArray:
        """Return the features of a whole recording, shape (T, 3M) to (T, D), as the loop does."""
        parts = [self.update(frame) for frame in frames]
        parts.append(self.flush())
        return np.concatenate(parts)

    def _follow(self, frames: FloatArray) -> FloatArray:
        if self._gaps is not None:
            frames = np.array([self._gaps.update(markers) for markers in frames])
        features = features_of(np.array([self.ik.update(markers) for markers in frames]), self.body)
        for row in features:  # the pitch is an angle of the whole circle: keep it continuous
            row[2] += 2 * np.pi * np.round((self._last_pitch - row[2]) / (2 * np.pi))
            self._last_pitch = float(row[2])
        return features

    def state(self) -> dict[str, Any]:
        """Return what `load_state` needs to resume bit for bit."""
        return {
            "ik": self.ik.state(),
            "gaps": None if self._gaps is None else self._gaps.state(),
            "gathered": np.array(self._gathered).reshape(-1, len(self.marker_names), 3),
            "last_pitch": self._last_pitch,
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned."""
        self.ik.load_state(state["ik"])
        if self._gaps is not None:
            self._gaps.load_state(state["gaps"])
        self._gathered = list(np.array(state["gathered"], dtype=np.float64))
        self._last_pitch = float(state["last_pitch"])

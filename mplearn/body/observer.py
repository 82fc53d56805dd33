"""From a stream of markers to the learner's features: who is there, gaps, inverse kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mplearn.errors import BodyError, FrameError, InvalidValueError
from mplearn.recording import FloatArray

from .body import Body
from .features import feature_channels, features_of
from .first_posture import TooFewMarkersError
from .identity import BodyIdentity, IdentityConfig
from .inverse_kinematics import IKConfig
from .resuming import ResumingKinematics
from .robot import robot_body

if TYPE_CHECKING:
    from mplearn.mocap.gaps import GapTracker

PATIENCE = 5  # times the calibration's length that a stream may take to show its markers


class MotionObserver:
    """Watches people, one at a time: marker frames in, features of the robot's posture out.

    The first frames are gathered until the person's size is known; then all of them come out at
    once, and from there on one for each frame. Features are finite and continuous, whatever is
    missing.

    Where another body seems to stand there (`BodyIdentity`), frames are held back for a tenth of a
    second, until it is known whose they are: a known person is followed on the body that was fitted
    before; to a newcomer one is fitted, from as many frames as to the first.

    Args:
        marker_names: Names of the M markers of every frame.
        rate_hz: Frames per second [1/s].
        body: The body to see the person as; the robot where not given.
        calibration_s: How long to gather before the first features [s].
        config: Assumptions of the inverse kinematics.
        fill_gaps: Whether markers are followed through their gaps first (`GapTracker`).
        identity: What is assumed of people.

    Attributes:
        identity: Who is there, and who is known.
        arrivals: How often somebody came, or came back: features before and after do not join.
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
        identity: IdentityConfig | None = None,
    ) -> None:
        if not 0.05 <= calibration_s <= 10:
            raise InvalidValueError(f"calibration_s must lie in [0.05, 10] s, not {calibration_s}")
        self.body = body or robot_body()
        self.marker_names = tuple(marker_names)
        self.rate_hz = float(rate_hz)
        self.calibration_s = calibration_s
        self.ik = ResumingKinematics(self.body, marker_names, rate_hz=rate_hz, config=config)
        self.channels = feature_channels(self.body)
        self.fill_gaps = fill_gaps
        self.identity = BodyIdentity(self.marker_names, self.rate_hz, identity)
        self._known: dict[int, dict[str, Any]] = {}  # each person's body, as last seen
        self._gaps: GapTracker | None = None
        self._held: list[FloatArray] = []
        self._last_pitch = 0.0
        self.arrivals = 0
        self._begin()

    @property
    def person(self) -> int:
        """Number of the person whose features were returned last; -1 before the first."""
        return self.identity.person

    def restart(self) -> None:
        """Begin another stream: whoever comes is measured again, and recognised."""
        if not self._measuring:
            self._known[self.identity.person] = self.ik.state()
        self.identity.leave()
        self.ik.load_state({"calibration": None})
        self._held.clear()
        self._begin()

    def update(self, frame: FloatArray) -> FloatArray:
        """Take one frame and return the features of those that are ready.

        Args:
            frame: Markers x, y, z in turn, shape (3M,) [m]; NaN where missing.

        Returns:
            Shape (k, D): k = 0 while frames are held back, then all of them at once, then k = 1.
            They are those of one person.

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
        if not self._measuring:
            if not self._held and not self.identity.doubts(markers):
                return self._follow(markers[None])
            self._held.append(markers.copy())
            return self._decide()
        self._held.append(markers.copy())
        if len(self._held) % self._needed:
            return self._nothing
        try:
            return self.flush()
        except BodyError as error:
            if isinstance(error, TooFewMarkersError) or self._known:
                if len(self._held) < PATIENCE * self._needed:
                    return self._nothing
                self._held.clear()
            raise

    def flush(self) -> FloatArray:
        """Return the features of what is held back, as at the end of a stream, shape (k, D).

        Raises:
            BodyError: The gathered frames are no calibration, with the reason.
        """
        if not self._held:
            return self._nothing
        held = np.array(self._held)
        if self._measuring:
            self.ik.calibrate(held[-PATIENCE * self._needed :])
            self._meet(held)
        else:
            self.identity.stay()
        self._held.clear()
        return self._follow(held)

    def observe(self, frames: FloatArray) -> FloatArray:
        """Return the features of a whole recording, shape (T, 3M) to (T, D), as the loop does."""
        parts = [self.update(frame) for frame in frames]
        parts.append(self.flush())
        return np.concatenate(parts)

    # ---- inside

    @property
    def _needed(self) -> int:
        return max(2, round(self.calibration_s * self.rate_hz))

    @property
    def _measuring(self) -> bool:
        return self.ik.calibration is None

    @property
    def _nothing(self) -> FloatArray:
        return np.empty((0, len(self.channels)))

    def _begin(self) -> None:
        """Begin with another body."""
        self._last_pitch = 0.0
        if self.fill_gaps:
            from mplearn.mocap.gaps import GapTracker

            self._gaps = GapTracker(len(self.marker_names), self.rate_hz)

    def _decide(self) -> FloatArray:
        """Find out whose frames are held back, if there are enough of them."""
        look, held = self.identity.look_frames, np.array(self._held)
        if len(held) < look:
            return self._nothing
        person = self.identity.decide(held)
        if person is None and len(held) < PATIENCE * look:
            return self._nothing
        if person is None or person == self.identity.person:
            self.identity.stay()
        else:
            self._known[self.identity.person] = self.ik.state()
            self._begin()
            if person not in self._known:
                self.ik.load_state({"calibration": None})
                return self._nothing
            seen = np.isfinite(held).all(axis=2).sum(axis=1)
            self.ik.resume(self._known[person], held[int(np.argmax(seen >= 0.9 * seen.max()))])
            self._take_up(person, held)
        self._held.clear()
        return self._follow(held)

    def _meet(self, held: FloatArray) -> None:
        """Find out who it is that was measured."""
        self.identity.leave()
        person = self.identity.decide(held)
        self._take_up(0 if person is None else person, held)

    def _take_up(self, person: int, held: FloatArray) -> None:
        self.identity.meet(person)
        for markers in held:
            self.identity.doubts(markers)
        self._known.setdefault(person, self.ik.state())
        self.arrivals += 1

    def _follow(self, frames: FloatArray) -> FloatArray:
        if self._gaps is not None:
            frames = np.array([self._gaps.update(markers) for markers in frames])
        features = features_of(np.array([self.ik.update(markers) for markers in frames]), self.body)
        for row in features:  # the pitch is an angle of the whole circle: keep it continuous
            row[2] += 2 * np.pi * np.round((self._last_pitch - row[2]) / (2 * np.pi))
            self._last_pitch = float(row[2])
        return features

    def unite(self, other: MotionObserver) -> dict[int, int]:
        """Take over the people whom another has seen; return their numbers here."""
        numbers = self.identity.bodies.unite(other.identity.bodies)
        for person, body in other._known.items():
            if person in numbers:
                self._known.setdefault(numbers[person], body)
        return numbers

    def state(self) -> dict[str, Any]:
        """Return what `load_state` needs to resume bit for bit."""
        return {
            "ik": self.ik.state(),
            "gaps": None if self._gaps is None else self._gaps.state(),
            "held": np.array(self._held).reshape(-1, len(self.marker_names), 3),
            "last_pitch": self._last_pitch,
            "arrivals": self.arrivals,
            "identity": self.identity.state(),
            "known": [[person, state] for person, state in self._known.items()],
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned."""
        self.ik.load_state(state["ik"])
        if self._gaps is not None:
            self._gaps.load_state(state["gaps"])
        self._held = list(np.array(state["held"], dtype=np.float64))
        self._last_pitch = float(state["last_pitch"])
        self.arrivals = int(state["arrivals"])
        self.identity.load_state(state["identity"])
        self._known = {int(person): kept for person, kept in state["known"]}

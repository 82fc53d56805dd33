"""From a stream of markers to the learner's features: who is there, gaps, inverse kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from mplearn.errors import BodyError, FrameError, InvalidValueError
from mplearn.gaps import GapTracker
from mplearn.gaps.tracker import GapsState
from mplearn.recording import BoolArray, FloatArray
from mplearn.state import Array, Count, State, require, validated, within

from ..inverse_kinematics.inverse_kinematics import (
    FEWEST_MARKERS,
    FollowedState,
    IKConfig,
    InverseKinematics,
)
from ..models.body import Body
from ..models.robot import robot_body
from ..views.features import feature_channels, features_of, join_angles
from .axes import Axes, axes_changed
from .identity import NOBODY, BodyIdentity, IdentityConfig, IdentityState

BLOCK_FRAMES = 128  # that are handed on at once, at most
PATIENCE = 5  # times the calibration's length that a stream may take to show its markers
FARTHEST = 1e9  # no marker is, in any unit
NEWCOMER = 2  # times that length for which another body must be seen to be somebody new's
ODD = "the markers are not where they can be on this person"
NO_BODY = "the markers are not where they can be on any person"
BRIEF = "another body was seen for too short a time to be a person"
UNSEEN = "too few markers are in sight"


class Watched(NamedTuple):
    """What became of frames.

    Attributes:
        features: Of the robot's posture, of one person, shape (k, D).
        lost: Which of them only go on from what was seen before, shape (k,).
        why: The reason, where some are lost, or dropped.
        dropped: Frames before these that have no features: nobody could be measured in them.
        error: Why not.
        joins: Whether the features go on from those before.
        moved: A change of the stream's axes that was found, and is undone from here on.
        taken: How many of the frames given were taken.

    Example:
        >>> from mplearn.body import MotionObserver
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR"], seed=1).recording
        >>> observer = MotionObserver(take.marker_names, rate_hz=take.rate_hz)
        >>> seen = observer.watch(take.frames)  # who is there is not known yet
        >>> seen.taken, seen.features.shape
        (1, (0, 33))
        >>> features = observer.observe(take.frames[1:])
        >>> seen = observer.watch(take.frames)
        >>> seen.taken == len(take) == len(seen.features)
        True
    """

    features: FloatArray
    lost: BoolArray
    why: str = ""
    dropped: int = 0
    error: BodyError | None = None
    joins: bool = True
    moved: Axes | None = None
    taken: int = 0


@dataclass(frozen=True, eq=False)
class KnownState(State):
    """A person's body, as last seen."""

    person: Count
    body: FollowedState


@dataclass(frozen=True, eq=False)
class ObserverState(State):
    """Who is watched, and who was.

    Attributes:
        ik: The person who is followed; None before the first.
        gaps: The markers' tracks; None where gaps are not filled.
        held: Frames that are held back, shape (n, M, 3) [m].
        sound: Which of the held frames show a body, while somebody is measured, shape (n,).
        measuring: Whether somebody is measured.
        axes: What of a stream's changes of axes is undone.
        last_pitch: Pitch of the last features [rad].
        arrivals: How often somebody came, or came back.
        identity: Who is there.
        known: The bodies of all who were seen.

    Example:
        >>> from mplearn.body import MotionObserver
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR"], seed=1).recording
        >>> observer = MotionObserver(take.marker_names, rate_hz=take.rate_hz)
        >>> features = observer.observe(take.frames)
        >>> later = MotionObserver(take.marker_names, rate_hz=take.rate_hz)
        >>> later.load_state(observer.state())  # goes on with the same person
        >>> later.person, later.state().measuring
        (0, False)
    """

    ik: FollowedState | None
    gaps: GapsState | None
    held: Annotated[FloatArray, Array(None, "m", 3, nan=True)]
    sound: tuple[bool, ...]
    measuring: bool
    axes: Axes | None
    last_pitch: float
    arrivals: Count
    identity: IdentityState
    known: tuple[KnownState, ...]

    def check(self) -> None:
        """Check that who is known is somebody."""
        n, people = self.identity.bodies.n_people, [each.person for each in self.known]
        require(len(set(people)) == len(people), "known", "must be different people")
        for k, person in enumerate(people):
            require(person < n, f"known[{k}].person", f"must be below {n}")
        there = self.identity.person
        require(there < 0 or there in people, "identity.person", f"must be known, not {there}")
        require(there < 0 or self.ik is not None, "ik", f"must be person {there}")
        require(self.measuring or there >= 0, "measuring", "must be true before anybody came")
        held = len(self.held) if self.measuring else 0
        require(len(self.sound) == held, "sound", f"must be {held}, not {len(self.sound)}")


class MotionObserver:
    """Watches people, one at a time: marker frames in, features of the robot's posture out.

    The first frames are gathered until the person's size is known; then all of them come out at
    once, and from there on one for each frame. Features are finite and continuous, whatever is
    missing.

    Where another body seems to stand there (`BodyIdentity`), frames are held back for a tenth of a
    second, until it is known whose they are: a known person is followed on the body that was fitted
    before; to a newcomer one is fitted, from twice as many frames. Frames that show what
    no person can do count as unseen, and where only the stream's axes or its unit have changed,
    that is undone (`axes`).

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
        axes: What of a stream's changes of axes and unit is undone; None for nothing.
        arrivals: How often somebody came, or came back: features before and after do not join.
        channels: Names of the features; see `feature_channels`.
        ik: The inverse kinematics, for residuals and uncertainty.

    Raises:
        BodyError: The markers belong to no known set.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR", "BAL"], seed=1).recording
        >>> observer = MotionObserver(take.marker_names, take.rate_hz)
        >>> features = observer.observe(take.frames)
        >>> features.shape[1] == len(observer.channels)
        True
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
        self.ik = InverseKinematics(self.body, marker_names, rate_hz=rate_hz, config=config)
        self.channels = feature_channels(self.body)
        self.fill_gaps = fill_gaps
        self.identity = BodyIdentity(self.marker_names, self.rate_hz, identity)
        self._known: dict[int, FollowedState] = {}  # each person's body, as last seen
        self._gaps: GapTracker | None = None
        self.axes: Axes | None = None
        self._held: list[FloatArray] = []
        self._sound: list[bool] = []  # of the held frames, while somebody is measured
        self._measuring = True
        self._last_pitch = 0.0
        self.arrivals = 0
        self._begin()

    @property
    def person(self) -> int:
        """Number of the person whose features were returned last; -1 before the first."""
        return self.identity.person

    def restart(self) -> None:
        """Begin another stream: whoever comes is measured again, and recognised."""
        if self.identity.person >= 0:
            self._known[self.identity.person] = self._body_now()
        self.identity.leave()
        self.axes = None
        self._measuring = True
        self._release()
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
        return self._features(self.watch(self._checked(frame[None])))

    def _checked(self, frames: FloatArray) -> FloatArray:
        width = 3 * len(self.marker_names)
        if frames.shape[1:] != (width,):
            raise FrameError(
                f"a frame must have shape ({width},) for {len(self.marker_names)} markers, not "
                f"{frames.shape[1:]}"
            )
        if np.isinf(frames).any():
            raise FrameError("a frame holds infinite values; a missing marker is NaN")
        return frames

    def watch(self, frames: FloatArray) -> Watched:
        """Take the first of some frames, as many as belong together, and say what became of them.

        Args:
            frames: Shape (T, 3M) [m], T > 0; NaN where missing.
        """
        if self._measuring or self._held:
            frames = frames[:1]
        markers = _possible(frames).reshape(len(frames), -1, 3)
        if self.axes is not None:
            markers = self.axes.undo(markers)
        if not self._measuring and not self._held:
            steady = self.identity.follow(markers)
            if steady:
                return self._follow(markers[:steady])._replace(taken=steady)
        self._held.append(markers[0].copy())
        if self._measuring:
            self._sound.append(bool(self.identity.shows_body(markers[:1])[0]))
            watched = self._measure()
        else:
            watched = self._decide()
        return watched._replace(taken=1)

    def flush(self) -> FloatArray:
        """Return the features of what is held back, as at the end of a stream, shape (k, D).

        Raises:
            BodyError: The gathered frames are no calibration, with the reason.
        """
        return self._features(self.finish())

    def finish(self) -> Watched:
        """Say what became of the frames that are held back, as at the end of a stream."""
        if not self._held:
            return self._nothing
        held = np.array(self._held)
        if not self._measuring:
            return self._go_on(held, self.identity.misfits(held, back=True))
        if self.identity.person >= 0 and sum(self._sound) < self._needed:
            return self._lose(held, BRIEF)
        try:
            return self._meet(held)
        except BodyError as error:
            return self._give_up(held, error)

    def observe(self, frames: FloatArray) -> FloatArray:
        """Return the features of a whole recording, shape (T, 3M) to (T, D), as the loop does."""
        frames = self._checked(np.asarray(frames, dtype=np.float64))
        parts = []
        while len(frames):
            watched = self.watch(frames[:BLOCK_FRAMES])
            parts.append(self._features(watched))
            frames = frames[watched.taken :]
        parts.append(self.flush())
        return np.concatenate(parts)

    # ---- inside

    @property
    def _needed(self) -> int:
        """Frames from which a person is measured: a newcomer must have stood there for longer."""
        longer = NEWCOMER if self.identity.person >= 0 else 1
        return longer * max(2, round(self.calibration_s * self.rate_hz))

    @property
    def _nothing(self) -> Watched:
        return Watched(np.empty((0, len(self.channels))), np.zeros(0, dtype=np.bool_))

    def _features(self, watched: Watched) -> FloatArray:
        if watched.error is not None and not len(watched.features):
            raise watched.error
        return watched.features

    def _begin(self) -> None:
        """Begin with another body."""
        self._last_pitch = 0.0
        if self.fill_gaps:
            self._gaps = GapTracker(len(self.marker_names), self.rate_hz)

    def _release(self) -> None:
        self._held.clear()
        self._sound.clear()

    def _decide(self) -> Watched:
        """Find out whose frames are held back, if there are enough of them."""
        look, held = self.identity.look_frames, np.array(self._held)
        if self.identity.returned(held):
            return self._go_on(held, self.identity.misfits(held, back=True))
        if len(held) < look:
            return self._nothing
        change = self._axes_changed(held)
        if change is not None:
            self.axes = change if self.axes is None else self.axes.then(change)
            held = change.undo(held)
            return self._go_on(held, self.identity.misfits(held, back=True))._replace(moved=change)
        person = self.identity.decide(held[-look:])
        if person is None and len(held) < PATIENCE * look:
            return self._nothing
        if person == NOBODY:
            return self._lose(held[: len(held) - look // 2], NO_BODY)
        wrong = self.identity.misfits(held, back=False)
        if person is None or person == self.identity.person:
            return self._go_on(held, wrong)
        if person in self._known:
            return self._change(person, held, wrong)
        self._measuring = True
        self._sound = [not each for each in wrong]
        return self._nothing

    def _axes_changed(self, held: FloatArray) -> Axes | None:
        """Return the change of the stream's axes that explains frames in doubt, if one does."""
        identity = self.identity
        if identity.absent or identity.went_on(held) or identity.about_there(held[0]):
            return None
        change = axes_changed(held[0], self.identity.places)
        fits = change is not None and self.identity.went_on(change.undo(held))
        return change if fits else None

    def _go_on(self, held: FloatArray, wrong: BoolArray) -> Watched:
        """Go on with the same person after a doubt."""
        self.identity.skip(int(np.argmin(wrong)))
        joins = self.identity.joins(held[~wrong])
        if not joins:
            self._begin()
            self.ik.resume(self._body_now(), _fullest(held[~wrong]))
        self.identity.stay(held[~wrong])
        self._measuring = False
        self._release()
        return self._follow(held, wrong, ODD)._replace(joins=joins)

    def _change(self, person: int, held: FloatArray, wrong: BoolArray) -> Watched:
        """Go on with somebody else who is known."""
        self._known[self.identity.person] = self._body_now()
        self._begin()
        self.ik.resume(self._known[person], _fullest(held[~wrong]))
        self._measuring = False
        self._take_up(person, held[~wrong])
        self._release()
        return self._follow(held, wrong, ODD)._replace(joins=False)

    def _lose(self, lost: FloatArray, why: str) -> Watched:
        """Let frames pass as if nothing had been seen in them; later ones stay held back."""
        self._measuring = False
        self._held = self._held[len(lost) :]
        self._sound.clear()
        self.identity.skip(len(lost))
        return self._follow(lost, np.ones(len(lost), dtype=np.bool_), why)

    def _measure(self) -> Watched:
        """Measure who is there, once there are enough frames; unless somebody known is back."""
        before, look = self.identity.person, self.identity.look_frames
        if before >= 0 and len(self._held) % look == 0:
            person = self.identity.decide(np.array(self._held[-look:]))
            if person is not None and 0 <= person < self.identity.n_people:
                held = np.array(self._held)
                wrong = self.identity.misfits(held, back=False, like=look)
                if person == before:
                    return self._go_on(held, wrong)
                return self._change(person, held, wrong)
        error: BodyError | None = None
        given_up = len(self._held) >= PATIENCE * self._needed
        if given_up or (self._sound[-1] and sum(self._sound) % self._needed == 0):
            try:
                return self._meet(np.array(self._held))
            except BodyError as failed:
                error = failed
        if given_up and error is not None:
            return self._give_up(np.array(self._held), error)
        return self._nothing

    def _give_up(self, held: FloatArray, error: BodyError) -> Watched:
        """Lose frames to which no body could be fitted."""
        if self.identity.person >= 0:
            return self._lose(held, str(error))._replace(error=error)
        self._release()
        return self._nothing._replace(dropped=len(held), why=str(error), error=error)

    def _meet(self, held: FloatArray) -> Watched:
        """Fit a body to the frames that are held back, and find out whose it is.

        Raises:
            BodyError: None fits, with the reason; nothing has changed then.
        """
        sound = np.array(self._sound)
        if 2 * sound.sum() < self._needed:
            sound[:] = True  # nothing is: the reason is told by trying, or there are too few
        wrong = ~sound
        wrong[sound] = self.identity.misfits(held[sound], back=False)
        if wrong.all():
            raise BodyError("the markers are in no frame as far apart as in most of the others")
        if self.identity.person >= 0:
            self._known[self.identity.person] = self._body_now()
        self.ik.calibrate(held[~wrong][-PATIENCE * self._needed :])
        self._begin()
        self.identity.leave()
        person = self.identity.decide(held[~wrong])
        if person is None or not 0 <= person < self.identity.n_people:
            person = self.identity.newcomer
        self._measuring = False
        self._take_up(person, held[~wrong])
        self._release()
        return self._follow(held, wrong, ODD)._replace(joins=False)

    def _take_up(self, person: int, held: FloatArray) -> None:
        self.identity.meet(person)
        for markers in held:
            self.identity.follow(markers[None])
        self._known.setdefault(person, self._body_now())
        self.arrivals += 1

    def _follow(self, frames: FloatArray, wrong: BoolArray | None = None, why: str = "") -> Watched:
        """Return the features of frames, shape (k, M, 3); what is wrong is not looked at."""
        if wrong is None:
            wrong = np.zeros(len(frames), dtype=np.bool_)
        frames = np.where(wrong[:, None, None], np.nan, frames)
        filled = frames if self._gaps is None else self._gaps.update_many(frames)
        features = features_of(self.ik.update_many(filled), self.body)
        self._last_pitch = float(join_angles(features[:, 2], self._last_pitch))
        unseen = np.isfinite(frames).all(axis=2).sum(axis=1) < FEWEST_MARKERS
        return Watched(features, unseen, why=why if wrong.any() else UNSEEN)

    def _body_now(self) -> FollowedState:
        """Return the body of the person who is followed."""
        body = self.ik.state()
        assert body is not None
        return body

    def state(self) -> ObserverState:
        """Return what `load_state` needs to resume bit for bit."""
        return ObserverState(
            ik=self.ik.state(),
            gaps=None if self._gaps is None else self._gaps.state(),
            held=np.array(self._held).reshape(-1, len(self.marker_names), 3),
            sound=tuple(self._sound),
            measuring=self._measuring,
            axes=self.axes,
            last_pitch=self._last_pitch,
            arrivals=self.arrivals,
            identity=self.identity.state(),
            known=tuple(KnownState(person, body) for person, body in self._known.items()),
        )

    def load_state(self, state: ObserverState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: It is damaged, or of other markers.
        """
        state = validated(state)
        m = len(self.marker_names)
        require(state.held.shape[1] == m, "held", f"must be of {m} markers")
        fills = (state.gaps is None) == (self._gaps is None)
        require(fills, "gaps", f"must be there if gaps are filled: {self.fill_gaps}")
        for k, each in enumerate(state.known):
            with within(f"known[{k}].body"):
                self.ik.check_fits(each.body)
        with within("ik"):
            self.ik.load_state(state.ik)
        if self._gaps is not None and state.gaps is not None:
            with within("gaps"):
                self._gaps.load_state(state.gaps)
        with within("identity"):
            self.identity.load_state(state.identity)
        self._held, self._sound = list(state.held.copy()), list(state.sound)
        self._measuring, self.axes = state.measuring, state.axes
        self._last_pitch, self.arrivals = state.last_pitch, state.arrivals
        self._known = {each.person: each.body for each in state.known}


def _possible(frames: FloatArray) -> FloatArray:
    """Return frames with NaN for what is no place in any unit."""
    with np.errstate(invalid="ignore"):
        absurd = np.abs(frames) > FARTHEST
    return np.where(absurd, np.nan, frames) if absurd.any() else frames


def _fullest(frames: FloatArray) -> FloatArray:
    """Return the first of some frames, shape (k, M, 3), in which nearly most markers are seen."""
    seen = np.isfinite(frames).all(axis=2).sum(axis=1)
    return np.asarray(frames[int(np.argmax(seen >= 0.9 * seen.max()))])

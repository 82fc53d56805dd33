"""Who is watched, by which markers: an observer for each set of them, people numbered together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..body import MotionObserver, ObserverState
from ..body.marker_sets.marker_set import WATCHED_SHARE, plain_name
from ..errors import FrameError
from ..recording import FloatArray, IntArray, are_markers
from ..state import Count, State, require, within


@dataclass(frozen=True, eq=False)
class WatchState(State):
    """What was seen by one set of markers.

    Attributes:
        channels: Columns of its markers.
        people: The learner's number of each person that it has seen.
        observer: What it knows of them.
    """

    channels: tuple[str, ...]
    people: tuple[Count, ...]
    observer: ObserverState

    def check(self) -> None:
        """Check that everybody has a number."""
        n, met = len(self.people), self.observer.identity.bodies.n_people
        require(len(set(self.people)) == n == met, "people", f"must be {met} different numbers")


@dataclass(eq=False)
class Watch:
    """An observer, and the learner's number of each person that it has seen."""

    channels: tuple[str, ...]
    observer: MotionObserver
    people: list[int]

    @classmethod
    def by(cls, channels: tuple[str, ...], rate_hz: float) -> Watch:
        """Watch by columns of markers.

        Raises:
            BodyError: The markers belong to no known set.
        """
        names = tuple(channel[:-2] for channel in channels[::3])
        return cls(channels, MotionObserver(names, rate_hz), [])

    @property
    def person(self) -> int:
        """The learner's number of the person who was seen last; -1 before the first."""
        person = self.observer.person
        return self.people[person] if person >= 0 else -1

    def state(self) -> WatchState:
        """Return what `Watching.load_state` needs."""
        return WatchState(self.channels, tuple(self.people), self.observer.state())


class Watching:
    """Watches streams that have different markers, one after the other.

    Who is known by one set of markers is not known by another: distances within a body do not
    compare. So each has an observer and people of its own, with numbers that all share.

    Args:
        channels: Columns of the first stream's markers.
        rate_hz: Frames per second, of all streams [1/s].

    Attributes:
        watches: An observer for each set of markers, in the order of their coming.
        watch: What watches the stream that goes on.
        channels: Columns of the stream that goes on.
        n_people: How many people were seen.

    Raises:
        BodyError: The markers belong to no known set.

    Example:
        >>> from mplearn.body import marker_set
        >>> from mplearn.recording import marker_channels
        >>> watching = Watching(marker_channels(marker_set("plug_in_gait39").names), rate_hz=100.0)
        >>> watching.n_people, len(watching.watches)
        (0, 1)
    """

    def __init__(self, channels: tuple[str, ...], rate_hz: float) -> None:
        self.rate_hz = rate_hz
        self.watches: list[Watch] = []
        self.n_people = 0
        self.turn_to(Watch.by(channels, rate_hz), channels)

    @property
    def observer(self) -> MotionObserver:
        """The observer of the stream that goes on."""
        return self.watch.observer

    def find(self, channels: tuple[str, ...]) -> Watch:
        """Return what can watch a stream that has these columns; nothing has changed yet.

        It is the first whose markers they are, or most of them, in any order; or a new one.

        Raises:
            FrameError: They are not columns of markers.
            BodyError: The markers belong to no known set.
        """
        if not are_markers(channels):
            raise FrameError(
                f"a stream of markers has columns 'NAME.x', 'NAME.y', 'NAME.z', not "
                f"{', '.join(channels[:3])}, ...: the learner observes a body"
            )
        for watch in self.watches:
            if _columns(channels, watch.channels) is not None:
                return watch
        return Watch.by(channels, self.rate_hz)

    def turn_to(self, watch: Watch, channels: tuple[str, ...]) -> None:
        """Go on with a stream that has these columns, watched by what `find` returned for them."""
        if watch not in self.watches:
            self.watches.append(watch)
        self.watch, self.channels = watch, channels
        self._columns = None if channels == watch.channels else _columns(channels, watch.channels)

    def arranged(self, frames: FloatArray) -> FloatArray:
        """Return frames of the stream, shape (T, D), as its observer has them; NaN for the rest."""
        if self._columns is None:
            return frames
        arranged = np.full((len(frames), len(self.watch.channels)), np.nan)
        arranged[:, self._columns] = frames
        return arranged

    def meet(self) -> bool:
        """Number the person who is there now; say whether that is somebody new."""
        watch = self.watch
        new = watch.observer.person >= len(watch.people)
        if new:
            watch.people.append(self.n_people)
            self.n_people += 1
        return new

    def state(self) -> tuple[WatchState, ...]:
        """Return what was seen, by each set of markers."""
        return tuple(watch.state() for watch in self.watches)

    def load_state(self, states: Sequence[WatchState], channels: tuple[str, ...]) -> None:
        """Resume from what `state` returned, in a stream that has these columns."""
        watches = []
        fresh = {watch.channels: watch for watch in self.watches if not watch.people}
        for k, state in enumerate(states):
            with within(f"watches[{k}]"):
                require(are_markers(state.channels), "channels", "must be columns of markers")
                watch = fresh.pop(state.channels, None) or Watch.by(state.channels, self.rate_hz)
                with within("observer"):
                    watch.observer.load_state(state.observer)
                watch.people.extend(state.people)
                watches.append(watch)
        known = [watch for watch in watches if _columns(channels, watch.channels) is not None]
        fits = are_markers(channels) and bool(known)
        require(fits, "stream", "must have the columns of a watch")
        self.watches = watches
        self.n_people = sum(len(watch.people) for watch in watches)
        self.turn_to(known[0], channels)


def _columns(channels: tuple[str, ...], known: tuple[str, ...]) -> IntArray | None:
    """Return where a stream's columns are among an observer's; None if it cannot watch them."""
    place = {plain_name(channel): i for i, channel in enumerate(known)}
    columns = [place.get(plain_name(channel), -1) for channel in channels]
    if -1 in columns or len(set(columns)) < max(len(columns), WATCHED_SHARE * len(known)):
        return None
    return np.array(columns)

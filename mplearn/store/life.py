"""A learner with all that a life of learning needs around it: commands, undo, history, a store."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..arguments import names_of, path_of, require_kind
from ..closing import Closing
from ..errors import (
    FrameError,
    InvalidValueError,
    NotAStoreError,
    StateError,
    StoreDamagedError,
    StoreWarning,
    StoreWriteError,
)
from ..learner import Event, MotionLearner
from ..learner.events import PrimitiveMerged
from ..library import PrimitiveLibrary
from ..recording import FloatArray, Recording
from ..state import Blob, key_of, validated, within
from .commands import Command, Operation, Redo, Reversal, Undo
from .effects import Effect, Moment
from .journal import Entry, Happening, Journal, happenings_of
from .labels import Labels, named
from .life_state import LifeState, SourcesState
from .records import Begin, Done, End, Frames, Log, Record
from .rows import record_of
from .store import Found, Store

_CHUNK_S = 1.0  # of frames that are written together


class LifelongLearner(Closing):
    """The one object through which a learner, its commands and its store are used.

    Args:
        learner: What learns. From now on only this object changes it.
        store: Where all is kept; None keeps it in memory only.
        done: Keys of the recordings that it has learned (`source_key`), and will not learn again.

    Attributes:
        learner: To look at.
        number: Number of the next command.
        labels: Names and notes.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, Note
        >>> life = LifelongLearner(MotionLearner(LearnerConfig(("x", "y"))))
        >>> events = life.learn_many(np.zeros((200, 2)))
        >>> life.execute(Note("nobody there yet"), by="Anna").number
        1
        >>> life.undo(by="Anna").command
        Undo(entry=1)
    """

    def __init__(
        self, learner: MotionLearner, store: Log | None = None, done: Sequence[str] = ()
    ) -> None:
        require_kind("learner", learner, MotionLearner)
        if store is not None and not callable(getattr(store, "append", None)):
            raise InvalidValueError(
                f"store must be an opened Store, or None, not {store!r:.60}: "
                "LifelongLearner.open(path, create) opens a file"
            )
        self.learner = learner
        self.labels = Labels()
        self.store = store
        self._journal = Journal()
        self._sources = SourcesState(names_of("done", done))
        self._source, self._taken = "", 0
        self._chunk: list[FloatArray] = []
        self._chunk_frame, self._chunk_when = learner.n_frames, 0.0
        self._chunk_frames = max(1, round(_CHUNK_S * learner.config.rate_hz))
        self._n_chunk = 0
        self._revision = 0
        self._shown: tuple[int, PrimitiveLibrary] | None = None

    @classmethod
    def open(
        cls,
        path: str | Path,
        create: Callable[[], MotionLearner | LifelongLearner] | None = None,
        *,
        checkpoint_s: float = 30.0,
        salvage: bool = False,
    ) -> LifelongLearner:
        """Open a store, and go on where it was left, however that came about.

        `close` it, or use it in a ``with``; a process that ends without loses a second at most.

        Args:
            path: The file.
            create: Makes the learner of a new store; None where there must be one.
            checkpoint_s: Time of stream between checkpoints [s]: so much is learned again from the
                log at opening, at most.
            salvage: Whether to be content with what comes before damage.

        Raises:
            StoreError: It cannot be opened; the class says why.
        """
        path = path_of("path", path)
        if create is not None and not callable(create):
            raise InvalidValueError(
                f"create must make a learner when called, not be {create!r:.60}"
            )
        if create is None and not path.exists():
            raise NotAStoreError(f"there is no store {path}")
        store = Store(path, checkpoint_s=checkpoint_s)
        try:
            found = store.load(salvage=salvage)
            if found is None:
                if create is None:
                    raise NotAStoreError(f"{path} holds no store: it was never finished")
                made = create()
                life = made if isinstance(made, LifelongLearner) else cls(made)
            else:
                life = cls.of_found(found)
                if found.damage:
                    warnings.warn("; ".join(found.damage), StoreWarning, stacklevel=2)
            store.start(found, life.state, life.learner.config.rate_hz)
        except BaseException:
            store.close()
            raise
        life.store = store
        return life

    @classmethod
    def of_found(cls, found: Found, *, lazily: bool = False) -> LifelongLearner:
        """Return what a store held: its checkpoint, and what was learned since.

        Args:
            found: That.
            lazily: See `MotionLearner.from_state`.

        Raises:
            StoreDamagedError: They do not fit each other.
        """
        try:
            life = cls.from_state(found.state, lazily=lazily)
            for row in found.rows:
                life.replay(record_of(row))
        except StateError as error:
            raise StoreDamagedError(f"what the store holds cannot be: {error}") from error
        return life

    def close(self) -> None:
        """Close what is open, and the store, in which all is kept.

        Raises:
            StoreWriteError: Not all could be written.
        """
        if isinstance(self.store, Store):
            self._close_chunk()
            store, self.store = self.store, None
            store.close(self.state())

    def flush(self) -> None:
        """Wait until all that was learned so far is in the store.

        Raises:
            StoreWriteError: It could not be written; it is tried again.
        """
        if isinstance(self.store, Store):
            self._close_chunk()
            if not self.store.flush():
                raise StoreWriteError(f"{self.store.path} cannot be written: {self.store.problem}")

    # ---- learning

    def learn_one(self, frame: FloatArray, time_s: float | None = None) -> list[Event]:
        """Take the next frame, shape (D,), as `learn_many` takes many."""
        frame = np.asarray(frame, dtype=np.float64)
        return self.learn_many(frame[None], None if time_s is None else [time_s])

    def learn_many(
        self, frames: FloatArray, times: Sequence[float] | FloatArray | None = None
    ) -> list[Event]:
        """Take frames of the stream, shape (T, D); return what came of them.

        Args:
            frames: The frames; NaN is a missing measurement.
            times: When each was taken, shape (T,) [s since 1970]; by the clock where not given. By
                them happenings are dated; they decide nothing, and may jump.

        Raises:
            FrameError: The frames have the wrong width, or there are not as many times.
        """
        frames = np.asarray(frames, dtype=np.float64)
        if times is not None and len(times) != len(frames):
            raise FrameError(f"{len(frames)} frames need as many times, not {len(times)}")
        events: list[Event] = []
        at = 0
        while at < len(frames):
            if not self._n_chunk:
                when = time.time() if times is None else float(times[at])
                self._chunk_when = when if np.isfinite(when) else 0.0
                self._chunk_frame = self.learner.n_frames
            part = frames[at : at + self._chunk_frames - self._n_chunk]
            events += self._happened(self.learner.learn_many(part))
            at += len(part)
            self._taken += len(part) if self._source else 0
            self._n_chunk += len(part)
            if self.store is not None:
                self._chunk.append(part.copy())
            if self._n_chunk == self._chunk_frames:
                self._close_chunk()
        return events

    def end_stream(self) -> list[Event]:
        """Close what is open: what comes next is another stream, perhaps of another person."""
        return self._turn(End())

    def begin_stream(self, channels: Sequence[str]) -> list[Event]:
        """End the stream, and go on with one of these channels; see `MotionLearner.begin_stream`.

        Raises:
            FrameError: No such stream can be learned; nothing has changed then.
            BodyError: Its markers belong to no known set; nothing has changed then.
        """
        return self._turn(Begin(tuple(channels)))

    def learn_recording(self, recording: Recording, at_once: int = 50) -> Iterator[list[Event]]:
        """Learn a recording as a stream of its own; yield the events of each part.

        What was learned of it before, and is kept, is not learned again: a recording that was
        learned to its end yields nothing, one that was interrupted goes on where that was.

        Args:
            recording: The recording.
            at_once: How many frames to take before their events are yielded.

        Raises:
            FrameError: The recording has other channels than can be learned, or another rate.
            BodyError: Its markers belong to no known set.
            InvalidValueError: ``at_once`` is not positive.
        """
        if at_once < 1:
            raise InvalidValueError(f"at_once must be positive, not {at_once}")
        self.learner.check_recording(recording)
        key = source_key(recording)
        if key in self._sources.done:
            return
        if self._source != key:
            yield self._turn(Begin(recording.channels, key))
        while self._taken < len(recording.frames):
            yield self.learn_many(recording.frames[self._taken : self._taken + at_once])
        yield self._turn(Done(key))

    def taken(self, recording: Recording) -> int:
        """Return how many frames of a recording were learned already."""
        key = source_key(recording)
        if key in self._sources.done:
            return len(recording.frames)
        return self._taken if key == self._source else 0

    # ---- commands

    def execute(self, command: Command, by: str = "", when: float | None = None) -> Entry:
        """Do what a person asks; with a store, it is kept once this returns.

        Args:
            command: What is asked (`mplearn.store.commands`).
            by: Who asks.
            when: Clock time [s since 1970]; now, where not given.

        Raises:
            MPLearnError: It cannot be done; nothing has changed then.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> from mplearn.store import Rename
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> life = LifelongLearner(learner)
            >>> life.execute(Rename(1, "up"), by="Anna").number, life.snapshot().names
            (1, ('up', 'P2'))
        """
        when = time.time() if when is None else float(when)
        if not np.isfinite(when):
            raise InvalidValueError(f"when must be finite, not {when}")
        self._close_chunk()
        number, frame = self._journal.next_number, self.learner.n_frames
        entry = Entry(number, command, str(by), when, frame)
        match command:
            case Operation():
                before = Moment.of(self.learner, self.labels)
                command.do(self)
                effect = before.until(Moment.of(self.learner, self.labels))
                self._journal.add(entry, None if effect.is_empty else effect)
                self._note_command(entry, effect)
            case Reversal():
                self._toggle(entry, command)
            case _:
                raise InvalidValueError(f"{command!r} is neither an operation, nor undo, nor redo")
        self._revision += 1
        self._record(entry)
        return entry

    def undo(self, by: str = "", number: int | None = None, when: float | None = None) -> Entry:
        """Undo a command; the last that was done, where none is named.

        Primitives that are gone by it come back with ids, names, exemplars and counts; what was
        learned since stays: it goes to the nearest of those that the command had changed.

        Args:
            by: Who asks.
            number: The command, one of the last hundred.
            when: Clock time [s since 1970]; now, where not given.

        Raises:
            InvalidValueError: It cannot be undone: it is too long ago, undone already, or later
                ones build on it; the message names them.
        """
        return self.execute(Undo(self._chosen(number, undone=False)), by, when)

    def redo(self, by: str = "", number: int | None = None, when: float | None = None) -> Entry:
        """Do a command again that was undone; the last, where none is named.

        Raises:
            InvalidValueError: It cannot be done again; see `undo`.
        """
        return self.execute(Redo(self._chosen(number, undone=True)), by, when)

    # ---- looking

    @property
    def number(self) -> int:
        """Number of the next command."""
        return self._journal.next_number

    @property
    def revision(self) -> int:
        """A number that grows with every change of what is known."""
        return self._revision

    @property
    def n_frames(self) -> int:
        """Frames seen, of all streams."""
        return self.learner.n_frames

    def entries(self, since: int = 0) -> tuple[Entry, ...]:
        """Return the commands with numbers above ``since``, the oldest first; the last thousand."""
        return self._journal.entries(since)

    def reversible(self, *, undone: bool = False) -> tuple[int, ...]:
        """Return the numbers of the commands that `undo` takes; that which is next comes last.

        Args:
            undone: Whether those that `redo` takes are wanted.

        Example:
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> from mplearn.store import Pause
            >>> life = LifelongLearner(MotionLearner(LearnerConfig(("elbow",))))
            >>> entry = life.execute(Pause(), by="Anna")
            >>> life.reversible(), life.reversible(undone=True)
            ((1,), ())
        """
        return tuple(self._journal.reversible(undone=undone))

    def history(self, primitive: int) -> tuple[Happening, ...]:
        """Return what happened to a primitive, the oldest first.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
            >>> life = LifelongLearner(MotionLearner(config))
            >>> events = life.learn_many(swing)
            >>> [happening.what for happening in life.history(1)]
            ['born', 'confirmed']
        """
        return self._journal.history(primitive)

    def snapshot(self, *, shown_once: bool = False) -> PrimitiveLibrary:
        """Return what is known now, frozen, with the names that people gave.

        It is the same object as long as `revision` is the same.

        Args:
            shown_once: Whether motions that were shown once are in it; see
                `MotionLearner.snapshot`.
        """
        if shown_once:
            return self._named(self.learner.snapshot(shown_once=True))
        if self._shown is None or self._shown[0] != self._revision:
            self._shown = self._revision, self._named(self.learner.snapshot())
        return self._shown[1]

    def prepare_snapshot(self) -> bool:
        """Do a part of what a snapshot takes; return whether nothing is left of it.

        See `MotionLearner.prepare_snapshot`.
        """
        return self.learner.prepare_snapshot()

    # ---- keeping

    def state(self) -> LifeState:
        """Return all that is known: `from_state` goes on bit for bit."""
        return LifeState(
            learner=self.learner.state(),
            labels=self.labels.state(),
            journal=self._journal.state(),
            sources=self._sources,
            source=self._source,
            taken=self._taken,
            chunk_frame=self._chunk_frame,
            chunk_when=self._chunk_when,
            revision=self._revision,
        )

    @classmethod
    def from_state(cls, state: LifeState, *, lazily: bool = False) -> LifelongLearner:
        """Return the learner that `state` described.

        Args:
            state: That.
            lazily: See `MotionLearner.from_state`.

        Raises:
            StateError: The state is damaged; its place says where.
        """
        state = validated(state)
        with within("learner"):
            life = cls(MotionLearner.from_state(state.learner, lazily=lazily))
        life.labels = Labels(state.labels)
        with within("journal"):
            life._journal.load_state(state.journal)
        life._sources, life._source, life._taken = state.sources, state.source, state.taken
        life._chunk_frame, life._chunk_when = state.chunk_frame, state.chunk_when
        life._revision = state.revision
        return life

    def replay(self, record: Record) -> None:
        """Do again what a record of the log says.

        Raises:
            StateError: It does not fit what is known.
        """
        try:
            match record:
                case Frames(frames, when):
                    self.learn_many(frames, np.full(len(frames), when))
                    self._close_chunk()
                case End() | Begin() | Done():
                    self._turn(record)
                case Entry(_, command, by, when):
                    self.execute(command, by, when)
        except (FrameError, InvalidValueError) as error:
            raise StateError(f"the log does not fit what is known: {error}") from error

    # ---- inside

    def _turn(self, record: Begin | Done | End) -> list[Event]:
        """Close the stream, and what else there is to do at its end."""
        self._close_chunk()
        learner = self.learner
        if isinstance(record, Begin):
            events = self._happened(learner.begin_stream(record.channels))
        else:
            events = self._happened(learner.end_stream())
        self._source, self._taken = record.key if isinstance(record, Begin) else "", 0
        if isinstance(record, Done):
            self._sources = SourcesState((*self._sources.done, record.key))
        self._record(record)
        return events

    def _happened(self, events: list[Event]) -> list[Event]:
        """Take note of events."""
        for event in events:
            if isinstance(event, PrimitiveMerged):
                self.labels.merged(event.primitive, event.absorbed)
        first, rate_hz = self._chunk_frame, self.learner.config.rate_hz
        for event in events:
            self._journal.happened(
                replace(each, when=self._chunk_when + (each.frame - first) / rate_hz)
                for each in happenings_of(event)
            )
        self._revision += len(events)
        return events

    def _toggle(self, entry: Entry, command: Reversal) -> None:
        undo = isinstance(command, Undo)
        self._chosen(command.entry, undone=not undo)
        kept = self._journal.kept(command.entry)
        assert kept is not None and kept.effect is not None
        effect = kept.effect if undo else kept.effect.reversed()
        effect.take_back(self.learner, self.labels)
        self._journal.add(entry, None)
        self._journal.toggle(command.entry, undo, entry.number)
        self._note_command(entry, effect, kept.entry.command.about)

    def _chosen(self, number: int | None, *, undone: bool) -> int:
        """Return the command to undo, or to redo, if that can be."""
        done = "redone" if undone else "undone"
        able = self._journal.reversible(undone=undone)
        if number is None:
            if not able:
                raise InvalidValueError(f"there is no command that can be {done}")
            number = able[-1]
        kept = self._journal.kept(number)
        if kept is None or kept.effect is None:
            raise InvalidValueError(
                f"command {number} cannot be {done}: it is none, changed nothing, or is too long "
                f"ago; those that can be are {sorted(able)}"
            )
        if kept.entry.undone != undone:
            state = "not undone" if undone else "undone already"
            raise InvalidValueError(f"command {number} is {state}")
        first = self._journal.blocking(number)
        if first:
            steps = (f"{'redo' if each.undone else 'undo'} {each.number}" for each in first)
            raise InvalidValueError(
                f"command {number} cannot be {done} before those that are about the same: first "
                + ", then ".join(steps)
            )
        return number

    def _note_command(self, entry: Entry, effect: Effect, about: Sequence[int] = ()) -> None:
        ids = {*entry.command.about, *about}
        ids |= {id for what, id in effect.touched if what in ("primitive", "name")}
        self._journal.happened(
            Happening(entry.frame, entry.when, "command", id, entry=entry.number)
            for id in sorted(ids)
        )

    def _named(self, library: PrimitiveLibrary) -> PrimitiveLibrary:
        self.labels.tidy(library.ids)
        names = self.labels.shown(self.learner.tree.leaves)
        primitives = (named(each, names.get(each.id, each.name)) for each in library.primitives)
        return replace(library, primitives=tuple(primitives))

    # ---- the store

    def _close_chunk(self) -> None:
        """Write the frames that are to be written together."""
        if not self._n_chunk:
            return
        self._n_chunk = 0
        if self.store is not None:
            frames, self._chunk = np.concatenate(self._chunk), []
            self._record(Frames(frames, self._chunk_when))

    def _record(self, record: Record) -> None:
        if self.store is not None:
            self.store.append(record, self.state)


def source_key(recording: Recording) -> str:
    """Return what a recording is known by: its content and its name."""
    return f"{key_of(Blob(recording.frames))} {recording.name}"

"""The learner: the one place where the stages meet [Kulic2012, Figure 1].

frame of markers -> gap tracking -> inverse kinematics -> segmentation -> tree -> graph -> library
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..arguments import require_kind
from ..body import BodyView, MotionObserver, Watched, feature_channels, robot_body, view_of
from ..body.observer.observer import BLOCK_FRAMES
from ..errors import InvalidValueError
from ..graph import TransitionGraph
from ..library import MotionNovelty, PrimitiveLibrary
from ..people import PeopleTree
from ..recording import BoolArray, FloatArray, Recording, Segment, are_markers
from ..segmentation import make_segmenter
from ..state import from_plain, require, to_plain, validated, within
from ..tree import ROOT, Change, Exchange, MirrorMap, Placement, Recogniser, make_distance
from .absurd import AbsurdFrames
from .buffer import FrameBuffer
from .chain import Chain
from .checks import StreamChecks
from .config import LearnerConfig
from .events import (
    Anomaly,
    AxesChanged,
    Event,
    FramesLost,
    PersonChanged,
    PrimitiveBorn,
    PrimitiveConfirmed,
    PrimitiveForgotten,
    PrimitiveMerged,
    PrimitiveSplit,
    Recognised,
    SegmentClosed,
)
from .foresight import NextMotion
from .known_motions import INSIDE, UNKNOWN, KnownMotions
from .learner_state import FILES, Closing, LearnerState
from .reversal import Known, LearnerEdit
from .shown_once import with_shown_once
from .snapshot import Snapshots
from .watching import Watching

STILL_M = (
    0.02  # a segment in which no part of the body, and no joint's lever, goes farther: a pause
)
BRIDGED_S = 0.3  # a motion goes on through what is lost, if it is no longer
ABSURD = "a value is not finite, or far beyond all that was seen"


class MotionLearner:
    """Learns motion primitives and their order from a stream, frame after frame.

    Nothing looks ahead, and memory does not grow with the stream. `learn_one`, `learn_many`,
    `learn_recording`, `begin_stream` and `end_stream` change what is known; nothing else does.

    Args:
        config: The stream, and how to learn from it.

    Attributes:
        channels: Names of the channels that primitives are made of: the robot's features where
            markers are observed, the stream's own channels otherwise.
        tree: The tree of primitives, of all people.
        graph: The transitions between them.
        n_frames: Frames seen, of all streams.
        watching: Who is watched by which markers; None where channels are learned as they come.
        chain: The latest segments, and which followed which.

    Example:
        >>> import numpy as np
        >>> t = np.arange(1200) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
        >>> for frame in swing:
        ...     for event in learner.learn_one(frame):
        ...         if isinstance(event, PrimitiveBorn):
        ...             print(event.primitive, "is known from frame", event.segment.end)
        1 is known from frame 250
        2 is known from frame 300
        >>> library = learner.snapshot()
        >>> library.graph.n_transitions > 0
        True
    """

    def __init__(self, config: LearnerConfig) -> None:
        require_kind("config", config, LearnerConfig)
        self.config = config
        watches = config.observe == "robot" and are_markers(config.channels)
        self._checks = StreamChecks(config.channels, config.rate_hz, gaps=watches)
        self.watching = Watching(config.channels, config.rate_hz) if watches else None
        self.channels = feature_channels(robot_body()) if watches else config.channels
        self._view = view_of(self.channels)
        width = len(self._view.channels)
        self._segmenter = make_segmenter(config.segmenter, width, config.rate_hz)
        self._buffer = FrameBuffer(width)
        mirror = MirrorMap.of(self._view.channels) if self._body else None
        self.tree = PeopleTree(
            config.tree, width, config.rate_hz, people=config.people, mirror=mirror
        )
        self.graph = TransitionGraph()
        self.chain = Chain(self.graph, config.rate_hz, config.longest_pause_s)
        self._snapshots = Snapshots(self._view, self.channels, config.rate_hz, self._body)
        self.n_frames = 0
        self._stream_start = 0
        self._clock_s: float | None = None
        self._person = -1
        self._lost_from, self._lost_why = -1, ""
        self._absurd = AbsurdFrames(len(config.channels), config.rate_hz)
        self._paused = False
        self._looking: Recogniser | None = None
        self._closing: Closing | None = None  # as long as it may form one primitive more
        self._late: list[Event] = []  # which the next frame brings
        self._under_way = KnownMotions(width, config.rate_hz)

    def __repr__(self) -> str:
        """Return how many primitives of how many people it knows, and what it learns from."""
        n = len(self.tree.people)
        known = f"{len(self.tree.leaves)} primitives of {n} {'person' if n == 1 else 'people'}"
        what = f"{len(self.config.channels)} channels at {self.config.rate_hz:g} Hz"
        return f"MotionLearner({known}; {self.n_frames} frames of {what})"

    @property
    def person(self) -> int:
        """Number of the person who moves, 0, 1, ... in the order of their coming.

        People are told apart by their markers; without markers all is one person's.
        """
        return max(self._person, 0)

    @property
    def latest_person(self) -> int:
        """Number of who moved last; -1 as long as nobody did."""
        return self._person

    @property
    def observer(self) -> MotionObserver | None:
        """What turns the stream's markers into features; None where channels are learned."""
        return None if self.watching is None else self.watching.observer

    # ---- learning

    def learn_one(self, frame: FloatArray, time_s: float | None = None) -> list[Event]:
        """Take the next frame and return what came of it.

        Args:
            frame: One sample, shape (D,); a missing marker is NaN.
            time_s: When it was taken, on any clock [s]. Where given, it must fit the rate.

        Raises:
            FrameError: The frame has the wrong width, is not finite, or its time does not fit;
                nothing has changed then.

        Example:
            >>> learner = MotionLearner(LearnerConfig(("elbow",), rate_hz=50.0))
            >>> learner.learn_one(np.array([0.3]), time_s=0.0)  # nothing was decided yet
            []
        """
        frame = self._checks.frame(frame)
        if time_s is not None:
            self._checks.clock(self._clock_s, time_s)
        self._clock_s = time_s
        return self._watch(frame[None])

    def learn_many(self, frames: FloatArray) -> list[Event]:
        """Take many frames, shape (T, D): bit-identical to `learn_one` in a loop.

        But frames that `learn_one` refuses because they are not finite are lost (`FramesLost`), and
        cost nothing else.

        Raises:
            FrameError: The frames have the wrong width.
        """
        return self._watch(self._checks.frames(frames))

    def learn_recording(self, recording: Recording, at_once: int = 1) -> Iterator[list[Event]]:
        """Learn a recording as a stream of its own; yield the events of each frame.

        The stream before it is ended, and so is this one after the last frame (the events of that
        come as one more item). Where a body is observed, a recording may have other markers than
        the streams before it, of any known set (`begin_stream`).

        Args:
            recording: The recording.
            at_once: How many frames to take before their events are yielded; many are faster.

        Raises:
            FrameError: The recording has other channels than those that can be observed, or another
                rate.
            BodyError: Its markers belong to no known set.
            InvalidValueError: ``at_once`` is not positive.

        Example:
            >>> import numpy as np
            >>> t = np.arange(400) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> take = Recording(swing, 100.0, ("elbow",), name="swings")
            >>> learner = MotionLearner(LearnerConfig(take.channels, segmenter="zero-velocity"))
            >>> for number, events in enumerate(learner.learn_recording(take)):  # a frame at a time
            ...     for event in events:
            ...         if isinstance(event, SegmentClosed) and event.segment.cause == "dip":
            ...             print(f"frame {number}: a dip in frame {event.segment.end}")
            frame 56: a dip in frame 50
            frame 257: a dip in frame 250

        The second forms a primitive, and is said with the frame after, which may form another.
        """
        if at_once < 1:
            raise InvalidValueError(f"at_once must be positive, not {at_once}")
        self.check_recording(recording)
        ended = self.begin_stream(recording.channels)
        if ended:
            yield ended
        frames = self._checks.frames(recording.frames)
        for start in range(0, len(frames), at_once):
            yield self._watch(frames[start : start + at_once])
        yield self.end_stream()

    def begin_stream(self, channels: Sequence[str]) -> list[Event]:
        """End the stream, as `end_stream` does, and go on with one that has these channels.

        Where a body is observed, it may be seen by other markers: those of any known set, in any
        order. An observer is made for each set, and all feed the same primitives; who is known by
        one set of markers is somebody else by another. Markers of an observer that a stream lacks,
        if it has most of them, are missing measurements.

        Args:
            channels: Names of the columns of the frames that follow.

        Returns:
            What came of the end of the stream before.

        Raises:
            FrameError: No such stream can be learned; nothing has changed then.
            BodyError: Its markers belong to no known set; nothing has changed then.

        Example:
            >>> from mplearn.demonstrator import demonstrate
            >>> shown = demonstrate(["BAR", "BAL"], seed=1).recording
            >>> learner = MotionLearner(LearnerConfig(shown.channels, shown.rate_hz))
            >>> events = learner.learn_many(shown.frames)
            >>> events = learner.begin_stream(shown.channels[:90])  # four markers fewer
            >>> events = learner.learn_many(shown.frames[:, :90])
        """
        channels = tuple(channels)
        if self.watching is None:
            self._checks.channels_are(channels)
            return self.end_stream()
        watch = self.watching.find(channels)
        events = self.end_stream()
        self.watching.turn_to(watch, channels)
        self._checks = StreamChecks(channels, self.config.rate_hz, gaps=True)
        return events

    def check_recording(self, recording: Recording) -> None:
        """Check that a recording can be learned here.

        Raises:
            FrameError: The recording has other channels, or another rate.
        """
        self._checks.recording(recording)

    def end_stream(self) -> list[Event]:
        """Close what is open: what comes next is another stream, perhaps of another person.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> [event.segment.cause for event in learner.end_stream()]  # a rest
            ['end']
        """
        events: list[Event] = []
        if self.observer is not None:
            events = self._take(self.observer.finish())
            self.observer.restart()
        events += self._found()
        events += self._cut()
        self._absurd = AbsurdFrames(len(self.config.channels), self.config.rate_hz)
        self._clock_s = None
        return events

    # ---- learning by hand

    def split(self, id: int, groups: Sequence[Sequence[int]] | None = None) -> Change:
        """Split a primitive as a person sees fit; see `PeopleTree.split`.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> change = learner.split(1, groups=[(0, 1, 2), (3, 4, 5)])
            >>> len(change.splits[0].into), len(learner.snapshot())
            (2, 3)
        """
        self._before_hand()
        return self._edited(self.tree.split(id, groups))

    def merge(self, first: int, second: int) -> Change:
        """Merge two primitives as a person sees fit; see `PeopleTree.merge`.

        Learners are merged by `mplearn.merge_learners`.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> change = learner.merge(1, 2)  # up and down are one, somebody says
            >>> change.merges[0].kept, learner.snapshot().names
            (1, ('P1',))
        """
        self._before_hand()
        return self._edited(self.tree.merge(first, second))

    def reparent(self, id: int, parent: int) -> Change:
        """Hang a node of the tree below another; see `PeopleTree.reparent`."""
        self._before_hand()
        return self._edited(self.tree.reparent(id, parent))

    def remove(self, id: int, *, forget: bool = False) -> Change:
        """Take a primitive out; see `PeopleTree.remove`.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> change = learner.remove(2)
            >>> learner.snapshot().names
            ('P1',)
        """
        self._before_hand()
        return self._edited(self.tree.remove(id, forget=forget))

    def keep(self, id: int) -> Change:
        """Let the rules neither forget nor drop a primitive; see `PrimitiveTree.keep`.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
        """
        return self.tree.keep(id)

    def freeze(self, id: int) -> Change:
        """Let a primitive stay as it is, whatever comes, in every `snapshot`.

        What is like it is recognised, and its transitions are counted; neither rules nor hands
        change it. How far a motion may lie from it is still measured on the scale of all motion.

        Raises:
            UnknownPrimitiveError: There is no such primitive.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> change = learner.freeze(1)
            >>> events = learner.learn_many(swing)  # more of the same
            >>> [primitive.n_exemplars for primitive in learner.snapshot()]  # it stays
            [6, 12]
        """
        self._before_hand()
        change = self.tree.freeze(id)
        self._snapshots.freeze(self.tree, id)
        return change

    def unfreeze(self, id: int) -> Change:
        """Let a primitive change again.

        Raises:
            UnknownPrimitiveError: There is no such primitive.
        """
        self._before_hand()
        change = self.tree.freeze(id, frozen=False)
        self._snapshots.frozen.pop(id, None)
        return change

    def pause(self) -> None:
        """Stop learning: motions are recognised from now on, and change nothing.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> learner.pause()
            >>> n_learned = learner.tree.n_seen
            >>> events = learner.learn_many(swing)
            >>> learner.paused, learner.tree.n_seen == n_learned
            (True, True)
        """
        self._paused, self._looking = True, None

    def resume(self) -> None:
        """Go on learning; what comes next does not follow what came before."""
        if self._paused:
            self._before_hand()
            self._paused = False
            self.chain.broken()

    @property
    def paused(self) -> bool:
        """Whether motions are recognised only."""
        return self._paused

    def known(self) -> Known:
        """Return what is known of motions now; two of them make a `LearnerEdit`."""
        self._before_hand()
        frozen = tuple(self._snapshots.frozen.values())
        return Known(self.tree.state(), self.graph.state(), self.chain.state(), frozen)

    def undo(self, edit: LearnerEdit) -> Exchange:
        """Undo what a person did, however long ago; what was learned since stays.

        Primitives that are gone by the edit come back with their ids, exemplars and counts. What
        came since to what the edit made goes to the nearest of those that it was made of. With
        ``edit.reversed()`` it is done again.

        Args:
            edit: What to take back: its ``before`` is put in the place of its ``after``.
        """
        self._before_hand()
        back = edit.reversed()
        found = self.tree.exchange(back.people)
        self.graph.exchange(back.graph, found.heirs, self.tree.leaves)
        nearest = {} if back.nearest is None else back.nearest.by_number()
        segments = back.segments.by_number()
        self.chain.exchange(segments, nearest, found.heirs, dict(found.moved))
        self._look_anew()
        frozen = self._snapshots.frozen
        for each in edit.frozen_after:
            frozen.pop(each.primitive.id, None)
        frozen |= {each.primitive.id: each for each in edit.frozen_before}
        for id in [id for id in frozen if id not in self.tree.leaves]:
            del frozen[id]
        return found

    def _look_anew(self) -> None:
        """What is known was changed by hand."""
        self._looking = None
        self._under_way.forget()

    def _edited(self, change: Change) -> Change:
        self.chain.revise(change)
        self._look_anew()
        return change

    # ---- what was learned

    def predict_next(self, k: int = 3) -> tuple[NextMotion, ...]:
        """Return the ``k`` motions most likely to come next, the most likely first.

        They depend on the latest motions of the stream, those included that have no primitive yet
        (`foresight`). Empty before anything has moved.

        Raises:
            InvalidValueError: ``k`` is not positive.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> [expected.id for expected in learner.predict_next(k=1)]  # the last was down
            [1]
        """
        return self.chain.foresee(k)

    def snapshot(self, *, shown_once: bool = False) -> PrimitiveLibrary:
        """Return what is known now, frozen.

        Args:
            shown_once: Whether the library holds motions, too, that are no primitives as yet, such
                as were shown once: each as one that has a single exemplar, to be performed. Nothing
                is ever recognised as such.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> events = learner.learn_many(-swing)  # goes on; the library stays as it is
            >>> len(library), len(library) < len(learner.snapshot())
            (2, True)
        """
        library = self._snapshots.take(self.tree, self.graph)
        return (
            with_shown_once(library, self.tree, self.chain, self._view) if shown_once else library
        )

    def prepare_snapshot(self) -> bool:
        """Do a part of what a snapshot takes, a primitive's; return whether nothing is left of it.

        Who may not be held up calls this now and then, and `snapshot` once it returns true: that
        takes little then, even where all primitives have changed.
        """
        return self._snapshots.prepare(self.tree)

    def state(self) -> LearnerState:
        """Return all that the learner knows: `from_state` resumes bit for bit.

        What has not changed since the last call is the same object (`mplearn.state`), so it costs
        what has changed.
        """
        return LearnerState(
            config=self.config,
            watches=() if self.watching is None else self.watching.state(),
            stream=self._checks.channels,
            segmenter=self._segmenter.state(),
            buffer=self._buffer.state(),
            tree=self.tree.state(),
            graph=self.graph.state(),
            chain=self.chain.state(),
            clock_s=self._clock_s,
            n_frames=self.n_frames,
            stream_start=self._stream_start,
            person=self._person,
            lost_from=self._lost_from,
            lost_why=self._lost_why,
            absurd=self._absurd.state(),
            frozen=tuple(self._snapshots.frozen.values()),
            paused=self._paused,
            closing=self._closing,
        )

    @classmethod
    def from_state(cls, state: LearnerState, *, lazily: bool = False) -> MotionLearner:
        """Return the learner that `state` described.

        Args:
            state: That.
            lazily: Whether models of segments are made only once they are asked for, which learners
                that are merged hardly do; a segment that cannot be modelled is found out then.

        Raises:
            StateError: The state is damaged; its place says where.
        """
        state = validated(state)
        with within("config"):
            learner = cls(state.config)
        if learner.watching is not None:
            learner.watching.load_state(state.watches, state.stream)
            learner._checks = StreamChecks(state.stream, state.config.rate_hz, gaps=True)
        else:
            require(not state.watches, "watches", "must be none where no body is observed")
            same = state.stream == state.config.channels
            require(same, "stream", "must be the configuration's channels")
        with within("segmenter"):
            learner._segmenter.load_state(state.segmenter)
        with within("absurd"):
            learner._absurd.load_state(state.absurd)
        with within("buffer"):
            learner._buffer.load_state(state.buffer)
        with within("tree"):
            learner.tree.load_state(state.tree, lazily=lazily)
        with within("graph"):
            learner.graph = TransitionGraph.from_state(state.graph)
        learner.chain = Chain(learner.graph, state.config.rate_hz, state.config.longest_pause_s)
        learner.chain.load_state(state.chain)
        learner._clock_s, learner.n_frames = state.clock_s, state.n_frames
        learner._stream_start, learner._lost_from = state.stream_start, state.lost_from
        learner._lost_why, learner._person = state.lost_why, state.person
        learner._snapshots.frozen = {each.primitive.id: each for each in state.frozen}
        learner._paused, learner._closing = state.paused, state.closing
        return learner

    def save(self, path: str | Path) -> Path:
        """Write the learner to a file, all of it or nothing, and return its path.

        Raises:
            StateError: The file cannot be written.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> path = learner.save("swings.learner")
            >>> later = MotionLearner.load(path)
            >>> [len(each.learn_many(swing)) for each in (learner, later)]  # bit for bit the same
            [42, 42]
        """
        FILES.write(Path(path), to_plain(self.state(), whole=True))
        return Path(path)

    @classmethod
    def load(cls, path: str | Path, *, lazily: bool = False) -> MotionLearner:
        """Read a learner that `save` wrote, which goes on bit for bit.

        Args:
            path: The file.
            lazily: See `from_state`.

        Raises:
            StateError: The file is missing, damaged, foreign, or of a newer version.
        """
        content = FILES.read(Path(path))
        with within(str(path)):
            return cls.from_state(from_plain(LearnerState, content, whole=True), lazily=lazily)

    # ---- being merged, see `mplearn.merging`

    def adopt(self, tree: PeopleTree, chain: Chain, n_frames: int, person: int) -> None:
        """Go on with what other learners know, too, after so many frames; ``person`` was last."""
        frozen = self._snapshots.frozen
        self.tree, self.chain, self.graph = tree, chain, chain.graph
        self.n_frames = self._stream_start = n_frames
        self._person, self._looking = person, None
        self._snapshots = Snapshots(self._view, self.channels, self.config.rate_hz, self._body)
        self._snapshots.frozen = frozen

    # ---- inside

    @property
    def _body(self) -> str:
        return self._view.body.name if isinstance(self._view, BodyView) else ""

    def _watch(self, frames: FloatArray) -> list[Event]:
        """Take frames of the stream, shape (T, D)."""
        if self.watching is None:
            first = self._absurd.through_first(frames)
            return self._hold(frames[:first]) + self._hold(frames[first:])
        observer = self.watching.observer
        frames = self.watching.arranged(frames)
        events: list[Event] = []
        while len(frames):
            watched = observer.watch(frames[:BLOCK_FRAMES])
            events += self._take(watched)
            frames = frames[watched.taken :]
        return events

    def _hold(self, frames: FloatArray) -> list[Event]:
        """Take frames of plain channels, shape (k, D), the absurd ones held at what was before."""
        if self._absurd.is_first_absurd(frames):
            self._begin_loss(ABSURD)
            self._leave_open()
        held, absurd = self._absurd.hold(frames)
        return self._pass_on(held, absurd, ABSURD)

    def _take(self, watched: Watched) -> list[Event]:
        """Take what became of frames of markers."""
        events: list[Event] = []
        if watched.dropped:
            events += self._cut()
            self._begin_loss(watched.why)
            self._skip(watched.dropped)
        watching = self.watching
        if not watched.joins and watching is not None:
            events += self._cut() if self.n_frames > self._stream_start else []
            new = watching.meet()
            before, self._person = self._person, watching.watch.person
            if before not in (-1, self._person):
                events.append(PersonChanged(self.n_frames, self._person, new))
        if watched.moved is not None and watching is not None and watching.observer.axes:
            events.append(AxesChanged(self.n_frames, 1.0 / watching.observer.axes.size))
        return events + self._pass_on(watched.features, watched.lost, watched.why)

    def _pass_on(self, rows: FloatArray, lost: BoolArray, why: str) -> list[Event]:
        """Learn rows that are ready, shape (k, D), and bridge those that are lost, if they are few.

        Where they are many, the motion that is going on is lost with them.
        """
        events: list[Event] = []
        while len(rows):
            same = lost != lost[0]
            n = int(np.argmax(same)) if same.any() else len(rows)
            if not lost[0]:
                events += self._found()
                events += self._learn(rows[:n])
            else:
                events += self._form_rest()
                self._begin_loss(why)
                bridged = self._bridged(rows[:n])
                if bridged:
                    events += self._learn(rows[:bridged])
                if bridged < n:
                    self._leave_open()
                    self._skip(n - bridged)
            rows, lost = rows[n:], lost[n:]
        return events

    def _bridged(self, rows: FloatArray) -> int:
        """Return how many of some lost rows still are a short stretch; none before the first."""
        if np.isnan(rows).any() or self.n_frames == self._stream_start:
            return 0
        room = round(BRIDGED_S * self.config.rate_hz) - (self.n_frames - self._lost_from)
        return min(max(room, 0), len(rows))

    def _begin_loss(self, why: str) -> None:
        if self._lost_from < 0:
            self._lost_from, self._lost_why = self.n_frames, why

    def _skip(self, frames: int) -> None:
        """Let frames pass from which nothing can be learned."""
        self.n_frames += frames
        self._stream_start = self.n_frames

    def _found(self) -> list[Event]:
        """Say what was lost, if that is over."""
        if self._lost_from < 0:
            return []
        lost, self._lost_from = FramesLost(self._lost_from, self.n_frames, self._lost_why), -1
        return [lost]

    def _leave_open(self) -> None:
        """Give up the motion that is going on; what comes next does not follow it."""
        if self.n_frames == self._stream_start:
            return
        open_from = self._buffer.first + self._stream_start
        self._lost_from = min(self._lost_from, open_from)
        self._segmenter.flush()
        self._begin_stream()

    def _cut(self) -> list[Event]:
        """Close what is open; what comes next does not follow it."""
        events = [e for segment in self._segmenter.flush() for e in self._close(segment)]
        events += self._form_rest()
        self._begin_stream()
        return events

    def _begin_stream(self) -> None:
        self._stream_start = self.n_frames
        self._buffer = FrameBuffer(self._buffer.n_channels)
        self._under_way.forget()
        self.chain.broken()

    def _learn(self, features: FloatArray) -> list[Event]:
        """Take features that are ready, shape (k, D)."""
        events: list[Event] = []
        frames = self._view.see(features)
        while len(frames):
            looks = self._under_way.until_look(len(self._buffer))  # may change the segmenter
            taken, segments = self._segmenter.advance(frames[:looks])
            for left in range(taken - 1, -1, -1):
                events += self._form_next()
                self.tree.pass_time()
                if left and self.config.scaffolding:
                    self._under_way.get_on()
            self._buffer.extend(frames[:taken])
            self.n_frames += taken
            for segment in segments:
                events.extend(self._close(segment))
            if self.config.scaffolding:
                self._scaffold(bool(segments))
            frames = frames[taken:]
        return events

    def _scaffold(self, begins: bool) -> None:
        """Tell the segmenter, now and then, how surely the motion that goes on is at its end."""
        if begins:
            self._under_way.forget()
            self._segmenter.scaffold()
        elif not self._under_way.looks_at(len(self._buffer)):
            self._under_way.get_on()
        elif self.person in self.tree.people:
            ending = self._under_way.ending(self.tree.of(self.person), self._buffer.held)
            if self.config.scaffolding == "inside":
                ending = UNKNOWN - INSIDE * max(UNKNOWN - ending, 0.0)
            self._segmenter.scaffold(ending=ending)

    def _close(self, segment: Segment) -> list[Event]:
        """Learn from a segment that the segmenter closed."""
        events = self._form_rest()
        frames = self._buffer.take(segment.start, segment.end)
        self._buffer.drop_before(segment.end)
        segment = replace(
            segment,
            start=segment.start + self._stream_start,
            end=segment.end + self._stream_start,
            decided_at=segment.decided_at + self._stream_start,
        )
        if segment.still or (self._body and np.ptp(frames, axis=0).max() < STILL_M):
            segment = replace(segment, still=True)
            self.chain.paused(segment)
            return [*events, SegmentClosed(segment)]
        if self._paused:
            return events + self._look(segment, frames)
        return events + self._place(segment, frames)

    def _look(self, segment: Segment, frames: FloatArray) -> list[Event]:
        """Recognise a segment, shape (L, V), and learn nothing."""
        if self._looking is None:
            self._looking = self.tree.recogniser()
        found = self._looking.recognise(frames)
        events: list[Event] = [SegmentClosed(segment)]
        if found.primitive is not None:
            events.append(Recognised(segment, found.primitive, found.distance))
        return events

    def _place(self, segment: Segment, frames: FloatArray) -> list[Event]:
        """Learn from a segment in which something moves, as it is seen, shape (L, V).

        It forms one primitive at most now. What came of it is said once nothing more is to form.
        """
        goes_on = self.chain.goes_on_with(segment)
        placement = self.tree.insert(frames, self.person, goes_on=goes_on, in_turn=True)
        if not self.tree.to_form:
            return self._follow(segment, placement)
        for id in placement.born:
            self.graph.add_node(id)
        self._closing = Closing(segment, placement)
        return []

    def _form_next(self) -> list[Event]:
        """Form what the latest segment may form yet, one primitive a call; return what came of it.

        Nothing is said before all is formed.
        """
        events, self._late = self._late, []
        if self._closing is None:
            return events
        segment, placement = self._closing
        placement = placement.then(self.tree.form_next())
        self._closing = Closing(segment, placement) if self.tree.to_form else None
        return events if self._closing else events + self._follow(segment, placement)

    def _form_rest(self) -> list[Event]:
        """Form at once all that the latest segment may form yet; return what came of it."""
        events = self._form_next()
        while self._closing is not None:
            events += self._form_next()
        return events

    def _before_hand(self) -> None:
        """Form what is to form before a person changes something; the next frame says it."""
        self._late = self._form_rest()

    def _follow(self, segment: Segment, placement: Placement) -> list[Event]:
        """Return what came of a segment that was placed, and count what follows what."""
        events: list[Event] = [SegmentClosed(segment, placement)]
        if placement.recognised:
            events.append(Recognised(segment, placement.node_id, placement.distance))
        elif not placement.born and not placement.refused:
            events += self._unlike(segment, placement)
        events += [PrimitiveSplit(segment, each.node, each.into) for each in placement.splits]
        events += [PrimitiveMerged(segment, *each) for each in placement.merges]
        for id in placement.born:
            shown, provisional = self.tree.n_placed(id), self.tree.is_provisional(id)
            events += [PrimitiveBorn(segment, id, shown, provisional)]
        events += self._judged(segment, placement)
        events.extend(self.chain.follow(segment, placement, self.config.false_alarms))
        return events

    def _judged(self, segment: Segment, placement: Placement) -> list[Event]:
        """Return which provisional primitives a segment confirmed, and which are forgotten."""
        came = Counter([placement.node_id, *(to for _, to in placement.moved)])
        events: list[Event] = []
        older = sorted(came.keys() - {ROOT, *placement.born})
        leaves = self.tree.leaves if older else ()  # which rise
        for id in older:
            k = bisect_left(leaves, id)
            if leaves[k : k + 1] != (id,):
                continue
            shown = self.tree.n_placed(id)
            if shown - came[id] < self.config.tree.confirmed <= shown:
                events.append(PrimitiveConfirmed(segment, id, shown))
        gone = [id for id in placement.removed if id in self.graph]  # inner nodes are not
        return events + [PrimitiveForgotten(segment, id, id in placement.parts) for id in gone]

    def _unlike(self, segment: Segment, placement: Placement) -> list[Event]:
        """Return the anomaly of a segment that was not recognised, if it is one."""
        if placement.nearest is None:
            return []
        ids, apart = self.tree.nearest_others(self.person)
        n_exemplars = np.maximum((~np.isnan(apart)).sum(axis=1), 1).sum()
        allowed = self.config.false_alarms
        if (1 + n_exemplars) * allowed < 1:
            return []
        novelty = MotionNovelty.of(ids, apart)
        length = make_distance(self.config.tree).length(placement.distance)
        found = novelty.score([(placement.nearest, float(length))])
        return [Anomaly(segment, "motion", *found)] if found.p_value <= allowed else []

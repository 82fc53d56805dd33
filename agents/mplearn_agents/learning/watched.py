"""Learning while one looks on: what happened, kept as it happens, and a bar that shows it."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from mplearn.errors import MPLearnError, RecordingError
from mplearn.learner import (
    Event,
    FramesLost,
    MotionLearner,
    PrimitiveBorn,
    PrimitiveForgotten,
    PrimitiveMerged,
    PrimitiveSplit,
    Recognised,
    SegmentClosed,
)
from mplearn.recording import Recording, Segment
from mplearn.tree import Placement
from mplearn_agents.terminal.interrupts import asked_to_stop

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, TaskID

_AT_ONCE = 50  # frames, after which the bar moves


@dataclass
class LearningLog:
    """What a learner said, in the order in which it said it.

    Attributes:
        segments: All segments, pauses too.
        placements: What the tree said to each; None for a pause.
        recognised: For each segment that was recognised on arrival, by its start: its primitive.
        known: Number of primitives known, each with the frame from which on.
        lost: Stretches from which nothing could be learned.
        watched_s: Length of the streams so far [s].
        learning_s: How long learning took [s], reading and drawing left out.
        refused: Recordings that could not be learned, or not to their end, by name: why.
        already: How many had been learned before.
        stopped: Whether somebody ended it.
    """

    segments: list[Segment] = field(default_factory=list)
    placements: list[Placement | None] = field(default_factory=list)
    recognised: dict[int, int] = field(default_factory=dict)
    known: list[tuple[int, int]] = field(default_factory=list)
    lost: list[FramesLost] = field(default_factory=list)
    watched_s: float = 0.0
    learning_s: float = 0.0
    refused: dict[str, MPLearnError] = field(default_factory=dict)
    already: int = 0
    stopped: bool = False
    _alive: set[int] = field(default_factory=set)

    @property
    def n_primitives(self) -> int:
        """How many primitives are known by now."""
        return len(self._alive)

    @property
    def times_real_time(self) -> float:
        """How much faster than real time learning was."""
        return self.watched_s / self.learning_s if self.learning_s > 0 else 0.0

    @property
    def n_lost(self) -> int:
        """Number of frames from which nothing could be learned."""
        return sum(lost.end - lost.start for lost in self.lost)

    @property
    def reasons(self) -> str:
        """Why they were lost, the most frequent reason first."""
        frames = Counter[str]()
        for lost in self.lost:
            frames[lost.reason] += lost.end - lost.start
        return "; ".join(reason for reason, _ in frames.most_common())

    @property
    def moving(self) -> list[Segment]:
        """The segments in which something moves."""
        return [segment for segment in self.segments if not segment.still]

    def note(self, event: Event) -> None:
        """Keep what an event says."""
        match event:
            case SegmentClosed(segment, placement):
                self.segments.append(segment)
                self.placements.append(placement)
            case Recognised(segment, primitive):
                self.recognised[segment.start] = primitive
            case PrimitiveBorn(segment, primitive):
                self._alive.add(primitive)
                self.known.append((segment.end, len(self._alive)))
            case PrimitiveMerged(segment, _, absorbed):
                self._alive.discard(absorbed)
                self.known.append((segment.end, len(self._alive)))
            case PrimitiveForgotten(segment, primitive):
                self._alive.discard(primitive)
                self.known.append((segment.end, len(self._alive)))
            case PrimitiveSplit(_, primitive, _):  # the new ones are born right after
                self._alive.discard(primitive)
            case FramesLost():
                self.lost.append(event)
            case _:
                pass


class Learner(Protocol):
    """What learns recordings: a `MotionLearner`, or a `LifelongLearner`."""

    def learn_recording(self, recording: Recording, at_once: int = ...) -> Iterator[list[Event]]:
        """Learn a recording as a stream of its own; yield the events of each part."""

    def end_stream(self) -> list[Event]:
        """Close what is open."""


def learn(
    learner: Learner,
    recordings: Sequence[Recording],
    console: Console,
    *,
    strict: bool = False,
    taken: Callable[[Recording], int] = lambda _: 0,
) -> LearningLog:
    """Show recordings to a learner, frame by frame, with a bar on the console.

    A stream ends with each recording. One that cannot be learned costs neither what was learned
    before nor what comes after it. Ctrl-C and SIGTERM end learning: `LearningLog.stopped`.

    Args:
        learner: Who looks on.
        recordings: What is shown, in order.
        console: Where the bar is drawn.
        strict: Whether a recording that cannot be learned is an error.
        taken: Returns how many frames of a recording were learned before, and are not shown again.

    Raises:
        MPLearnError: No recording can be learned, or one cannot and ``strict`` is set.
    """
    from mplearn_agents.terminal.progress import open_progress

    log = LearningLog()
    columns = (
        "[cyan]{task.fields[speed]:.0f} x real time",
        "[green]{task.fields[primitives]} primitives",
        "{task.fields[segments]} segments",
    )
    total_s = sum(recording.duration_s for recording in recordings)
    with asked_to_stop() as stop, open_progress(console, *columns) as progress:
        bar = progress.add_task("learning", total=total_s, speed=0.0, primitives=0, segments=0)
        for recording in recordings:
            before_s = log.watched_s
            begin = time.perf_counter()
            n = first = taken(recording)
            try:
                lost = log.n_lost
                for events in learner.learn_recording(recording, _AT_ONCE):
                    n = min(n + _AT_ONCE, len(recording))
                    for event in events:
                        log.note(event)
                    now = time.perf_counter()
                    log.learning_s += now - begin
                    begin = now
                    log.watched_s = before_s + n / recording.rate_hz
                    _show(progress, bar, log)
                    if stop.is_set() and n < len(recording):
                        log.stopped = True
                        return log
                if log.n_lost - lost == len(recording) - first > 0:
                    raise RecordingError(f"{recording.name}: {log.lost[-1].reason}")
            except MPLearnError as error:
                if strict or len(log.refused) + 1 == len(recordings):
                    raise
                log.refused[recording.name] = error
                for event in learner.end_stream():
                    log.note(event)
            log.learning_s += time.perf_counter() - begin
            log.watched_s = before_s + n / recording.rate_hz
            _show(progress, bar, log)
            log.already += first == len(recording) > 0
            if stop.is_set():
                log.stopped = True
                break
    return log


def _show(progress: Progress, bar: TaskID, log: LearningLog) -> None:
    progress.update(
        bar,
        completed=log.watched_s,
        speed=log.times_real_time,
        primitives=log.n_primitives,
        segments=len(log.moving),
    )


def why_nothing(learner: MotionLearner, n_moving: int, watched_s: float) -> str:
    """Return why nothing became a primitive, and what would help."""
    if not n_moving:
        return (
            f"Why: nothing moved in {watched_s:.1f} s, or too little was seen of it. Record "
            "longer, with the whole body in view."
        )
    found, least = learner.tree.most_repeated(), learner.config.tree.min_exemplars
    came = f"the most repeated came {found.times} times" if found.times > 1 else "none came twice"
    apart = f"{found.apart:.1f} times as far apart as executions of one motion may be"
    if not math.isfinite(found.apart):
        apart = "nothing to compare with"
    return (
        f"Why: of {found.n_unplaced} segments {came}, the nearest {apart}. Show each motion at "
        f"least {least} times, more where it varies widely; or let the recording be learned twice."
    )

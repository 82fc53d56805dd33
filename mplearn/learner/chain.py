"""Which segment followed which: what the transition graph is counted from [Kulic2012, 3]."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from operator import attrgetter
from typing import Annotated, Any

import numpy as np

from ..graph import TransitionGraph
from ..recording import CAUSES, BoolArray, FloatArray, IntArray, Segment
from ..state import Array, Count, SharedState, State, require, saved_as
from ..tree import ROOT, Change, Placement
from .events import Anomaly, Event, TransitionSeen
from .foresight import NextMotion, foresee
from .seen_segment import SeenSegment, run_before, step_s

REMEMBERED = 2048  # segments; older ones cannot be counted again


BLOCK = 64  # segments that are kept together


@dataclass(frozen=True, eq=False)
class SeenSegmentsState(SharedState):
    """Segments of a chain, shape (n,) each, see `SeenSegment` and `Segment`; -1 is None."""

    number: Annotated[IntArray, Array("n", low=0)]
    primitive: Annotated[IntArray, Array("n", low=-1)]
    follows: Annotated[BoolArray, Array("n")]
    start: Annotated[IntArray, Array("n", low=0)]
    end: Annotated[IntArray, Array("n", low=1)]
    confidence: Annotated[FloatArray, Array("n", low=-1.0, high=1.0)]
    decided_at: Annotated[IntArray, Array("n", low=-1)]
    still: Annotated[BoolArray, Array("n")]
    cause: Annotated[IntArray, Array("n", low=0, high=len(CAUSES) - 1)]
    nearest: Annotated[IntArray, Array("n", low=-1)]
    like: Annotated[IntArray, Array("n", low=-1)]

    def check(self) -> None:
        """Check that segments follow each other, and are like earlier ones."""
        require(bool((np.diff(self.number) > 0).all()), "number", "must rise")
        require(bool((self.start < self.end).all()), "end", "must exceed start")
        require(bool((self.start[1:] >= self.end[:-1]).all()), "start", "must follow the last end")
        require(bool((self.like < self.number).all()), "like", "must be an earlier segment")

    @classmethod
    def of(cls, rows: Sequence[tuple[Any, ...]]) -> SeenSegmentsState:
        """Return the state of some segments, a row of plain values each."""
        columns = zip(*rows, strict=True)
        return cls(*(np.array(each, kind) for each, kind in zip(columns, _DTYPES, strict=True)))

    def segments(self) -> list[SeenSegment]:
        """Return the segments."""
        columns = (getattr(self, each.name).tolist() for each in fields(self))
        return [
            SeenSegment(
                number,
                None if primitive < 0 else primitive,
                follows,
                Segment(start, end, confidence, decided_at, still, CAUSES[cause]),
                None if nearest < 0 else nearest,
                None if like < 0 else like,
            )
            for (
                number,
                primitive,
                follows,
                start,
                end,
                confidence,
                decided_at,
                still,
                cause,
                nearest,
                like,
            ) in zip(*columns, strict=True)
        ]


_DTYPES = ("i8", "i8", "?", "i8", "i8", "f8", "i8", "?", "i8", "i8", "i8")


_fields = attrgetter(*(each.name for each in fields(SeenSegment)))


def _state_of(segments: Sequence[SeenSegment]) -> SeenSegmentsState:
    return SeenSegmentsState.of(tuple(map(_plain, segments)))


def _plain(seen: SeenSegment) -> tuple[Any, ...]:
    """Return a segment of a chain as a row of plain values."""
    ids = (-1 if id is None else id for id in (seen.primitive, seen.nearest, seen.like))
    primitive, nearest, like = ids
    segment = seen.segment
    ends = segment.start, segment.end, segment.confidence, segment.decided_at, segment.still
    cause = CAUSES.index(segment.cause)
    return (seen.number, primitive, seen.follows, *ends, cause, nearest, like)


@saved_as(segments="links", n_segments="n_links")
@dataclass(frozen=True, eq=False)
class ChainState(State):
    """The latest segments of a stream.

    Attributes:
        segments: The segments, some at a time.
        paused_frames: Frames of the pause that goes on.
        broken: Whether what comes next does not follow what came.
        n_segments: How many segments there are.
    """

    segments: tuple[SeenSegmentsState, ...]
    paused_frames: Count
    broken: bool
    n_segments: Count

    def check(self) -> None:
        """Check that the parts follow each other, and that none is missing."""
        n = sum(len(block.number) for block in self.segments)
        require(self.n_segments == n, "segments", f"must be {self.n_segments} segments, not {n}")
        for k, (one, two) in enumerate(pairwise(self.segments), start=1):
            rises = len(one.number) and len(two.number) and one.number[-1] < two.number[0]
            require(bool(rises), f"segments[{k}].number", "must rise")
            require(bool(one.end[-1] <= two.start[0]), f"segments[{k}].start", "must rise")


class Chain:
    """The latest segments of the stream, and what they were recognised as.

    A transition is counted when two segments follow each other without a long pause and both are
    recognised. When a primitive is born, or split, the segments that it was formed from are known
    after all: transitions that they take part in are counted then. Nothing is counted twice.

    Args:
        graph: Where the transitions are counted.
        rate_hz: Frames per second [1/s].
        longest_pause_s: Longest pause that does not break the chain [s].
    """

    def __init__(self, graph: TransitionGraph, rate_hz: float, longest_pause_s: float) -> None:
        self.graph = graph
        self.rate_hz = rate_hz
        self.longest_pause_s = longest_pause_s
        self._segments: list[SeenSegment] = []
        self._paused_frames = 0
        self._broken = True
        self._kept: dict[int, tuple[tuple[tuple[Any, ...], ...], SeenSegmentsState]] = {}

    def paused(self, segment: Segment) -> None:
        """Take note of a segment in which nothing moved."""
        self._paused_frames += segment.length_frames
        if self._paused_frames > self.longest_pause_s * self.rate_hz:
            self._broken = True

    def broken(self) -> None:
        """Take note that what comes next does not follow what came."""
        self._broken = True

    def goes_on_with(self, segment: Segment) -> bool:
        """Return whether a segment begins where the latest motion ended."""
        latest = self._segments[-1].segment.end if self._segments else -1
        return not self._broken and latest == segment.start

    def foresee(self, k: int) -> tuple[NextMotion, ...]:
        """Return the ``k`` motions most likely to come next, see `foresee`."""
        return foresee(self.graph, self._segments, self.rate_hz, k, broken=self._broken)

    def follow(self, segment: Segment, placement: Placement, false_alarms: float) -> list[Event]:
        """Take the next segment, count what is known by it, and say what is surprising.

        Args:
            segment: The segment.
            placement: Where the tree put it, and what else changed there.
            false_alarms: Share of usual transitions that may be reported as an anomaly.
        """
        if placement.refused:  # no motion at all
            self.paused(segment)
            return []
        known = placement.node_id if placement.node_id in placement.born else None
        if placement.recognised and not placement.splits:
            known = placement.node_id
        follows, nearest, like = not self._broken, placement.nearest, placement.like
        self._segments.append(SeenSegment(placement.number, known, follows, segment, nearest, like))
        self._paused_frames, self._broken = 0, False
        events: list[Event] = []
        if known is not None and not placement.born:
            events += self._surprised(false_alarms)
            events += self._count(len(self._segments) - 1)
        moved = dict(placement.moved)
        if placement.number not in moved and placement.node_id in placement.born:
            moved[placement.number] = placement.node_id
        newest = len(self._segments) - 1
        events += self._revise(placement, moved, {newest} if known is not None else set())
        del self._segments[:-REMEMBERED]
        return events

    def revise(self, change: Change) -> list[Event]:
        """Follow a change of the tree that a person asked for, and count what is known by it."""
        return self._revise(change, dict(change.moved), set())

    def exchange(
        self,
        segments: Mapping[int, tuple[int, int]],
        nearest: Mapping[int, tuple[int, int]],
        heirs: Mapping[int, int | None],
        moved: Mapping[int, int],
    ) -> None:
        """Follow an edit that was undone; the graph has followed it already.

        Args:
            segments: Segments that the edit had made something else: what they are, if nothing else
                came since, and what they were; -1 stands for no primitive.
            nearest: The same of what they were nearest to.
            heirs: Primitives that are gone, and what has what came to them since.
            moved: Other segments by number, and the primitive that they are now.
        """
        gone: dict[int | None, int | None] = dict(heirs.items())
        for seen in self._segments:
            now, was = segments.get(seen.number, (-2, -2))
            if now == (-1 if seen.primitive is None else seen.primitive):
                seen.primitive = was
            else:
                seen.primitive = moved.get(seen.number, gone.get(seen.primitive, seen.primitive))
            now, was = nearest.get(seen.number, (-2, -2))
            if now == (-1 if seen.nearest is None else seen.nearest):
                seen.nearest = None if was < 0 else was
            else:
                seen.nearest = gone.get(seen.nearest, seen.nearest)
            if seen.primitive not in self.graph:
                seen.primitive = None

    def _revise(
        self, change: Placement | Change, moved: Mapping[int, int], known: set[int]
    ) -> list[Event]:
        """Follow the tree where earlier segments turned out to be something else.

        Args:
            change: What changed in it.
            moved: Segments by number, and what they are in now.
            known: Places of those that lead to transitions that count, if anything was born.
        """
        for merge in change.merges:
            self.graph.merge_nodes(merge.kept, merge.absorbed)
            self._rename({merge.absorbed}, merge.kept)
        for split in change.splits:
            self.graph.remove_node(split.node)
            self._rename({split.node}, None)
        for id in change.removed:
            if id in self.graph:
                self.graph.remove_node(id)
            self._rename({id}, None)
        known_now = known if change.born else set()  # and those that take part in what was born
        for number, id in moved.items():
            at = bisect_left(self._segments, number, key=lambda seen: seen.number)
            if at < len(self._segments) and self._segments[at].number == number:
                self._segments[at].primitive = None if id == ROOT else id
                known_now |= {at, at + 1} if id in change.born else set()
        for id in change.born:
            self.graph.add_node(id)
        events: list[Event] = []
        for i in sorted(known_now - {0, len(self._segments)}):
            events += self._count(i)
        return events

    def _rename(self, ids: Collection[int], to: int | None) -> None:
        for seen in self._segments:
            if seen.primitive in ids:
                seen.primitive = to
            if seen.nearest in ids:
                seen.nearest = to

    def _run(self, i: int) -> list[int]:
        """Return the primitives before segment i, oldest first, as far as nothing breaks off."""
        return run_before(self._segments, i, self.graph.order, lambda seen: seen.primitive)

    def _count(self, i: int) -> list[Event]:
        """Count the transition to segment i, if there is one."""
        seen, run = self._segments[i], self._run(i)
        if seen.primitive is None or not run:
            return []
        duration_s = step_s(self._segments, i, self.rate_hz)
        self.graph.observe(run[-1], seen.primitive, duration_s, before=run[:-1])
        count = self.graph.count(run[-1], seen.primitive)
        return [TransitionSeen(seen.segment, run[-1], seen.primitive, count)]

    def _surprised(self, false_alarms: float) -> list[Event]:
        """Return the anomaly of the newest transition, if it is one; before it is counted."""
        seen, run = self._segments[-1], self._run(len(self._segments) - 1)
        if not run or seen.primitive is None:
            return []
        sequence = [*run, seen.primitive]
        score = float(self.graph.surprises(sequence)[-1])
        if score <= -math.log(false_alarms):  # as likely as that is no alarm
            return []
        p_value = float(self.graph.p_values(sequence)[-1])
        return [Anomaly(seen.segment, "order", score, p_value)] if p_value <= false_alarms else []

    def successions(self) -> list[tuple[SeenSegment, SeenSegment, float]]:
        """Return the latest segments that followed each other, as far as they are remembered.

        Returns:
            The earlier segment, the later one, and the time from the start of the one to that of
            the other [s], as transitions are counted.
        """
        return [
            (one, other, step_s(self._segments, i, self.rate_hz))
            for i, (one, other) in enumerate(pairwise(self._segments), start=1)
            if other.follows
        ]

    # ---- learners that are merged

    def append(self, other: Chain, n_segments: int, n_frames: int) -> None:
        """Take over the segments of another stream, as if it had come after this one.

        Args:
            other: The chain of that stream; its primitives go by the names that they have here.
            n_segments: Segments that were seen here before.
            n_frames: Frames that were seen here before.
        """
        for seen in other._segments:
            old = seen.segment
            segment = Segment(
                old.start + n_frames,
                old.end + n_frames,
                old.confidence,
                old.decided_at + n_frames,
                old.still,
                old.cause,
            )
            number, like = seen.number + n_segments, seen.like
            like = None if like is None else like + n_segments
            self._segments.append(
                SeenSegment(number, seen.primitive, seen.follows, segment, seen.nearest, like)
            )

    def rename(self, new_id: Mapping[int, int]) -> None:
        """Let primitives have other names; those without a name are none any more."""
        for seen in self._segments:
            seen.primitive = None if seen.primitive is None else new_id.get(seen.primitive)
            seen.nearest = None if seen.nearest is None else new_id.get(seen.nearest)

    def correct(self, moved: Mapping[int, int]) -> None:
        """Let segments, by number, be what they turned out to be: transitions were counted."""
        for seen in self._segments:
            primitive = moved.get(seen.number, seen.primitive)
            seen.primitive = None if primitive == ROOT else primitive

    def count_late(self, placed: Mapping[int, int]) -> None:
        """Count the transitions of segments, by number, that are known only now."""
        late = {i for i, seen in enumerate(self._segments) if seen.number in placed}
        late = {i for i in late if self._segments[i].primitive is None}
        for i in late:
            self._segments[i].primitive = placed[self._segments[i].number]
        for i in range(1, len(self._segments)):
            if late & {i - 1, i}:
                self._count(i)

    # ---- keeping

    def state(self) -> ChainState:
        """Return everything but the graph."""
        blocks: dict[int, list[SeenSegment]] = {}
        for seen in self._segments:
            blocks.setdefault(seen.number // BLOCK, []).append(seen)
        kept = {}
        for at, segments in blocks.items():
            now = tuple(map(_fields, segments))
            known = self._kept.get(at)
            kept[at] = known if known and known[0] == now else (now, _state_of(segments))
        self._kept = kept
        states = tuple(state for _, state in kept.values())
        return ChainState(states, self._paused_frames, self._broken, len(self._segments))

    def load_state(self, state: ChainState) -> None:
        """Resume from what `state` returned."""
        self._segments = [seen for block in state.segments for seen in block.segments()]
        self._paused_frames, self._broken = state.paused_frames, state.broken
        self._kept = {}

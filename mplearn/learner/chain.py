"""Which segment followed which: what the transition graph is counted from [Kulic2012, 3]."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from ..graph import TransitionGraph
from ..recording import CAUSES, BoolArray, FloatArray, IntArray, Segment
from ..state import Array, Count, SharedState, State, require
from ..tree import ROOT, Change, Placement
from .events import Anomaly, Event, TransitionSeen
from .foresight import NextMotion, foresee
from .links import Link, run_before, step_s

REMEMBERED = 2048  # segments; older ones cannot be counted again


BLOCK = 64  # segments that are kept together


@dataclass(frozen=True, eq=False)
class LinksState(SharedState):
    """Segments of a chain, shape (n,) each, as `Link` and `Segment` say; -1 stands for None."""

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
    def of(cls, rows: Sequence[tuple[Any, ...]]) -> LinksState:
        """Return the state of some links, a row of plain values each."""
        columns = zip(*rows, strict=True)
        return cls(*(np.array(each, kind) for each, kind in zip(columns, _DTYPES, strict=True)))

    def links(self) -> list[Link]:
        """Return the links."""
        columns = (getattr(self, each.name).tolist() for each in fields(self))
        return [
            Link(
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


def _plain(link: Link) -> tuple[Any, ...]:
    """Return a link as a row of plain values."""
    ids = (-1 if id is None else id for id in (link.primitive, link.nearest, link.like))
    primitive, nearest, like = ids
    segment = link.segment
    ends = segment.start, segment.end, segment.confidence, segment.decided_at, segment.still
    cause = CAUSES.index(segment.cause)
    return (link.number, primitive, link.follows, *ends, cause, nearest, like)


@dataclass(frozen=True, eq=False)
class ChainState(State):
    """The latest segments of a stream.

    Attributes:
        links: The segments, some at a time.
        paused_frames: Frames of the pause that goes on.
        broken: Whether what comes next does not follow what came.
        n_links: How many segments there are.
    """

    links: tuple[LinksState, ...]
    paused_frames: Count
    broken: bool
    n_links: Count

    def check(self) -> None:
        """Check that the parts follow each other, and that none is missing."""
        n = sum(len(block.number) for block in self.links)
        require(self.n_links == n, "links", f"must be {self.n_links} segments, not {n}")
        for k, (one, two) in enumerate(pairwise(self.links), start=1):
            rises = len(one.number) and len(two.number) and one.number[-1] < two.number[0]
            require(bool(rises), f"links[{k}].number", "must rise")
            require(bool(one.end[-1] <= two.start[0]), f"links[{k}].start", "must rise")


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
        self._links: list[Link] = []
        self._paused_frames = 0
        self._broken = True
        self._kept: dict[int, tuple[tuple[tuple[Any, ...], ...], LinksState]] = {}

    def paused(self, segment: Segment) -> None:
        """Take note of a segment in which nothing moved."""
        self._paused_frames += segment.length_frames
        if self._paused_frames > self.longest_pause_s * self.rate_hz:
            self._broken = True

    def broken(self) -> None:
        """Take note that what comes next does not follow what came."""
        self._broken = True

    def foresee(self, k: int) -> tuple[NextMotion, ...]:
        """Return the ``k`` motions most likely to come next, see `foresee`."""
        return foresee(self.graph, self._links, self.rate_hz, k, broken=self._broken)

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
        self._links.append(Link(placement.number, known, follows, segment, nearest, like))
        self._paused_frames, self._broken = 0, False
        events: list[Event] = []
        if known is not None and not placement.born:
            events += self._surprised(false_alarms)
            events += self._count(len(self._links) - 1)
        moved = dict(placement.moved)
        if placement.number not in moved and placement.node_id in placement.born:
            moved[placement.number] = placement.node_id
        events += self._revise(placement, moved)
        del self._links[:-REMEMBERED]
        return events

    def revise(self, change: Change) -> list[Event]:
        """Follow a change of the tree that a person asked for, and count what is known by it."""
        return self._revise(change, dict(change.moved))

    def _revise(self, change: Placement | Change, moved: Mapping[int, int]) -> list[Event]:
        """Follow the tree where earlier segments turned out to be something else."""
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
        for link in self._links:
            link.primitive = moved.get(link.number, link.primitive)
            if link.primitive == ROOT:
                link.primitive = None
        for id in change.born:
            self.graph.add_node(id)
        events: list[Event] = []
        for i in range(1, len(self._links)) if change.born else ():
            pair = {self._links[i - 1].primitive, self._links[i].primitive}
            if pair & set(change.born):
                events += self._count(i)
        return events

    def _rename(self, ids: Collection[int], to: int | None) -> None:
        for link in self._links:
            if link.primitive in ids:
                link.primitive = to
            if link.nearest in ids:
                link.nearest = to

    def _run(self, i: int) -> list[int]:
        """Return the primitives before link i, oldest first, as far as nothing breaks them off."""
        return run_before(self._links, i, self.graph.order, lambda link: link.primitive)

    def _count(self, i: int) -> list[Event]:
        """Count the transition to link i, if there is one."""
        link, run = self._links[i], self._run(i)
        if link.primitive is None or not run:
            return []
        duration_s = step_s(self._links, i, self.rate_hz)
        self.graph.observe(run[-1], link.primitive, duration_s, before=run[:-1])
        count = self.graph.count(run[-1], link.primitive)
        return [TransitionSeen(link.segment, run[-1], link.primitive, count)]

    def _surprised(self, false_alarms: float) -> list[Event]:
        """Return the anomaly of the newest transition, if it is one; before it is counted."""
        link, run = self._links[-1], self._run(len(self._links) - 1)
        if not run or link.primitive is None:
            return []
        sequence = [*run, link.primitive]
        score = float(self.graph.surprises(sequence)[-1])
        if score <= -math.log(false_alarms):  # as likely as that is no alarm
            return []
        p_value = float(self.graph.p_values(sequence)[-1])
        return [Anomaly(link.segment, "order", score, p_value)] if p_value <= false_alarms else []

    # ---- learners that are merged

    def append(self, other: Chain, n_segments: int, n_frames: int) -> None:
        """Take over the segments of another stream, as if it had come after this one.

        Args:
            other: The chain of that stream; its primitives go by the names that they have here.
            n_segments: Segments that were seen here before.
            n_frames: Frames that were seen here before.
        """
        for link in other._links:
            segment = replace(
                link.segment,
                start=link.segment.start + n_frames,
                end=link.segment.end + n_frames,
                decided_at=link.segment.decided_at + n_frames,
            )
            like = None if link.like is None else link.like + n_segments
            new = replace(link, number=link.number + n_segments, segment=segment, like=like)
            self._links.append(new)

    def rename(self, new_id: Mapping[int, int]) -> None:
        """Let primitives have other names; those without a name are none any more."""
        for link in self._links:
            link.primitive = None if link.primitive is None else new_id.get(link.primitive)
            link.nearest = None if link.nearest is None else new_id.get(link.nearest)

    def correct(self, moved: Mapping[int, int]) -> None:
        """Let segments, by number, be what they turned out to be: transitions were counted."""
        for link in self._links:
            primitive = moved.get(link.number, link.primitive)
            link.primitive = None if primitive == ROOT else primitive

    def count_late(self, placed: Mapping[int, int]) -> None:
        """Count the transitions of segments, by number, that are known only now."""
        late = {i for i, link in enumerate(self._links) if link.number in placed}
        late = {i for i in late if self._links[i].primitive is None}
        for i in late:
            self._links[i].primitive = placed[self._links[i].number]
        for i in range(1, len(self._links)):
            if late & {i - 1, i}:
                self._count(i)

    # ---- keeping

    def state(self) -> ChainState:
        """Return everything but the graph."""
        blocks: dict[int, list[Link]] = {}
        for link in self._links:
            blocks.setdefault(link.number // BLOCK, []).append(link)
        kept = {}
        for at, links in blocks.items():
            now = tuple(map(_plain, links))
            known = self._kept.get(at)
            kept[at] = known if known and known[0] == now else (now, LinksState.of(now))
        self._kept = kept
        links_states = tuple(state for _, state in kept.values())
        return ChainState(links_states, self._paused_frames, self._broken, len(self._links))

    def load_state(self, state: ChainState) -> None:
        """Resume from what `state` returned."""
        self._links = [link for block in state.links for link in block.links()]
        self._paused_frames, self._broken = state.paused_frames, state.broken
        self._kept = {}

"""Which segment followed which: what the transition graph is counted from [Kulic2012, 3]."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import astuple
from typing import Any

from ..graph import TransitionGraph
from ..recording import Segment
from ..tree import ROOT, Change, Placement
from .events import Anomaly, Event, TransitionSeen
from .foresight import NextMotion, foresee
from .links import Link, run_before, step_s

REMEMBERED = 2048  # segments; older ones cannot be counted again


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
        for id in change.removed:
            if id in self.graph:
                self.graph.remove_node(id)
            self._rename({id}, None)
        return self._revise(change, dict(change.moved))

    def _revise(self, change: Placement | Change, moved: Mapping[int, int]) -> list[Event]:
        """Follow the tree where earlier segments turned out to be something else."""
        for merge in change.merges:
            self.graph.merge_nodes(merge.kept, merge.absorbed)
            self._rename({merge.absorbed}, merge.kept)
        for split in change.splits:
            self.graph.remove_node(split.node)
            self._rename({split.node}, None)
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

    def state(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return {
            "links": [astuple(link) for link in self._links],
            "paused_frames": self._paused_frames,
            "broken": self._broken,
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Resume from what `state` returned."""
        self._links = [
            Link(number, primitive, follows, Segment(*segment), nearest, like)
            for number, primitive, follows, segment, nearest, like in state["links"]
        ]
        self._paused_frames = int(state["paused_frames"])
        self._broken = bool(state["broken"])

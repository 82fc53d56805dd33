"""What a learner remembers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..body import ObserverState
from ..graph import GraphState
from ..people import PeopleState
from ..segmentation import SegmenterState
from ..state import Count, Range, State, require
from .absurd import AbsurdState
from .buffer import BufferState
from .chain import ChainState
from .config import LearnerConfig


@dataclass(frozen=True, eq=False)
class LearnerState(State):
    """A learner: its configuration, and what each of its stages remembers.

    Attributes:
        config: The stream, and how to learn from it.
        observer: What is known of people and their markers; None where no markers are watched.
        segmenter: The open segment.
        buffer: Its frames.
        tree: The primitives, of all people.
        graph: Their transitions.
        chain: The latest segments.
        clock_s: Time of the last frame; None where there is none [s].
        n_frames: Frames seen, of all streams.
        stream_start: The first of the stream that goes on.
        person: Number of the person who moves; -1 before the first.
        n_people: How many people were seen.
        lost_from: First frame of what is lost now; -1 where nothing is.
        lost_why: Why it is.
        absurd: What frames of plain channels are held against.
    """

    config: LearnerConfig
    observer: ObserverState | None
    segmenter: SegmenterState
    buffer: BufferState
    tree: PeopleState
    graph: GraphState
    chain: ChainState
    clock_s: float | None
    n_frames: Count
    stream_start: Count
    person: Annotated[int, Range(-1)]
    n_people: Count
    lost_from: Annotated[int, Range(-1)]
    lost_why: str
    absurd: AbsurdState

    def check(self) -> None:
        """Check that the stages have seen the same."""
        since = self.n_frames - self.stream_start
        held = self.buffer.first + len(self.buffer.frames)
        require(since >= 0, "stream_start", f"must be at most {self.n_frames}")
        require(held == since, "n_frames", f"must be {held} after stream_start, not {since}")
        require(self.segmenter.n_frames == since, "segmenter.n_frames", f"must be {since}")
        n_people = 0 if self.observer is None else self.observer.identity.bodies.n_people
        require(self.n_people == n_people, "n_people", f"must be {n_people}, as many as were met")
        require(self.person < max(n_people, 0), "person", f"must be below {n_people}")
        for k, each in enumerate(self.tree.trees):
            met = each.person < max(n_people, 1)
            require(met, f"tree.trees[{k}].person", f"must be below {max(n_people, 1)}")
        if self.observer is None and since:
            seen = bool(np.isfinite(self.absurd.last).all())
            require(seen, "absurd.last", "must be a frame once there was one")
        require(self.lost_from <= self.n_frames, "lost_from", f"must be at most {self.n_frames}")
        primitives = self.tree.primitives
        ids = set(self.graph.ids.tolist())
        require(ids <= primitives, "graph.ids", f"must be primitives, {sorted(primitives)}")
        for k, block in enumerate(self.chain.links):
            place = f"chain.links[{k}]"
            known = block.primitive[block.primitive >= 0]
            require(
                bool(np.isin(known, self.graph.ids).all()), f"{place}.primitive", "must be known"
            )
            require(
                bool((block.nearest < self.tree.free_id).all()),
                f"{place}.nearest",
                "must be nodes of the tree, now or before",
            )
            inside = (block.end <= self.n_frames) & (block.number < self.tree.n_seen)
            inside &= block.decided_at <= self.n_frames
            require(bool(inside.all()), f"{place}.end", "must have been seen")

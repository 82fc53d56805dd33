"""What a learner remembers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..errors import StateError
from ..graph import GraphState
from ..people import PeopleState
from ..recording import Segment
from ..segmentation import SegmenterState
from ..state import Count, FileFormat, Range, State, from_plain, require, to_plain
from ..tree import ROOT, Placement
from .absurd import AbsurdState
from .buffer import BufferState
from .chain import ChainState
from .config import LearnerConfig
from .snapshot import FrozenState
from .watching import WatchState


class Closing(NamedTuple):
    """A segment that was closed, and may form one primitive more.

    Attributes:
        segment: The segment.
        placement: Where it was put, and what has come of it so far.
    """

    segment: Segment
    placement: Placement


@dataclass(frozen=True, eq=False)
class LearnerState(State):
    """A learner: its configuration, and what each of its stages remembers.

    Attributes:
        config: The stream, and how to learn from it.
        watches: What is known of people, by each set of markers; none where no body is observed.
        stream: Channels of the stream that goes on.
        segmenter: The open segment.
        buffer: Its frames.
        tree: The primitives, of all people.
        graph: Their transitions.
        chain: The latest segments.
        clock_s: Time of the last frame; None where there is none [s].
        n_frames: Frames seen, of all streams.
        stream_start: The first of the stream that goes on.
        person: Number of the person who moves; -1 before the first.
        lost_from: First frame of what is lost now; -1 where nothing is.
        lost_why: Why it is.
        absurd: What frames of plain channels are held against.
        frozen: Primitives that stay as they were.
        paused: Whether motions are recognised only.
        closing: The segment that was closed last, while it may form one primitive more.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> learner = MotionLearner(LearnerConfig(("elbow",)))
        >>> events = learner.learn_many(np.zeros((120, 1)))
        >>> state = learner.state()
        >>> state.n_frames, MotionLearner.from_state(state).n_frames  # goes on where it stood
        (120, 120)
    """

    config: LearnerConfig
    watches: tuple[WatchState, ...]
    stream: tuple[str, ...]
    segmenter: SegmenterState
    buffer: BufferState
    tree: PeopleState
    graph: GraphState
    chain: ChainState
    clock_s: float | None
    n_frames: Count
    stream_start: Count
    person: Annotated[int, Range(-1)]
    lost_from: Annotated[int, Range(-1)]
    lost_why: str
    absurd: AbsurdState
    frozen: tuple[FrozenState, ...] = ()
    paused: bool = False
    closing: Closing | None = None

    def check(self) -> None:
        """Check that the stages have seen the same."""
        since = self.n_frames - self.stream_start
        held = self.buffer.first + len(self.buffer.frames)
        require(since >= 0, "stream_start", f"must be at most {self.n_frames}")
        require(held == since, "n_frames", f"must be {held} after stream_start, not {since}")
        require(self.segmenter.n_frames == since, "segmenter.n_frames", f"must be {since}")
        people = sorted(person for watch in self.watches for person in watch.people)
        n_people = len(people)
        require(people == list(range(n_people)), "watches", f"must number {n_people} people once")
        require(self.person < n_people, "person", f"must be below {n_people}")
        for k, each in enumerate(self.tree.trees):
            met = each.person < max(n_people, 1)
            require(met, f"tree.trees[{k}].person", f"must be below {max(n_people, 1)}")
        if not self.watches and since:
            seen = bool(np.isfinite(self.absurd.last).all())
            require(seen, "absurd.last", "must be a frame once there was one")
        require(self.lost_from <= self.n_frames, "lost_from", f"must be at most {self.n_frames}")
        primitives = self.tree.primitives
        for k, frozen in enumerate(self.frozen):
            there = frozen.primitive.id in primitives
            require(there, f"frozen[{k}]", f"must be one of {sorted(primitives)}")
        nodes = self.graph.ids.array
        ids = set(nodes.tolist())
        require(ids <= primitives, "graph.ids", f"must be primitives, {sorted(primitives)}")
        for k, block in enumerate(self.chain.segments):
            place = f"chain.segments[{k}]"
            known = block.primitive[block.primitive >= 0]
            there = bool(np.isin(known, nodes).all())
            require(there, f"{place}.primitive", "must be known")
            require(
                bool((block.nearest < self.tree.free_id).all()),
                f"{place}.nearest",
                "must be nodes of the tree, now or before",
            )
            inside = (block.end <= self.n_frames) & (block.number < self.tree.n_seen)
            inside &= block.decided_at <= self.n_frames
            require(bool(inside.all()), f"{place}.end", "must have been seen")
        self._check_closing()

    def _check_closing(self) -> None:
        """Check that a segment may form one primitive more just where the tree says so."""
        forms = any(each.tree.to_form for each in self.tree.trees)
        require(forms == (self.closing is not None), "closing", "must be there if something forms")
        if self.closing is None:
            return
        segment, placement = self.closing
        seen = segment.end <= self.n_frames and segment.decided_at <= self.n_frames
        require(seen, "closing.segment", "must have been seen")
        latest = self.tree.n_seen - 1
        require(placement.number == latest, "closing.placement.number", f"must be {latest}")
        ids = {placement.node_id, *placement.born, *(to for _, to in placement.moved)}
        there = ids <= {ROOT, *self.tree.primitives}
        require(there, "closing.placement", "must name primitives of the tree")
        known = placement.nearest is None or 0 < placement.nearest < self.tree.free_id
        require(known, "closing.placement.nearest", "must be a node of the tree, now or before")
        like = placement.like is None or 0 <= placement.like < latest
        require(like, "closing.placement.like", "must be an earlier segment")


def _one_watch(content: dict[str, Any]) -> dict[str, Any]:
    """Bring a learner up to date that knew one set of markers."""
    content = dict(content)
    observer, n_people = content.pop("observer"), content.pop("n_people")
    channels = content["config"]["channels"]
    watch = {"channels": channels, "people": list(range(n_people)), "observer": observer}
    content |= {"watches": [] if observer is None else [watch], "stream": channels}
    return content


def _whole(content: Any) -> Any:
    """Bring the content of a file up to date that lacks what has a usual value."""
    return to_plain(from_plain(LearnerState, content), whole=True)


FILES = FileFormat(
    "mplearn-learner",
    "learner",
    StateError,
    7,
    migrations={1: _one_watch, 2: _whole, 3: _whole, 4: _whole, 5: _whole, 6: _whole},
    compression=1,
)

"""How often the next primitive is foretold, beside what perfect labels would allow."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...demonstrator import paper_session
from ...graph import TransitionGraph
from ...learner import LearnerConfig, MotionLearner, SegmentClosed
from ...recording import BoolArray, LabelledSegment, Recording
from ...tree import Placement
from ..matching import match_segments
from ..observing import observe
from ..sessions import SessionConfig, make_session
from ..table import Table, percent
from .sessions import by_person

TOP = 3


@dataclass(frozen=True)
class Foretold:
    """Which motions of a stream, but for the first, were foretold right before they came.

    Attributes:
        perfect: By the same rules from the true labels, shape (n, 2): as the most likely, and among
            the `TOP` most likely.
        learned: By what was learned so far from the stream, shape (n, 2).
    """

    perfect: BoolArray
    learned: BoolArray

    def share(self, first: int = 0) -> float:
        """Return the accuracy over what perfect labels allow, from one motion on."""
        return float(self.learned[first:, 0].mean() / max(self.perfect[first:, 0].mean(), 1e-9))


def foretell(features: Recording, truth: Sequence[LabelledSegment]) -> Foretold:
    """Learn a stream on-line and foretell each motion from those before it."""
    learner = MotionLearner(LearnerConfig(features.channels, features.rate_hz))
    homes = _Homes()
    found, numbers, foretold = [], [], []
    likely: list[list[int]] = []  # the primitives foretold, as the segments that are in each
    for events in learner.learn_recording(features):
        for event in events:
            if isinstance(event, SegmentClosed):
                found.append(event.segment)
                foretold.append(likely)
                numbers.append(homes.take(event.placement))
                likely = []
        if any(isinstance(event, SegmentClosed) for event in events):
            likely = [homes.inside(each.id) for each in learner.predict_next(TOP)]
    matching = match_segments(truth, found, features.rate_hz)
    shows = dict(zip(numbers, matching.labels, strict=True))
    said = np.zeros((len(truth), 2), dtype=np.bool_)
    for label, index, primitives in zip(matching.labels, matching.truth_of, foretold, strict=True):
        if index > 0:
            classes = [Counter(shows[n] for n in inside).most_common(1) for inside in primitives]
            names = [each[0][0] if each else "" for each in classes]
            said[index] = names[:1] == [label], label in names
    return Foretold(_perfect(truth), said[1:])


def foretell_paper_sessions(seeds: Iterable[int]) -> Iterator[tuple[str, Foretold]]:
    """Foretell sessions like the paper's."""
    for seed in seeds:
        session = paper_session(seed)
        yield f"paper_session({seed})", foretell(observe(session.recording), session.truth)


def foretell_people(
    takes: Iterable[Recording], orders: int = 2, executions: int = 1
) -> Iterator[tuple[str, Foretold]]:
    """Foretell sessions of each person's takes; each repetition comes ``executions`` times."""
    for person, own in by_person(takes).items():
        for order in range(orders):
            rng = np.random.default_rng(order)
            session = make_session(own, rng, SessionConfig(executions=executions))
            name = f"{person or 'unnamed'}, order {order}, {len(session.labels)} motions"
            yield name, foretell(observe(session), session.labels)


def prediction_table(title: str, outcomes: Iterable[tuple[str, Foretold]]) -> Table:
    """Return a row a session, and their mean."""
    outcomes = list(outcomes)
    rows = []
    for name, each in outcomes:
        half = len(each.learned) // 2
        rows.append((name, *_cells(each, 0), *_cells(each, half)))
    if len(outcomes) > 1:
        means = [
            percent(
                float(np.mean([each.share(len(each.learned) // 2 * h) for _, each in outcomes]))
            )
            for h in (0, 1)
        ]
        blank = ("", "", "")
        rows.append(("mean", *blank[:2], means[0], "", *blank[:2], means[1], ""))
    heads = ("perfect labels", "learned", "share", f"top {TOP}")
    return Table(
        title,
        ("session", *heads, *(f"{head}, second half" for head in heads)),
        tuple(rows),
        "Share of the motions foretold as the most likely one just before they came, on-line, from "
        "nothing; a motion whose class has no primitive yet counts as not foretold. Perfect "
        "labels: the same graph and rules, given the true class of every motion at once.",
    )


class _Homes:
    """Keeps which primitive each segment is in by now."""

    def __init__(self) -> None:
        self._home: dict[int, int] = {}

    def take(self, placement: Placement | None) -> int:
        """Take what was said of one segment; return its number, -1 for a pause."""
        if placement is None or placement.refused:
            return -1
        self._home[placement.number] = placement.node_id
        self._home.update(placement.moved)
        for merge in placement.merges:
            self._home |= {n: merge.kept for n, id in self._home.items() if id == merge.absorbed}
        return placement.number

    def inside(self, primitive: int) -> list[int]:
        """Return the numbers of the segments in a primitive."""
        return [number for number, home in self._home.items() if home == primitive]


def _perfect(truth: Sequence[LabelledSegment]) -> BoolArray:
    graph = TransitionGraph()
    ids: dict[str, int] = {}
    sequence: list[int] = []
    said = []
    for motion in truth:
        foretold = [each.id for each in graph.predict(sequence, TOP)]
        id = ids.setdefault(motion.label, len(ids))
        said.append((foretold[:1] == [id], id in foretold))
        graph.add_node(id)
        if sequence:
            before = sequence[-graph.order : -1]
            graph.observe(sequence[-1], id, 1.0, before=before)
        sequence.append(id)
    return np.array(said[1:], dtype=np.bool_).reshape(-1, 2)


def _cells(each: Foretold, first: int) -> tuple[str, ...]:
    perfect, learned = each.perfect[first:], each.learned[first:]
    return (
        percent(float(perfect[:, 0].mean())),
        percent(float(learned[:, 0].mean())),
        percent(each.share(first)),
        percent(float(learned[:, 1].mean())),
    )

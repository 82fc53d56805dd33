"""How often the next primitive is foretold, beside what perfect labels would allow."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...demonstrator import paper_session
from ...graph import TransitionGraph
from ...learner import LearnerConfig, MotionLearner, NextMotion, SegmentClosed
from ...recording import FloatArray, LabelledSegment, Recording
from ...tree import TreeConfig
from ..matching import match_segments
from ..observing import observe
from ..table import Table, percent

TOP = 3
_ALL = 1_000_000


class Forecast(NamedTuple):
    """What was said of the next motion right before it came.

    Attributes:
        first: Whether its class was the most likely.
        among: Whether it was among the `TOP` most likely.
        brier: Brier score: squared error of the probabilities of all classes, in [0, 2]; 1 where
            nothing was said.
    """

    first: bool
    among: bool
    brier: float


@dataclass(frozen=True, eq=False)
class Foretold:
    """What was said of each motion but the first, in arrays of `Forecast`, shape (n, 3).

    Attributes:
        perfect: By the same rules, from the true labels.
        learned: By what was learned so far from the stream.
        primitives: By the primitives alone that had been formed so far.
        shown: How often each motion's class had been shown before, shape (n,).
    """

    perfect: FloatArray
    learned: FloatArray
    primitives: FloatArray
    shown: FloatArray

    def share(self, said: FloatArray, *, half: bool = False) -> float:
        """Return an accuracy over what perfect labels allow, of all or of the second half."""
        first = len(said) // 2 if half else 0
        return float(said[first:, 0].mean() / max(self.perfect[first:, 0].mean(), 1e-9))

    @property
    def at_most(self) -> float:
        """Share that is left where a motion cannot be foretold before it can be a primitive."""
        possible = self.shown >= TreeConfig().min_exemplars
        return float((self.perfect[:, 0] * possible).mean() / max(self.perfect[:, 0].mean(), 1e-9))


def foretell(features: Recording, truth: Sequence[LabelledSegment]) -> Foretold:
    """Learn a stream on-line and foretell each motion from those before it."""
    learner = MotionLearner(LearnerConfig(features.channels, features.rate_hz))
    found, numbers, foretold = [], [], []
    likely: tuple[NextMotion, ...] = ()
    for events in learner.learn_recording(features):
        for event in events:
            if isinstance(event, SegmentClosed):
                found.append(event.segment)
                foretold.append(likely)
                numbers.append(-1 if event.placement is None else event.placement.number)
                likely = ()
        if any(isinstance(event, SegmentClosed) for event in events):
            likely = learner.predict_next(_ALL)
    matching = match_segments(truth, found, features.rate_hz)
    shows = dict(zip(numbers, matching.labels, strict=True))
    learned, primitives = (np.tile([0.0, 0.0, 1.0], (len(truth), 1)) for _ in range(2))
    for label, index, motions in zip(matching.labels, matching.truth_of, foretold, strict=True):
        if index > 0:
            said = [(_class_of(each, shows), each.probability) for each in motions]
            known = [one for one, each in zip(said, motions, strict=True) if each.id is not None]
            learned[index], primitives[index] = _judged(said, label), _judged(known, label)
    perfect, shown = _perfect(truth)
    return Foretold(perfect[1:], learned[1:], primitives[1:], shown[1:])


def foretell_paper_sessions(seeds: Iterable[int]) -> Iterator[tuple[str, Foretold]]:
    """Foretell sessions like the paper's."""
    for seed in seeds:
        session = paper_session(seed)
        yield f"paper_session({seed})", foretell(observe(session.recording), session.truth)


def foretell_sessions(
    sessions: Iterable[tuple[str, Recording]],
) -> Iterator[tuple[str, Foretold]]:
    """Foretell sessions, each of which has a name and labels.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> session = demonstrate(["BAR", "BAL"] * 4, seed=1, rate_hz=50.0).recording
        >>> (name, foretold), = foretell_sessions([("anna", session)])
        >>> name, foretold.perfect.shape[1]
        ('anna, 8 motions', 3)
    """
    for name, session in sessions:
        features = observe(session)
        yield f"{name}, {len(session.labels)} motions", foretell(features, session.labels)


def prediction_table(title: str, outcomes: Iterable[tuple[str, Foretold]]) -> Table:
    """Return a row a session, and their mean.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> session = demonstrate(["BAR", "BAL"] * 4, seed=1, rate_hz=50.0).recording
        >>> table = prediction_table("Two motions", foretell_sessions([("anna", session)]))
        >>> [row[0] for row in table.rows]
        ['anna, 8 motions']
    """
    names, rows = [], []
    for name, each in outcomes:
        names.append(name)
        perfect, learned = each.perfect.mean(axis=0), each.learned.mean(axis=0)
        shares = [
            each.share(said, half=half)
            for said in (each.learned, each.primitives)
            for half in (False, True)
        ]
        top, brier = (perfect[1], learned[1]), (perfect[2], learned[2])
        rows.append([perfect[0], learned[0], *shares, each.at_most, *top, *brier])
    if len(rows) > 1:
        names.append("mean")
        rows.append(np.mean(rows, axis=0).tolist())
    heads = (
        *("perfect labels", "learned", "share", "share, second half"),
        *("primitives only: share", "second half", "at most"),
        *(f"top {TOP}, perfect labels", f"top {TOP}, learned"),
        *("Brier, perfect labels", "Brier, learned"),
    )
    return Table(
        title,
        ("session", *heads),
        tuple(
            (name, *map(percent, row[:-2]), *(f"{score:.2f}" for score in row[-2:]))
            for name, row in zip(names, rows, strict=True)
        ),
        "Share of the motions foretold as the most likely one just before they came, on-line, from "
        "nothing. Perfect labels: the same graph and rules, given the true class of every motion. "
        "Learned: a motion that is no primitive yet can be foretold as one like an earlier "
        "segment, whose class then counts. Primitives only: the most likely primitive counts, a "
        "motion without one as not foretold; even with perfect labels only the share 'at most' is "
        f"left then, for a primitive needs {TreeConfig().min_exemplars} demonstrations. Brier: "
        "squared error of the probabilities of all classes, 0 is best; 1 for a motion not found.",
    )


def _class_of(motion: NextMotion, shows: dict[int, str]) -> str:
    """Return the class of most of the segments that show a motion; empty where they show none."""
    votes = Counter(shows[number] for number in motion.segments)
    return votes.most_common(1)[0][0] if votes else ""


def _judged(said: Sequence[tuple[str, float]], label: str) -> Forecast:
    """Hold classes and their probabilities, the most likely first, against what came."""
    names = [name for name, _ in said[:TOP]]
    shares: dict[str, float] = defaultdict(float)
    for name, probability in said:
        shares[name] += probability
    squares = sum(share**2 for share in shares.values())
    return Forecast(names[:1] == [label], label in names, 1 + squares - 2 * shares[label])


def _perfect(truth: Sequence[LabelledSegment]) -> tuple[FloatArray, FloatArray]:
    """Return what is said of each motion given the classes of those before it, and their counts."""
    graph = TransitionGraph()
    ids: dict[str, int] = {}
    names: list[str] = []
    sequence: list[int] = []
    said, shown = [], []
    for motion in truth:
        foretold = [(names[e.id], e.probability) for e in graph.predict(sequence, _ALL)]
        said.append(_judged(foretold, motion.label))
        if motion.label not in ids:
            ids[motion.label] = len(names)
            names.append(motion.label)
        id = ids[motion.label]
        shown.append(sequence.count(id))
        graph.add_node(id)
        if sequence:
            before = sequence[-graph.order : -1]
            graph.observe(sequence[-1], id, 1.0, before=before)
        sequence.append(id)
    return np.array(said, dtype=np.float64).reshape(-1, 3), np.array(shown, dtype=np.float64)

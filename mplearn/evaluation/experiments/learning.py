"""The paper's main experiment: how well a session is learned in one presentation, on-line."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...learner import LearnerConfig, MotionLearner, SegmentClosed
from ...recording import LabelledSegment, Recording
from ..boundaries import BoundaryScore, score_boundaries
from ..rates import LearningRates, rate_learning
from ..table import Table, percent

PAPER = (
    "paper, one person",
    *("17 of 22", "0", "-", "3.5 %", "6.7 %", "-", "77 %", "6-8", "-", "> 1 x"),
)
COLUMNS = (
    "session",
    "extracted",
    "spurious",
    "duplicates",
    "false positives",
    "false negatives",
    "recognised",
    "inside at the end",
    "demonstrations",
    "boundary F1",
    "real time",
)
NOTE = (
    "One presentation, on-line, from markers. A found segment shows the motion with which its "
    "intersection over union exceeds 0.5, one to one, boundaries within 0.25 s counting as equal. "
    "A primitive's class is the majority among the segments it was formed from; spurious ones have "
    "none, in brackets those that are provisional at the end and are forgotten if nothing confirms "
    "them. False positives: "
    "found segments recognised as another class, or though they show none. False negatives: not "
    "recognised in spite of a model of their class; both as shares of all found segments. "
    "Recognised: share of all motions that were recognised rightly as they came, the first ones of "
    "each class included. Inside: share that lies in a primitive of its class at the end; the "
    "paper's 77 % must be this, for 17 of 22 types are 77.3 % of the motions, of which some "
    "precede the models. "
    "Demonstrations: mean number of a class up to its first primitive."
)


@dataclass(frozen=True)
class Outcome:
    """What came of one session.

    Attributes:
        learner: As it was at the end.
        rates: The paper's error rates.
        boundaries: How well its segments agree with the truth.
        times_real_time: Length of the session over the time that learning took.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> outcome = learn_session(demonstrate(["BAR", "BAL"] * 5, seed=1, rate_hz=50.0).recording)
        >>> outcome.times_real_time > 1.0, outcome.rates.n_motions
        (True, 10)
    """

    learner: MotionLearner
    rates: LearningRates
    boundaries: BoundaryScore
    times_real_time: float

    @property
    def n_unsure(self) -> int:
        """Spurious primitives that are provisional at the end: they are kept only if confirmed."""
        classes, tree = self.rates.classes, self.learner.tree
        return sum(not classes.get(id, "?") and tree.is_provisional(id) for id in tree.leaves)


def learn_session(recording: Recording, truth: Sequence[LabelledSegment] | None = None) -> Outcome:
    """Learn a session frame by frame, from nothing, and rate what the learner said.

    Args:
        recording: The session.
        truth: What was performed; the recording's labels where not given.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> session = demonstrate(["BAR", "BAL"] * 5, seed=1, rate_hz=50.0).recording
        >>> outcome = learn_session(session)
        >>> outcome.rates.n_classes, outcome.boundaries.recall > 0.8
        (2, True)
    """
    truth = recording.labels if truth is None else truth
    learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))
    begin = time.perf_counter()
    closed = [
        event
        for events in learner.learn_recording(recording)
        for event in events
        if isinstance(event, SegmentClosed)
    ]
    took_s = time.perf_counter() - begin
    segments = [event.segment for event in closed]
    return Outcome(
        learner,
        rate_learning(truth, segments, [e.placement for e in closed], recording.rate_hz),
        score_boundaries(segments, truth, recording.rate_hz),
        recording.duration_s / took_s,
    )


def outcome_row(name: str, outcome: Outcome) -> tuple[str, ...]:
    """Return a row of the table of outcomes."""
    rates = outcome.rates
    return (
        name,
        f"{len(rates.extracted)} of {rates.n_classes}",
        f"{rates.n_spurious} ({outcome.n_unsure})",
        str(rates.n_duplicates),
        percent(rates.false_positive),
        percent(rates.false_negative),
        percent(rates.recognised),
        percent(rates.coverage),
        f"{_demonstrations(rates):.1f}",
        f"{outcome.boundaries.f1:.3f}",
        f"{outcome.times_real_time:.0f} x",
    )


def mean_row(name: str, outcomes: Sequence[Outcome]) -> tuple[str, ...]:
    """Return the mean over some outcomes, the worst in brackets."""
    rates = [outcome.rates for outcome in outcomes]

    def mean(values: Iterable[float], worst: float) -> str:
        return f"{percent(float(np.mean(list(values))))} (worst {percent(worst)})"

    positives = [r.false_positive for r in rates]
    negatives = [r.false_negative for r in rates]
    recognised = [r.recognised for r in rates]
    coverages = [r.coverage for r in rates]
    return (
        name,
        f"{100 * np.mean([len(r.extracted) / r.n_classes for r in rates]):.1f} %"
        f" (fewest {min(len(r.extracted) - r.n_classes for r in rates):+d})",
        f"{np.mean([r.n_spurious for r in rates]):.1f} "
        f"({np.mean([o.n_unsure for o in outcomes]):.1f})",
        f"{np.mean([r.n_duplicates for r in rates]):.1f}",
        mean(positives, max(positives)),
        mean(negatives, max(negatives)),
        mean(recognised, min(recognised)),
        mean(coverages, min(coverages)),
        f"{np.mean([_demonstrations(r) for r in rates]):.1f}",
        f"{np.mean([o.boundaries.f1 for o in outcomes]):.3f}",
        f"{np.mean([o.times_real_time for o in outcomes]):.0f} x",
    )


def _demonstrations(rates: LearningRates) -> float:
    """Mean number of demonstrations before a model; NaN where there is none."""
    numbers = list(rates.demonstrations.values())
    return float(np.mean(numbers)) if numbers else float("nan")


def learning_table(title: str, outcomes: Sequence[tuple[str, Outcome]]) -> Table:
    """Return the outcomes beside the paper's figures.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> outcome = learn_session(demonstrate(["BAR", "BAL"] * 5, seed=1, rate_hz=50.0).recording)
        >>> table = learning_table("Two motions", [("anna", outcome)])
        >>> [row[0] for row in table.rows]
        ['paper, one person', 'anna']
    """
    rows = [PAPER, *(outcome_row(name, outcome) for name, outcome in outcomes)]
    if len(outcomes) > 1:
        rows.append(mean_row("mean", [outcome for _, outcome in outcomes]))
    return Table(title, COLUMNS, tuple(rows), NOTE)

"""What was learned, held against what was performed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mplearn.evaluation import LearningRates, match_segments, rate_learning
from mplearn.recording import LabelledSegment
from mplearn_agents.learning.watched import LearningLog


@dataclass(frozen=True)
class Score:
    """One run against the truth.

    Attributes:
        rates: The paper's error rates.
        classes: Class of each primitive; spurious ones are missing.
        shows: Class of each found segment, by its start; missing where it shows none.
        performed: How often each class was performed, in the order of its first time.
        recognised: For each primitive, how many segments were recognised as it when they came.
        right: For each primitive, how many of those show its class.
    """

    rates: LearningRates
    classes: Mapping[int, str]
    shows: Mapping[int, str]
    performed: Mapping[str, int]
    recognised: Mapping[int, int]
    right: Mapping[int, int]


def score_learning(log: LearningLog, truth: Sequence[LabelledSegment], rate_hz: float) -> Score:
    """Hold a log against the truth.

    Args:
        log: What the learner said.
        truth: What was performed.
        rate_hz: Frames per second [1/s].
    """
    rates = rate_learning(truth, log.segments, log.placements, rate_hz)
    labels = match_segments(truth, log.segments, rate_hz).labels
    shows = {s.start: label for s, label in zip(log.segments, labels, strict=True) if label}
    classes = {primitive: label for primitive, label in rates.classes.items() if label}
    return Score(
        rates=rates,
        classes=classes,
        shows=shows,
        performed=Counter(segment.label for segment in truth),
        recognised=Counter(log.recognised.values()),
        right=Counter(
            primitive
            for start, primitive in log.recognised.items()
            if primitive in classes and shows.get(start) == classes[primitive]
        ),
    )

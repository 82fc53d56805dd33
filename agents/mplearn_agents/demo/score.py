"""What was learned, held against what was performed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from mplearn.recording import LabelledSegment, Segment
from mplearn_agents.learning import LearningLog


@dataclass(frozen=True)
class Score:
    """The paper's figures for one run.

    Attributes:
        classes: Majority class of each primitive; those without one are missing.
        recognised: For each primitive, how many segments were recognised as it.
        right: For each primitive, how many of those are of its class.
        performed: How often each class was performed.
        truth_of: Class of each found segment, by its start; missing where it fits none.
        false_positive: Share of recognised segments that are of another class, or of none.
        false_negative: Share of performances of a class already known that were not recognised.
        coverage: Share of all performances that were recognised rightly.
    """

    classes: Mapping[int, str]
    recognised: Mapping[int, int]
    right: Mapping[int, int]
    performed: Mapping[str, int]
    truth_of: Mapping[int, str]
    false_positive: float
    false_negative: float
    coverage: float

    @property
    def extracted(self) -> tuple[str, ...]:
        """The classes that have a primitive, in the order in which they were performed first."""
        known = set(self.classes.values())
        return tuple(label for label in self.performed if label in known)


def score_learning(
    log: LearningLog, truth: Sequence[LabelledSegment], ids: Collection[int]
) -> Score:
    """Hold a log against the truth.

    A found segment and a performance match if both together are at most twice as long as what they
    share. A class is known from the frame at which the first of its primitives was formed.

    Args:
        log: What the learner said.
        truth: What was performed.
        ids: The primitives that are known in the end.
    """
    matches = {segment.start: _match(segment, truth) for segment in log.moving}
    truth_of = {start: t.label for start, t in matches.items() if t is not None}
    votes: dict[int, Counter[str]] = {}
    for start, primitive in log.recognised.items():
        if start in truth_of and primitive in ids:
            votes.setdefault(primitive, Counter())[truth_of[start]] += 1
    classes = {primitive: count.most_common(1)[0][0] for primitive, count in votes.items()}
    right = Counter(
        primitive
        for start, primitive in log.recognised.items()
        if primitive in classes and truth_of.get(start) == classes[primitive]
    )
    known_from: dict[str, int] = {}
    for primitive, label in classes.items():
        known_from[label] = min(log.born[primitive], known_from.get(label, log.born[primitive]))
    found = {matches[start] for start in log.recognised}
    expected = [t for t in truth if t.start >= known_from.get(t.label, t.end)]
    missed = sum(t not in found for t in expected)
    n_right, n_recognised = sum(right.values()), len(log.recognised)
    return Score(
        classes=classes,
        recognised=Counter(log.recognised.values()),
        right=right,
        performed=Counter(t.label for t in truth),
        truth_of=truth_of,
        false_positive=1.0 - n_right / n_recognised if n_recognised else 0.0,
        false_negative=missed / len(expected) if expected else 0.0,
        coverage=n_right / len(truth),
    )


def _match(segment: Segment, truth: Sequence[LabelledSegment]) -> LabelledSegment | None:
    """Return the performance that a found segment shows; None where there is none."""
    for t in truth:
        common = min(t.end, segment.end) - max(t.start, segment.start)
        union = max(t.end, segment.end) - min(t.start, segment.start)
        if 2 * common >= union:
            return t
    return None

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
        pure: For each primitive, its recognised segments that are of that class, and all of them.
        performed: How often each class was performed.
        truth_of: Class of each found segment, by its start; missing where it fits none.
        false_positive: Share of recognised segments that are of another class.
        false_negative: Share of segments of a known class that were not recognised.
        coverage: Share of all segments that were recognised rightly.
    """

    classes: Mapping[int, str]
    pure: Mapping[int, tuple[int, int]]
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
    log: LearningLog,
    truth: Sequence[LabelledSegment],
    ids: Collection[int],
) -> Score:
    """Hold a log against the truth.

    Args:
        log: What the learner said.
        truth: What was performed.
        ids: The primitives that are known in the end.
    """
    truth_of = {}
    for segment in log.moving:
        label = overlapping_class(segment, truth)
        if label:
            truth_of[segment.start] = label
    votes: dict[int, Counter[str]] = {}
    for start, primitive in log.recognised.items():
        if start in truth_of:
            votes.setdefault(primitive, Counter())[truth_of[start]] += 1
    classes = {
        primitive: count.most_common(1)[0][0]
        for primitive, count in votes.items()
        if primitive in ids
    }
    totals = Counter(log.recognised.values())
    right = Counter(
        primitive
        for start, primitive in log.recognised.items()
        if truth_of.get(start) == classes.get(primitive, "")
    )
    n_right = sum(right.values())
    return Score(
        classes=classes,
        pure={primitive: (right[primitive], totals[primitive]) for primitive in totals},
        performed=Counter(t.label for t in truth),
        truth_of=truth_of,
        false_positive=1 - n_right / max(1, sum(totals.values())),
        false_negative=0.0,
        coverage=n_right / max(1, len(truth)),
    )


def overlapping_class(segment: Segment, truth: Sequence[LabelledSegment]) -> str:
    """Return the class that a segment mostly shows: one that covers half of what both cover."""
    for t in truth:
        common = min(t.end, segment.end) - max(t.start, segment.start)
        union = max(t.end, segment.end) - min(t.start, segment.start)
        if 2 * common >= union:
            return t.label
    return ""

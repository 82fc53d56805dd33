"""The paper's error rates of learning, on-line [Kulic2012, section 4].

A node's class is the majority among the exemplars that it was formed from. A node in which no class
has more than half of those, or mostly formed from segments which show nothing, is spurious.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..errors import InvalidValueError
from ..recording import LabelledSegment, Segment
from ..tree import Placement
from .matching import TOLERANCE_S, match_segments
from .membership import Membership, recognised_as


class ErrorRates:
    """The paper's two error rates, of what counts found, wrong and missed segments."""

    n_found: int
    n_wrong: int
    n_missed: int

    @property
    def false_positive(self) -> float:
        """Share of the found segments that were recognised wrongly."""
        return self.n_wrong / max(1, self.n_found)

    @property
    def false_negative(self) -> float:
        """Share of the found segments that were not recognised in spite of a model."""
        return self.n_missed / max(1, self.n_found)


@dataclass(frozen=True)
class LearningRates(ErrorRates):
    """How well a session was learned.

    Attributes:
        classes: Class of each primitive at the end; empty where it is spurious.
        n_classes: Classes that the truth holds.
        n_motions: Motions that the truth holds.
        n_found: Moving segments that were found.
        n_wrong: Found segments that were recognised as another class than they show, or though they
            show none.
        n_missed: Found segments that show a class of which there was a model already, and were not
            recognised.
        n_recognised: Motions that were recognised rightly as they came.
        n_inside: Motions that lie in a primitive of their class at the end, those included that it
            was formed from.
        demonstrations: For each class extracted, its motions up to its first primitive's birth.

    Example:
        >>> from mplearn.recording import LabelledSegment, Segment
        >>> truth = [LabelledSegment(0, 60, "bow"), LabelledSegment(60, 120, "bow")]
        >>> found = [Segment(0, 60), Segment(60, 120)]
        >>> rates = rate_learning(truth, found, [None, None], 100.0)  # the tree was not asked
        >>> rates.n_classes, rates.extracted, rates.coverage
        (1, (), 0.0)
    """

    classes: Mapping[int, str]
    n_classes: int
    n_motions: int
    n_found: int
    n_wrong: int
    n_missed: int
    n_recognised: int
    n_inside: int
    demonstrations: Mapping[str, int]

    @property
    def extracted(self) -> tuple[str, ...]:
        """Classes that have a primitive at the end."""
        return tuple(sorted(set(self.classes.values()) - {""}))

    @property
    def n_spurious(self) -> int:
        """Primitives that are of no class."""
        return sum(label == "" for label in self.classes.values())

    @property
    def n_duplicates(self) -> int:
        """Primitives beyond the first of each class."""
        return len(self.classes) - self.n_spurious - len(self.extracted)

    @property
    def recognised(self) -> float:
        """Share of the motions that were recognised rightly as they came."""
        return self.n_recognised / max(1, self.n_motions)

    @property
    def coverage(self) -> float:
        """Share of the motions that lie in a right primitive at the end."""
        return self.n_inside / max(1, self.n_motions)


def rate_learning(
    truth: Sequence[LabelledSegment],
    found: Sequence[Segment],
    placements: Sequence[Placement | None],
    rate_hz: float,
    *,
    tolerance_s: float = TOLERANCE_S,
) -> LearningRates:
    """Hold what the tree said, segment by segment, against the truth.

    Args:
        truth: What was performed, in order.
        found: The segments, in order; pass the true ones to leave segmentation out of the account.
        placements: What `PrimitiveTree.insert` returned for each; None where it was not asked.
        rate_hz: Frames per second [1/s].
        tolerance_s: Tolerance of the matching [s], see `match_segments`.

    Raises:
        InvalidValueError: There are not as many placements as segments.

    Example:
        >>> import numpy as np
        >>> from mplearn.recording import LabelledSegment, Segment
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placements = [tree.insert(k * lift) for k in (1.0, -1.0, 1.01, -1.01, 0.99)]
        >>> truth = [LabelledSegment(60 * k, 60 * k + 60, "ab"[k % 2]) for k in range(5)]
        >>> found = [Segment(each.start, each.end) for each in truth]
        >>> rates = rate_learning(truth, found, placements, 100.0)
        >>> rates.extracted, rates.coverage, rates.n_wrong
        (('a', 'b'), 1.0, 0)
    """
    if len(found) != len(placements):
        raise InvalidValueError(
            f"{len(found)} segments need as many placements, not {len(placements)}"
        )
    matching = match_segments(truth, found, rate_hz, tolerance_s=tolerance_s)
    account = _Account(truth)
    for label, index, placement in zip(matching.labels, matching.truth_of, placements, strict=True):
        if placement is not None and not placement.refused:
            account.take(placement, label, index)
    return account.rates(sum(not segment.still for segment in found))


class _Account:
    """What has been said so far."""

    def __init__(self, truth: Sequence[LabelledSegment]) -> None:
        self.truth = truth
        self.shows: dict[int, str] = {}  # class of each placed segment, by its number
        self.membership = Membership()
        self.classes: dict[int, str] = {}  # class of each node ever formed
        self.demonstrations: dict[str, int] = {}
        self.wrong = self.missed = self.recognised = 0

    def take(self, placement: Placement, label: str, index: int) -> None:
        """Take what was said of one segment that shows ``label``."""
        known = {label for node, label in self.classes.items() if node not in self.membership.gone}
        if placement.recognised:
            right = bool(label) and self.classes.get(recognised_as(placement)) == label
            self.wrong += not right
            self.recognised += right
        elif label and label in known:
            self.missed += 1
        self.shows[placement.number] = label
        self.membership.take(placement)
        for node in placement.born:
            self._name(node, index)

    def _name(self, node: int, index: int) -> None:
        votes = Counter(self.shows[number] for number in self.membership.members(node))
        label, count = votes.most_common(1)[0] if votes else ("", 0)
        self.classes[node] = label if 2 * count > votes.total() else ""
        if label and label not in self.demonstrations:
            past = self.truth[: index + 1] if index >= 0 else self.truth
            self.demonstrations[label] = sum(motion.label == label for motion in past)

    def rates(self, n_found: int) -> LearningRates:
        """Return the account's balance."""
        home, gone = self.membership.home, self.membership.gone
        classes = {node: label for node, label in self.classes.items() if node not in gone}
        inside = sum(
            bool(label) and classes.get(home[number]) == label
            for number, label in self.shows.items()
        )
        return LearningRates(
            classes=classes,
            n_classes=len({motion.label for motion in self.truth}),
            n_motions=len(self.truth),
            n_found=n_found,
            n_wrong=self.wrong,
            n_missed=self.missed,
            n_recognised=self.recognised,
            n_inside=inside,
            demonstrations={
                label: count
                for label, count in self.demonstrations.items()
                if label in classes.values()
            },
        )

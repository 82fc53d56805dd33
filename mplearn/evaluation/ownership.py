"""Which activities have primitives of their own: the rates of learning where labels are coarse.

An activity ("squat", "walk") holds several primitives, perhaps several times each, so found
segments are not matched with true ones: a segment shows the activity to which more than half of its
frames belong. A primitive's activity is that of more than half of the frames in it.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidValueError
from ..recording import LabelledSegment, Segment
from ..tree import ROOT, Placement
from .membership import Membership, recognised_as


@dataclass(frozen=True)
class Heard:
    """What a learner said of one take.

    Attributes:
        n_frames: Length of the take.
        segments: Its segments, in frames of the take.
        placements: What the tree said of each; None for a pause.
    """

    n_frames: int
    segments: tuple[Segment, ...]
    placements: tuple[Placement | None, ...]

    def __post_init__(self) -> None:
        if len(self.segments) != len(self.placements):
            raise InvalidValueError(
                f"{len(self.segments)} segments need as many placements, not {len(self.placements)}"
            )


@dataclass(frozen=True)
class OwnershipRates:
    """How well activities were learned.

    Attributes:
        activities: The activities of the truth, sorted.
        primitives: Activity of each primitive at the end; empty where it is of none.
        purity: Share of the labelled frames in primitives that are of their primitive's commonest
            activity; NaN where there are none.
        n_moving: Labelled frames outside of pauses.
        n_covered: Of these, frames in any primitive at the end.
        n_inside: Of these, frames in a primitive of their activity at the end.
        n_recognised: Of these, frames of segments that were recognised rightly as they came.
        n_found: Moving segments that the tree took up.
        n_wrong: Of these, those that were recognised as another activity than they show.
        demonstrations: For each activity that had a primitive, its segments up to the first one's
            birth.
        shown: Pairs of activity and primitive, one a segment in a primitive that shows an activity.

    Example:
        >>> import numpy as np
        >>> from mplearn.evaluation.ownership import Heard
        >>> from mplearn.recording import Segment
        >>> from mplearn.tree import Placement
        >>> heard = Heard(100, (Segment(0, 100),), (Placement(0, 1, True, 0.2, 0.5),))
        >>> rates = rate_ownership([(np.repeat(["bow"], 100), heard)])
        >>> rates.owned, rates.purity, rates.false_positive
        (('bow',), 1.0, 1.0)
    """

    activities: tuple[str, ...]
    primitives: Mapping[int, str]
    purity: float
    n_moving: int
    n_covered: int
    n_inside: int
    n_recognised: int
    n_found: int
    n_wrong: int
    demonstrations: Mapping[str, int]
    shown: tuple[tuple[str, int], ...]

    @property
    def owned(self) -> tuple[str, ...]:
        """Activities that have a primitive at the end."""
        return tuple(sorted(set(self.primitives.values()) - {""}))

    @property
    def covered(self) -> float:
        """Share of the labelled moving time in any primitive at the end."""
        return self.n_covered / max(1, self.n_moving)

    @property
    def inside(self) -> float:
        """Share of the labelled moving time in a right primitive at the end."""
        return self.n_inside / max(1, self.n_moving)

    @property
    def recognised(self) -> float:
        """Share of the labelled moving time that was recognised rightly as it came."""
        return self.n_recognised / max(1, self.n_moving)

    @property
    def false_positive(self) -> float:
        """Share of the moving segments that were recognised as another activity."""
        return self.n_wrong / max(1, self.n_found)

    @property
    def mean_demonstrations(self) -> float:
        """Mean number of segments of an activity up to its first primitive; NaN without any."""
        return float(np.mean(list(self.demonstrations.values()))) if self.demonstrations else np.nan


def frame_labels(labels: Sequence[LabelledSegment], n_frames: int) -> NDArray[np.str_]:
    """Return the label of each frame, shape (T,); empty where there is none.

    Where labels overlap, the later one in the sequence holds.
    """
    width = max((len(each.label) for each in labels), default=1)
    names = np.full(n_frames, "", dtype=f"<U{max(1, width)}")
    for label in labels:
        names[label.start : label.end] = label.label
    return names


def rate_ownership(
    takes: Iterable[tuple[NDArray[np.str_], Heard]],
) -> OwnershipRates:
    """Hold what a tree said of takes, learned one after another, against activities.

    Args:
        takes: For each take the label of each of its frames, shape (T,), empty for none, and what
            was said of it.

    Raises:
        InvalidValueError: There are not as many labels as frames.

    Example:
        >>> import numpy as np
        >>> from mplearn.evaluation.ownership import Heard
        >>> from mplearn.recording import Segment
        >>> from mplearn.tree import Placement
        >>> labels = np.repeat(["bow", "wave"], 100)
        >>> segments = Segment(0, 100), Segment(100, 200)
        >>> placements = Placement(0, 1, True, 0.2, 0.5), Placement(1, 2, True, 0.2, 0.5)
        >>> rates = rate_ownership([(labels, Heard(200, segments, placements))])
        >>> dict(rates.primitives), rates.inside
        ({1: 'bow', 2: 'wave'}, 1.0)
    """
    account = _Account()
    names: set[str] = set()
    for labels, heard in takes:
        if len(labels) != heard.n_frames:
            raise InvalidValueError(f"{heard.n_frames} frames need labels, not {len(labels)}")
        names.update(labels.tolist())
        moving = labels != ""
        for segment, placement in zip(heard.segments, heard.placements, strict=True):
            part = slice(segment.start, segment.end)
            if segment.still or placement is None:
                moving[part] = False
            elif not placement.refused:
                account.take(placement, labels[part])
        account.n_moving += int(moving.sum())
    return account.rates(tuple(sorted(names - {""})))


class _Account:
    """What has been said so far."""

    def __init__(self) -> None:
        self.membership = Membership()
        self.shows: dict[int, str] = {}  # activity of each placed segment, by its number
        self.frames: dict[int, int] = {}  # how many of its frames are of that activity
        self.born: dict[int, str] = {}  # activity of each node as it was born
        self.seen: Counter[str] = Counter()  # segments of each activity
        self.demonstrations: dict[str, int] = {}
        self.wrong = self.recognised = self.n_moving = 0

    def take(self, placement: Placement, labels: NDArray[Any]) -> None:
        """Take what was said of a segment whose frames have certain labels, shape (L,)."""
        (label, n), *_ = Counter(labels.tolist()).most_common(1)
        label = label if 2 * n > len(labels) else ""
        self.seen[label] += 1
        if placement.recognised and label:
            right = self.born.get(recognised_as(placement)) == label
            self.wrong += not right
            self.recognised += n * right
        self.shows[placement.number] = label
        self.frames[placement.number] = n if label else 0
        self.membership.take(placement)
        for node in placement.born:
            label = _commonest(self._votes(self.membership.members(node)))
            self.born[node] = label
            if label:
                self.demonstrations.setdefault(label, self.seen[label])

    def _votes(self, numbers: Iterable[int]) -> Counter[str]:
        votes: Counter[str] = Counter()
        for number in numbers:
            if self.shows[number]:
                votes[self.shows[number]] += self.frames[number]
        return votes

    def rates(self, activities: tuple[str, ...]) -> OwnershipRates:
        """Return the account's balance."""
        groups: dict[int, list[int]] = defaultdict(list)
        for number, node in self.membership.home.items():
            if node != ROOT:
                groups[node].append(number)
        votes = {node: self._votes(numbers) for node, numbers in groups.items()}
        primitives = {node: _commonest(each) for node, each in votes.items()}
        covered = sum(each.total() for each in votes.values())
        purest = sum(max(each.values(), default=0) for each in votes.values())
        return OwnershipRates(
            activities=activities,
            primitives=primitives,
            purity=purest / covered if covered else float("nan"),
            n_moving=self.n_moving,
            n_covered=covered,
            n_inside=sum(votes[node][label] for node, label in primitives.items() if label),
            n_recognised=self.recognised,
            n_found=len(self.shows),
            n_wrong=self.wrong,
            demonstrations=self.demonstrations,
            shown=tuple(
                (self.shows[number], node)
                for node, numbers in groups.items()
                for number in numbers
                if self.shows[number]
            ),
        )


def _commonest(votes: Counter[str]) -> str:
    """Return what has more than half of the votes; empty where nothing has."""
    if not votes:
        return ""
    label, n = votes.most_common(1)[0]
    return label if 2 * n > votes.total() else ""

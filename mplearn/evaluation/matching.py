"""Which class of the truth each found segment shows.

Found and true segments are matched one to one, those with the largest overlap first. Two may match
if their intersection is more than half of their union (IoU over 0.5), where a boundary that lies
within `TOLERANCE_S` of the true one counts as equal to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import InvalidValueError
from ..recording import LabelledSegment, Segment

TOLERANCE_S = 0.25
LEAST_IOU = 0.5


@dataclass(frozen=True)
class Matching:
    """Pairs of found and true segments, one to one.

    Attributes:
        truth_of: Index of the true segment that each found one shows; -1 where it shows none,
            length n_found.
        found_of: Index of the found segment that shows each true one; -1 where none does, length
            n_truth.
        labels: Class of each found segment; empty where it shows none, length n_found.

    Example:
        >>> from mplearn.recording import LabelledSegment, Segment
        >>> truth = [LabelledSegment(0, 100, "wave"), LabelledSegment(100, 200, "bow")]
        >>> matching = match_segments(truth, [Segment(3, 98), Segment(300, 400)], 100.0)
        >>> matching.truth_of, matching.found_of
        ((0, -1), (0, -1))
    """

    truth_of: tuple[int, ...]
    found_of: tuple[int, ...]
    labels: tuple[str, ...]

    @property
    def n_matched(self) -> int:
        """Number of pairs."""
        return sum(index >= 0 for index in self.truth_of)


def match_segments(
    truth: Sequence[LabelledSegment],
    found: Sequence[Segment],
    rate_hz: float,
    *,
    tolerance_s: float = TOLERANCE_S,
) -> Matching:
    """Match found segments to the truth.

    Args:
        truth: True segments, in order, without overlap; pauses are gaps between them.
        found: Found segments, in order; still ones match nothing.
        rate_hz: Frames per second [1/s].
        tolerance_s: How far each boundary may lie off without counting [s].

    Raises:
        InvalidValueError: The rate is not positive, or the tolerance negative.

    Example:
        >>> from mplearn.recording import LabelledSegment, Segment
        >>> truth = [LabelledSegment(0, 100, "wave"), LabelledSegment(100, 200, "bow")]
        >>> matching = match_segments(truth, [Segment(3, 98), Segment(98, 150)], 100.0)
        >>> matching.labels, matching.n_matched
        (('wave', ''), 1)
    """
    if not rate_hz > 0 or not tolerance_s >= 0:
        raise InvalidValueError(
            f"rate_hz > 0 and tolerance_s >= 0 are needed, not {rate_hz} and {tolerance_s}"
        )
    truth_of = [-1] * len(found)
    found_of = [-1] * len(truth)
    for i, j, _ in sorted(_overlapping(truth, found, tolerance_s * rate_hz), key=lambda p: -p[2]):
        if found_of[i] < 0 and truth_of[j] < 0:
            found_of[i], truth_of[j] = j, i
    labels = tuple(truth[index].label if index >= 0 else "" for index in truth_of)
    return Matching(tuple(truth_of), tuple(found_of), labels)


def tolerant_iou(truth: LabelledSegment, found: Segment, tolerance_frames: float) -> float:
    """Return intersection over union, boundaries within the tolerance counting as equal.

    The tolerance never exceeds a quarter of the true segment: a short motion must still be hit.
    """
    slack = min(tolerance_frames, 0.25 * (truth.end - truth.start))
    start = found.start if abs(found.start - truth.start) > slack else truth.start
    end = found.end if abs(found.end - truth.end) > slack else truth.end
    common = min(truth.end, end) - max(truth.start, start)
    return max(0, common) / (max(truth.end, end) - min(truth.start, start))


def _overlapping(
    truth: Sequence[LabelledSegment], found: Sequence[Segment], tolerance_frames: float
) -> list[tuple[int, int, float]]:
    """Return the pairs that may match, with their overlap: both lists are in order of time."""
    pairs = []
    first = 0
    for i, true in enumerate(truth):
        while first < len(found) and found[first].end <= true.start:
            first += 1
        for j in range(first, len(found)):
            if found[j].start >= true.end:
                break
            overlap = tolerant_iou(true, found[j], tolerance_frames)
            if overlap > LEAST_IOU and not found[j].still:
                pairs.append((i, j, overlap))
    return pairs

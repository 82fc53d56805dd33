"""How well the boundaries of a segmentation agree with the truth.

A boundary lies between two motions. Where they follow each other it is an instant; where a pause
lies between them it is the whole pause, and any instant within is right. Truth and segmentation are
treated alike: a pause of the truth is a gap between its labels, one of the segmentation a segment
with ``still=True``. Boundaries are matched one to one, as many as possible within a tolerance.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray, LabelledSegment, Segment


@dataclass(frozen=True)
class Boundary:
    """The end of one motion and the start of the next.

    Attributes:
        start: Frame at which the motion before it ends.
        end: Frame at which the motion after it starts; ``start`` again where no pause lies between.
        delay_frames: How long after ``start`` this was decided.
    """

    start: int
    end: int
    delay_frames: int = 0

    def distance(self, other: Boundary) -> int:
        """Frames between the two, 0 where they overlap."""
        return max(0, self.start - other.end, other.start - self.end)


@dataclass(frozen=True, eq=False)
class BoundaryScore:
    """Agreement of boundaries, for one stream or several.

    Attributes:
        n_truth: Boundaries of the truth.
        n_found: Boundaries of the segmentation, inside the labelled stretch.
        errors_s: Distance of each matched pair [s], shape (n_matched,).
        delays_s: Delay of the decision for each matched boundary [s], shape (n_matched,).

    Example:
        >>> import numpy as np
        >>> errors_s, delays_s = np.array([0.02, 0.01]), np.array([0.3, 0.4])
        >>> score = BoundaryScore(4, 3, errors_s, delays_s)
        >>> score.recall, round(score.precision, 3), round(score.f1, 3)
        (0.5, 0.667, 0.571)
    """

    n_truth: int
    n_found: int
    errors_s: FloatArray
    delays_s: FloatArray

    @property
    def n_matched(self) -> int:
        """Number of pairs."""
        return len(self.errors_s)

    @property
    def recall(self) -> float:
        """Share of the true boundaries that were found; 1 where there are none."""
        return self.n_matched / self.n_truth if self.n_truth else 1.0

    @property
    def precision(self) -> float:
        """Share of the found boundaries that are true; 1 where there are none."""
        return self.n_matched / self.n_found if self.n_found else 1.0

    @property
    def f1(self) -> float:
        """Harmonic mean of recall and precision."""
        total = self.n_truth + self.n_found
        return 2.0 * self.n_matched / total if total else 1.0

    @property
    def median_error_s(self) -> float:
        """Median distance of matched boundaries [s]; NaN where none matched."""
        return float(np.median(self.errors_s)) if self.n_matched else float("nan")

    @property
    def median_delay_s(self) -> float:
        """Median delay of the decision [s]; NaN where none matched."""
        return float(np.median(self.delays_s)) if self.n_matched else float("nan")

    @staticmethod
    def pooled(scores: Iterable[BoundaryScore]) -> BoundaryScore:
        """Return the score of several streams together: every boundary counts the same."""
        parts = list(scores)
        return BoundaryScore(
            n_truth=sum(part.n_truth for part in parts),
            n_found=sum(part.n_found for part in parts),
            errors_s=np.concatenate([np.zeros(0), *(part.errors_s for part in parts)]),
            delays_s=np.concatenate([np.zeros(0), *(part.delays_s for part in parts)]),
        )


def found_boundaries(segments: Sequence[Segment]) -> tuple[Boundary, ...]:
    """Return the boundaries of a segmentation; the ends of the stream are none.

    Consecutive still segments are one pause; one at the stream's start or end bounds the motion
    beside it at an instant.
    """
    boundaries: list[Boundary] = []
    i = 0
    while i < len(segments):
        j = i
        while j < len(segments) and segments[j].still:
            j += 1
        before = segments[i - 1] if i > 0 else None
        if j > i:  # a pause, [i, j)
            after = j < len(segments)
            if before is not None:
                end = segments[j - 1].end if after else before.end
                boundaries.append(Boundary(before.end, end, before.decided_at - before.end))
            elif after:
                last = segments[j - 1]
                boundaries.append(Boundary(last.end, last.end, last.decided_at - last.end))
            i = j
        elif before is not None and not before.still:
            boundaries.append(Boundary(before.end, before.end, before.decided_at - before.end))
        i += 1
    return tuple(boundaries)


def true_boundaries(
    labels: Sequence[LabelledSegment], n_frames: int, tolerance_frames: int
) -> tuple[Boundary, ...]:
    """Return the boundaries of the truth, those at the stream's very ends left out.

    Args:
        labels: Labelled motions, in order of their start, without overlap.
        n_frames: Length of the stream.
        tolerance_frames: How near to an end of the stream a boundary does not count.

    Raises:
        InvalidValueError: Labels overlap or are out of order.
    """
    boundaries: list[Boundary] = []
    for a, b in itertools.pairwise(labels):
        if b.start < a.end:
            raise InvalidValueError(
                f"labels must follow each other without overlap: [{a.start}, {a.end}) {a.label!r} "
                f"and [{b.start}, {b.end}) {b.label!r}"
            )
        boundaries.append(Boundary(a.end, b.start))
    if labels and labels[0].start > tolerance_frames:
        boundaries.insert(0, Boundary(labels[0].start, labels[0].start))
    if labels and labels[-1].end < n_frames - tolerance_frames:
        boundaries.append(Boundary(labels[-1].end, labels[-1].end))
    return tuple(boundaries)


def match_boundaries(
    truth: Sequence[Boundary], found: Sequence[Boundary], tolerance_frames: int
) -> tuple[tuple[int, int], ...]:
    """Match one to one: as many pairs within the tolerance as possible, then the nearest ones.

    Returns:
        Pairs of an index into `truth` and one into `found`, in order.
    """
    from scipy.optimize import linear_sum_assignment

    if not truth or not found:
        return ()
    distance = np.array([[t.distance(f) for f in found] for t in truth], dtype=np.float64)
    allowed = distance <= tolerance_frames
    # one more pair outweighs any saving of distance
    value = np.where(allowed, (tolerance_frames + 1.0) * (len(truth) + 1.0) - distance, 0.0)
    rows, columns = linear_sum_assignment(value, maximize=True)
    return tuple((int(i), int(j)) for i, j in zip(rows, columns, strict=True) if allowed[i, j])


def score_boundaries(
    segments: Sequence[Segment],
    labels: Sequence[LabelledSegment],
    rate_hz: float,
    tolerance_s: float = 0.25,
) -> BoundaryScore:
    """Score a segmentation of a stream against its labels.

    Boundaries found outside the labelled stretch, or at the very ends of the stream, are ignored.

    Args:
        segments: The segmentation, from frame 0 to the stream's end.
        labels: Labelled motions, in order, without overlap; they may cover a part of the stream.
        rate_hz: Frames per second [1/s].
        tolerance_s: Largest distance of a match [s].

    Raises:
        InvalidValueError: There are no labels, or they overlap.

    Example:
        >>> found = [Segment(0, 103), Segment(103, 180), Segment(180, 300)]
        >>> truth = [LabelledSegment(0, 100, "raise"), LabelledSegment(100, 300, "lower")]
        >>> score = score_boundaries(found, truth, rate_hz=100.0)
        >>> score.n_truth, score.n_found, score.median_error_s
        (1, 2, 0.03)
    """
    if not labels:
        raise InvalidValueError("a stream without labels cannot be scored")
    tolerance = round(tolerance_s * rate_hz)
    n_frames = segments[-1].end if segments else labels[-1].end
    truth = true_boundaries(labels, n_frames, tolerance)
    span = Boundary(labels[0].start, labels[-1].end)
    found = [
        f
        for f in found_boundaries(segments)
        if span.distance(f) <= tolerance and tolerance < f.end and f.start < n_frames - tolerance
    ]
    pairs = match_boundaries(truth, found, tolerance)
    return BoundaryScore(
        n_truth=len(truth),
        n_found=len(found),
        errors_s=np.array([truth[i].distance(found[j]) for i, j in pairs], dtype=float) / rate_hz,
        delays_s=np.array([found[j].delay_frames for _, j in pairs], dtype=float) / rate_hz,
    )

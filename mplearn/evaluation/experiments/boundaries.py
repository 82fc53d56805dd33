"""How well each segmenter finds the boundaries between repetitions in people's raw takes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from ...body import view_of
from ...recording import LabelledSegment, Recording
from ...segmentation import SEGMENTERS, make_segmenter
from ..boundaries import BoundaryScore, score_boundaries
from ..executions import split_repetitions
from ..observing import observe
from ..table import Table, percent
from .sessions import by_person

TOLERANCE_S = 0.25


def boundary_table(takes: Iterable[Recording]) -> Table:
    """Segment every take with every segmenter and score the boundaries.

    Args:
        takes: Recordings of markers with labelled repetitions, of any number of people.

    Returns:
        One row a segmenter and person, and one over all people.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> wave = 1 - np.cos(2 * np.pi * np.arange(400) / 100)  # four repetitions
        >>> labels = tuple(LabelledSegment(100 * k, 100 * k + 100, "up") for k in range(4))
        >>> take = Recording(wave[:, None], 100.0, ("elbow",), labels=labels, person="anna")
        >>> table = boundary_table([take])
        >>> table.columns[:3]
        ('segmenter', 'person', 'repetition joins: recall')
    """
    scores: dict[tuple[str, str], list[tuple[BoundaryScore, BoundaryScore]]] = defaultdict(list)
    for person, own in by_person(takes).items():
        for take in split_repetitions(own):
            features = observe(take)
            seen = view_of(features.channels).see(features.frames)  # as a learner sees them
            for name in SEGMENTERS:
                segmenter = make_segmenter(name, seen.shape[1], features.rate_hz)
                segments = segmenter.segment(seen)
                all_ends = score_boundaries(
                    segments, take.labels, take.rate_hz, tolerance_s=TOLERANCE_S
                )
                joins = score_boundaries(
                    segments, repetitions(take.labels), take.rate_hz, tolerance_s=TOLERANCE_S
                )
                scores[name, person].append((all_ends, joins))
                scores[name, "all"].append((all_ends, joins))
    rows = [_row(name, person, pairs) for (name, person), pairs in sorted(scores.items())]
    return Table(
        title="Boundaries found on-line in people's takes",
        columns=(
            "segmenter",
            "person",
            "repetition joins: recall",
            "all boundaries: recall",
            "precision",
            "F1",
            "median error",
            "median delay",
            "decided within 0.2 s",
        ),
        rows=tuple(rows),
        note=(
            f"Matched one to one within {TOLERANCE_S} s. All boundaries: joins of repetitions, and "
            "the reversal inside each, which is found from the farthest posture; a cut there is "
            "right. A take's first repetition is left out: it starts in the middle of a motion."
        ),
    )


def repetitions(labels: Sequence[LabelledSegment]) -> tuple[LabelledSegment, ...]:
    """Join the two halves of each repetition again."""
    pairs = zip(labels[::2], labels[1::2], strict=True)
    return tuple(
        LabelledSegment(a.start, b.end, a.label.rpartition("-")[0], a.person) for a, b in pairs
    )


def _row(
    name: str, person: str, pairs: Sequence[tuple[BoundaryScore, BoundaryScore]]
) -> tuple[str, ...]:
    ends = BoundaryScore.pooled(pair[0] for pair in pairs)
    joins = BoundaryScore.pooled(pair[1] for pair in pairs)
    return (
        name,
        person,
        percent(joins.recall),
        percent(ends.recall),
        percent(ends.precision),
        f"{ends.f1:.3f}",
        f"{1000 * ends.median_error_s:.0f} ms",
        f"{1000 * ends.median_delay_s:.0f} ms",
        percent(float(np.mean(ends.delays_s <= 0.2)) if ends.n_matched else float("nan"), 0),
    )

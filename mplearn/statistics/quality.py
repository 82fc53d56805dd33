"""How well motions are performed, against executions that are taken for right."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from ..library import SegmentTable
from ..recording import FloatArray

_FEWEST = 3  # executions that a primitive is judged by


def quality(table: SegmentTable, reference: SegmentTable) -> FloatArray:
    """Return how usual each segment would be among executions that are taken for right.

    It is the share of the reference's executions of the nearest primitive that lie at least as far
    from what was learned, in (0, 1]: small for what is performed otherwise. For an execution like
    the reference's it is drawn evenly from that range, so a threshold is a rate of false alarms.

    Args:
        table: What is judged.
        reference: What is taken for right, recognised by the same library, and not learned by it:
            what it has learned lies nearer.

    Returns:
        A share for each segment of the table; NaN where the reference holds fewer than three
        executions of its primitive, or nothing is near.

    Example:
        >>> from mplearn.library import RecognisedSegment
        >>> def row(d):
        ...     return RecognisedSegment("t", 0, 1, 1, "bow", "bow", d, 0.5)
        >>> right = SegmentTable([row(d) for d in (0.1, 0.2, 0.3, 0.4)])
        >>> quality(SegmentTable([row(0.25), row(2.0)]), right).tolist()
        [0.6, 0.2]
    """
    known: defaultdict[str, list[float]] = defaultdict(list)
    for row in reference:
        if row.name and np.isfinite(row.distance):
            known[row.name].append(row.distance)
    found = np.full(len(table), np.nan)
    for k, row in enumerate(table):
        distances = np.array(known.get(row.nearest, ()))
        if len(distances) >= _FEWEST and np.isfinite(row.distance):
            found[k] = (1 + (distances >= row.distance).sum()) / (1 + len(distances))
    return found

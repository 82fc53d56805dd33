"""Activities in labelled recordings, coarser than primitives, their number not given."""

from __future__ import annotations

from collections.abc import Iterable

from ...activities import find_activities, postures_of
from ...recording import IntArray, Recording
from ..observing import observe
from ..ownership import frame_labels
from ..partitions import Agreement, agreement
from ..table import Table


def activities_in(recording: Recording) -> IntArray:
    """Return the activity of each frame, shape (T,), as found in markers or in other channels."""
    seen = observe(recording)
    return find_activities(postures_of(seen.frames, seen.channels), seen.rate_hz)


def activity_table(recordings: Iterable[Recording]) -> Table:
    """Find the activities of labelled recordings and compare them with the labels.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> t = np.arange(6000) / 50.0
        >>> frames = np.stack((np.sin(4 * t) * (t < 60), np.sin(5 * t) * (t >= 60)), axis=1)
        >>> labels = LabelledSegment(0, 3000, "arms"), LabelledSegment(3000, 6000, "legs")
        >>> take = Recording(frames, 50.0, ("arm", "leg"), name="both", labels=labels)
        >>> table = activity_table([take])
        >>> dict(zip(table.columns, table.rows[0], strict=True))["ARI"]
        '1.00'
    """
    rows = []
    for recording in recordings:
        truth = frame_labels(recording.labels, len(recording))
        found = activities_in(recording)
        labelled = truth != ""
        rows.append(_row(recording.name, agreement(truth[labelled], found[labelled])))
    columns = ("recording", "ARI", "NMI", "covering", "change points, F1", "classes", "found")
    note = (
        "Activities, their number not given, found in the whole recording and compared frame by "
        "frame over the labelled stretch. Change points match one to one within 1 % of the "
        "labelled stretch; its start counts for nothing."
    )
    return Table("Activities in recordings", columns, tuple(rows), note)


def _row(name: str, result: Agreement) -> tuple[str, ...]:
    scores = (result.ari, result.nmi, result.covering, result.change_f1)
    return name, *(f"{s:.2f}" for s in scores), str(result.n_true), str(result.n_found)

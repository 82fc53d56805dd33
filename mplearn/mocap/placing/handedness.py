"""From left-handed axes, as those of Unity and Unreal, to ours."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...maths.read_only import read_only
from ...recording import Recording
from ..files import bad_file

OTHER_HAND = read_only(np.diag((1.0, -1.0, 1.0)))
"""Matrix that turns y, to the left, round."""


def right_handed(path: Path, recording: Recording) -> Recording:
    """Return points whose axes were left-handed, as they are with right-handed ones; it is noted.

    Args:
        path: Where they come from, for messages.
        recording: Markers or joints [m], z up.

    Raises:
        RecordingError: Its channels are no points.
    """
    if not recording.is_markers:
        raise bad_file(path, "channels that are no points", "points, if axes are left-handed")
    skeleton, report = recording.skeleton, recording.report
    if report is not None:
        note = "its axes are taken as left-handed: one is turned round"
        report = replace(report, notes=(*report.notes, note))
    if skeleton is not None:
        skeleton = replace(skeleton, offsets=skeleton.offsets @ OTHER_HAND)
    return replace(
        recording,
        frames=(recording.markers @ OTHER_HAND).reshape(len(recording), -1),
        skeleton=skeleton,
        report=report,
    )

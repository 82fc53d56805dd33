"""Where frames wait for a learner that is slower than the stream."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from mplearn.sources import BufferedSource, Source

_READ_AHEAD, _HELD_UP = 2**17, 2**22  # bytes of a source that waits: to be read, or to send


def waiting_for_learner(
    source: Source,
    *,
    speed: float | None = None,
    beside: Path | None = None,
    arrived: Callable[[], object] = lambda: None,
) -> BufferedSource:
    """Read a source at once, and let wait what is not learned yet.

    Of what waits itself for whoever reads, as a file that is learned as fast as it can be, and a
    sender that is held up, little is read ahead.

    Args:
        source: The stream.
        speed: Times as fast as in time that it comes.
        beside: File in whose folder, or the next above that is there, it waits; the system's
            place for such, where None.
        arrived: See `mplearn.sources.BufferedSource`.
    """
    if speed == math.inf:
        return BufferedSource(source, most_bytes=_READ_AHEAD, arrived=arrived)
    if source.name.startswith("ndjson:"):
        return BufferedSource(source, most_bytes=_HELD_UP, arrived=arrived)
    above = () if beside is None else beside.absolute().parents
    folder = next((each for each in above if each.is_dir()), None)
    return BufferedSource(source, folder=folder, arrived=arrived)

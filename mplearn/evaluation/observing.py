"""A recording of markers as the learner sees it."""

from __future__ import annotations

from dataclasses import replace

from ..body import MotionObserver
from ..recording import Recording


def observe(recording: Recording) -> Recording:
    """Return the robot's features of a recording of markers, labels kept; others as they are.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> taught = demonstrate(["BAR", "BAL"], seed=1, rate_hz=50.0).recording
        >>> seen = observe(taught)
        >>> len(seen.channels), seen.labels == taught.labels
        (33, True)
    """
    if not recording.is_markers:
        return recording
    observer = MotionObserver(recording.marker_names, recording.rate_hz)
    frames = observer.observe(recording.frames)
    return replace(recording, frames=frames, channels=observer.channels)

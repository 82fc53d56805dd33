"""What a learner remembers of each segment of its stream, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..recording import Segment


@dataclass
class SeenSegment:
    """A segment of the stream, and what it was recognised as.

    Attributes:
        number: The tree's number of the segment.
        primitive: What it was recognised as; None for nothing.
        follows: Whether it came right after the one before it.
        segment: Where it lies.
        nearest: The primitive that it was nearest to, recognised or not; None for none.
        like: Number of the segment that it was like when neither was known; None for none.
    """

    number: int
    primitive: int | None
    follows: bool
    segment: Segment
    nearest: int | None = None
    like: int | None = None


def run_before(
    segments: Sequence[SeenSegment],
    i: int,
    longest: int,
    motion_of: Callable[[SeenSegment], int | None],
) -> list[int]:
    """Return the motions before segment i, oldest first, as far as nothing breaks them off.

    Args:
        segments: The chain.
        i: Place of the segment.
        longest: How many are returned at most.
        motion_of: Returns the motion that a segment shows; None breaks the run.
    """
    run: list[int] = []
    while i > 0 and segments[i].follows and len(run) < longest:
        i -= 1
        motion = motion_of(segments[i])
        if motion is None:
            break
        run.insert(0, motion)
    return run


def step_s(segments: Sequence[SeenSegment], i: int, rate_hz: float) -> float:
    """Return the time from the start of the segment before segment i to its own start [s]."""
    return (segments[i].segment.start - segments[i - 1].segment.start) / rate_hz

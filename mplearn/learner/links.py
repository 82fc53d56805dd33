"""The segments of a stream as links of a chain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..recording import Segment


@dataclass
class Link:
    """A segment in the chain.

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
    links: Sequence[Link], i: int, longest: int, motion_of: Callable[[Link], int | None]
) -> list[int]:
    """Return the motions before link i, oldest first, as far as nothing breaks them off.

    Args:
        links: The chain.
        i: Place of the link.
        longest: How many are returned at most.
        motion_of: Returns the motion that a link shows; None breaks the run.
    """
    run: list[int] = []
    while i > 0 and links[i].follows and len(run) < longest:
        i -= 1
        motion = motion_of(links[i])
        if motion is None:
            break
        run.insert(0, motion)
    return run


def step_s(links: Sequence[Link], i: int, rate_hz: float) -> float:
    """Return the time from the start of the link before link i to its own start [s]."""
    return (links[i].segment.start - links[i - 1].segment.start) / rate_hz

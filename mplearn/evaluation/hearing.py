"""What a learner says of takes, learned one after another as a user would."""

from __future__ import annotations

from dataclasses import replace

from ..learner import MotionLearner, SegmentClosed
from ..recording import Recording, Segment
from .ownership import Heard

BLOCK_FRAMES = 128


def hear(learner: MotionLearner, take: Recording) -> Heard:
    """Learn a take as a stream of its own and return what was said of it.

    Raises:
        FrameError: The take has other channels than the learner, or another rate.
        BodyError: The person in it cannot be observed.
    """
    start = learner.n_frames
    events = [e for block in learner.learn_recording(take, BLOCK_FRAMES) for e in block]
    closed = [e for e in events if isinstance(e, SegmentClosed)]
    return Heard(
        len(take),
        tuple(_earlier(e.segment, start) for e in closed),
        tuple(e.placement for e in closed),
    )


def _earlier(segment: Segment, frames: int) -> Segment:
    decided_at = segment.decided_at - frames if segment.decided_at >= 0 else -1
    start, end = segment.start - frames, segment.end - frames
    return replace(segment, start=start, end=end, decided_at=decided_at)

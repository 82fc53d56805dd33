"""What the tests of protocols share: who sends, and how it is learned."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.recording import FloatArray
from mplearn.sources import Block, Change, Source


def gather(
    source: Source, send: Callable[[], object], n_frames: int, *, seconds: float = 60.0
) -> list[Block | Change]:
    """Return what a source yields until so many frames, lost ones too, have come out."""
    items: list[Block | Change] = []
    send()
    until = time.monotonic() + seconds
    while sum(len(i) for i in items if isinstance(i, Block)) < n_frames:
        items += source.read(0.1)
        assert time.monotonic() < until, [i for i in items if isinstance(i, Change)]
    return items


def keep_up(source: Source, sent: int, most: int = 150) -> None:
    """Wait until a source has read all but so many frames: UDP drops what is too much.

    It reads none of the first second before it knows the rate.
    """
    until = time.monotonic() + 60.0
    while source.tally.frames < sent - most and time.monotonic() < until:
        time.sleep(0.001)


def learned(items: Sequence[Block | Change], path: Path) -> bytes:
    """Return the learner of what was gathered, as bytes."""
    blocks = [item for item in items if isinstance(item, Block)]
    learner = MotionLearner(LearnerConfig(blocks[0].channels, blocks[0].rate_hz))
    for block in blocks:
        if not block.joins and learner.n_frames:
            learner.end_stream()
        learner.learn_many(block.frames)
    learner.end_stream()
    return learner.save(path).read_bytes()


def learned_from(
    frames: FloatArray, channels: tuple[str, ...], rate_hz: float, path: Path
) -> bytes:
    """Return the learner of a recording, as bytes."""
    learner = MotionLearner(LearnerConfig(channels, rate_hz))
    learner.learn_many(np.asarray(frames))
    learner.end_stream()
    return learner.save(path).read_bytes()

"""Streams made here: what a source would send, without a network."""

from collections.abc import Sequence

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.learner import Event
from mplearn.recording import FloatArray
from mplearn.sources import Block, Change, Source, Stream, Tally


class Given(Source):
    """Hands out what it was given."""

    def __init__(self, items: Sequence[Block | Change]) -> None:
        self.name, self.tally, self._items = "given:", Tally(), list(items)

    @property
    def ended(self) -> bool:
        return not self._items

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        item = self._items.pop(0)
        if isinstance(item, Block):
            self.tally.frames += len(item)
        return [item]

    def close(self) -> None:
        self._items.clear()


def blocks(stream: Stream, frames: FloatArray, first: int = 0, size: int = 7) -> list[Block]:
    """Return frames in blocks, as if they had come in time."""
    times = (first + np.arange(len(frames))) / stream.rate_hz
    return [
        Block(stream, frames[i : i + size], times[i : i + size], times[i : i + size])
        for i in range(0, len(frames), size)
    ]


def frames_of(items: Sequence[Block | Change]) -> FloatArray:
    return np.concatenate([item.frames for item in items if isinstance(item, Block)])


def texts_of(items: Sequence[Block | Change], kind: str) -> list[str]:
    return [item.text for item in items if isinstance(item, Change) and item.kind == kind]


def learn(source: Source) -> tuple[MotionLearner, list[Event]]:
    """Learn all that a source yields, as a user would."""
    learner: MotionLearner | None = None
    events: list[Event] = []
    for item in source:
        if isinstance(item, Change):
            continue
        if learner is None:
            learner = MotionLearner(LearnerConfig(item.channels, item.rate_hz))
        elif not item.joins:
            events += learner.end_stream()
        events += learner.learn_many(item.frames)
    assert learner is not None
    events += learner.end_stream()
    return learner, events

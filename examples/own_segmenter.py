"""Cut the stream by a rule of one's own: here every second, as a baseline.

python examples/own_segmenter.py
"""

import numpy as np

from mplearn import LearnerConfig, MotionLearner, Segment
from mplearn.demonstrator import demonstrate
from mplearn.errors import FrameError
from mplearn.recording import FloatArray
from mplearn.segmentation import Segmenter, SegmenterState, register_segmenter


class EverySecond(Segmenter):
    """Closes a segment each second."""

    def __init__(self, n_channels: int, rate_hz: float) -> None:
        self.n_channels, self.rate_hz, self.n_frames = n_channels, rate_hz, 0

    def update(self, frame: FloatArray) -> list[Segment]:
        if np.shape(frame) != (self.n_channels,) or not np.isfinite(frame).all():
            raise FrameError(f"a frame is {self.n_channels} finite numbers")
        self.n_frames += 1
        length = round(self.rate_hz)
        if self.n_frames % length:
            return []
        return [Segment(self.n_frames - length, self.n_frames, decided_at=self.n_frames)]

    def flush(self) -> list[Segment]:
        end, self.n_frames = self.n_frames, 0
        start = end - end % round(self.rate_hz)
        return [Segment(start, end, decided_at=end)] if start < end else []

    def state(self) -> SegmenterState:
        return SegmenterState(type(self).__name__, self.rate_hz, self.n_frames, {})

    def load_state(self, state: SegmenterState) -> None:
        self.n_frames = state.n_frames

    def scaffold(self, weights: FloatArray | None = None, ending: float = 0.5) -> None:
        """A clock needs no hints."""


register_segmenter("every second", EverySecond)

recording = demonstrate(["BAD", "BAU"] * 8, seed=1).recording
for name in ("kohlmorgen-lemm", "every second"):
    settings = LearnerConfig(recording.channels, recording.rate_hz, segmenter=name)
    learner = MotionLearner(settings)
    learner.learn_many(recording.frames)
    learner.end_stream()
    print(f"{name}: {len(learner.snapshot())} primitives")

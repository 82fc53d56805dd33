"""What keeping a learner, and taking a library of it, cost once one more segment was learned."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.recording import Segment
from mplearn.state import Kept, checkpoint

T = TypeVar("T")
_CHANNELS, _RATE_HZ, _KEYS = 20, 100.0, 4


class Teacher:
    """Performs motions, each a smooth curve through key postures of its own."""

    def __init__(self, n_motions: int) -> None:
        self.rng = np.random.default_rng(3)
        self.keys = self.rng.normal(0, 1, (n_motions, _KEYS, _CHANNELS))

    def perform(self, motion: int) -> np.ndarray:
        """Return one execution, shape (L, D)."""
        n_frames = int(self.rng.integers(40, 70))
        at = np.linspace(0, _KEYS - 1, n_frames)
        low = np.minimum(at.astype(int), _KEYS - 2)
        share = (1 - np.cos(np.pi * (at - low)))[:, None] / 2
        keys = self.keys[motion] * self.rng.normal(1, 0.05)
        curve = (1 - share) * keys[low] + share * keys[low + 1]
        return curve + self.rng.normal(0, 0.02, curve.shape)


def teach(learner: MotionLearner, frames: np.ndarray) -> None:
    """Let a learner learn from a segment, as if its segmenter had closed it."""
    learner._form_rest()
    start = learner.n_frames
    learner.n_frames += len(frames)
    learner._stream_start = learner.n_frames
    learner._place(Segment(start, learner.n_frames), frames)


def rows() -> list[tuple[str, str, str, str]]:
    """Return what a state, a checkpoint and a snapshot cost, of 22 and of 1,000 primitives."""
    table = []
    for n in (22, 1000):
        teacher = Teacher(n)
        channels = tuple(f"joint_{i}" for i in range(_CHANNELS))
        learner = MotionLearner(LearnerConfig(channels, _RATE_HZ))
        for motion in range(n):
            for _ in range(5):
                teach(learner, teacher.perform(motion))
        title = f"{len(learner.tree.leaves)} primitives: "
        first_s, state = _timed(learner.state)
        packed_s, made = _timed(partial(checkpoint, state))
        first_library_s, _ = _timed(learner.snapshot)
        size = len(made.document) + sum(map(len, made.new.values()))
        more = one_more(learner, teacher, n)
        first = _ms([first_s]), _ms([packed_s]), _kb([size]), _ms([first_library_s])
        table += [
            (title + what, took, at_first, "the first one")
            for (what, took), at_first in zip(more.items(), first, strict=True)
        ]
    return table


def one_more(learner: MotionLearner, teacher: Teacher, n: int) -> dict[str, str]:
    """Return what a state, a checkpoint and a snapshot cost after one segment more, the median.

    Args:
        learner: Who has learned ``n`` motions.
        teacher: Who performs them.
        n: Number of motions.
    """
    state_s, packing_s, library_s, sizes = [], [], [], []
    kept = Kept()
    kept.add(0, checkpoint(learner.state()).held)
    for k in range(1, 10):
        teach(learner, teacher.perform(int(teacher.rng.integers(n))))
        took_s, state = _timed(learner.state)
        state_s.append(took_s)
        took_s, made = _timed(partial(checkpoint, state, kept))
        packing_s.append(took_s)
        sizes.append(len(made.document) + sum(map(len, made.new.values())))
        kept.add(k, made.held)
        kept.drop(k - 1)
        library_s.append(_timed(learner.snapshot)[0])
    return {
        "state": _ms(state_s),
        "checkpoint": _ms(packing_s),
        "bytes written": _kb(sizes),
        "snapshot": _ms(library_s),
    }


def _timed(function: Callable[[], T]) -> tuple[float, T]:
    begin = time.process_time()
    found = function()
    return time.process_time() - begin, found


def _ms(seconds: list[float]) -> str:
    return f"{1e3 * float(np.median(seconds)):.1f} ms"


def _kb(sizes: list[int]) -> str:
    return f"{float(np.median(sizes)) / 1e3:.0f} kB"

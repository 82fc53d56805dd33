"""A stream that is cheap to learn: bumps of four channels, with rests between them."""

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.recording import FloatArray

CHANNELS = ("a", "b", "c", "d")
RATE_HZ = 50.0


def stream(seconds: float, seed: int = 0, n_motions: int = 5) -> FloatArray:
    """Return frames, shape (T, 4), in which some motions come again and again."""
    rng = np.random.default_rng(seed)
    shapes = np.random.default_rng(7).normal(size=(n_motions, 2, 4))
    parts: list[FloatArray] = []
    n = 0
    while n < seconds * RATE_HZ:
        length = int(rng.integers(40, 60))
        t = np.linspace(0, 1, length)[:, None]
        one, two = shapes[rng.integers(n_motions)] * rng.normal(1.0, 0.05, size=(2, 1))
        motion = one * np.sin(np.pi * t) ** 2 + two * np.sin(2 * np.pi * t) ** 2
        rest = np.zeros((int(rng.integers(15, 30)), 4))
        parts += [motion, rest]
        n += length + len(rest)
    frames = np.concatenate(parts)[: int(seconds * RATE_HZ)]
    return np.asarray(frames + 0.002 * rng.normal(size=frames.shape))


def times(frames: FloatArray, first: int = 0) -> FloatArray:
    """Return when each frame was taken, by a clock that never jumps."""
    return 1.7e9 + (first + np.arange(len(frames))) / RATE_HZ


def learner() -> MotionLearner:
    """Return a learner of such a stream."""
    return MotionLearner(LearnerConfig(CHANNELS, RATE_HZ))

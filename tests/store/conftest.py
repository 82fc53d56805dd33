from itertools import cycle, islice

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner, Recording
from mplearn.demonstrator import demonstrate
from mplearn.evaluation.observing import observe
from mplearn.recording import FloatArray


@pytest.fixture(scope="session")
def motions() -> Recording:
    """Four primitives in an order that is not always the same, as the robot's features."""
    rng = np.random.default_rng(5)
    script = list(islice(cycle(("BAR", "BAL", "BAD", "BAU")), 32))
    for _ in range(4):
        script += list(rng.permutation([("BAR", "BAL"), ("BAD", "BAU")], axis=0).ravel())
    return observe(demonstrate([str(name) for name in script], seed=4).recording)


@pytest.fixture(scope="session")
def taught(motions: Recording) -> MotionLearner:
    """What was learned of two thirds of them; to be copied, not changed."""
    return learned(motions)


@pytest.fixture(scope="session")
def taught_unaided(motions: Recording) -> MotionLearner:
    """The same where what is known does not help to cut: an edit changes no later segment."""
    return learned(motions, scaffolding=False)


def learned(motions: Recording, **settings: bool) -> MotionLearner:
    learner = MotionLearner(LearnerConfig(motions.channels, motions.rate_hz, **settings))
    learner.learn_many(motions.frames[: two_thirds(motions)])
    return learner


def two_thirds(recording: Recording) -> int:
    return len(recording.frames) * 2 // 3


@pytest.fixture(scope="session")
def later(motions: Recording) -> FloatArray:
    """The frames after those."""
    return motions.frames[two_thirds(motions) :]

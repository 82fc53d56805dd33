"""What a learner remembers at any moment of a bad stream is accepted, and goes on bit for bit."""

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import Person, demonstrate
from mplearn.evaluation.streams import join_people
from mplearn.learner import LearnerState
from mplearn.state import checkpoint, resumed


def bad_stream(rng: np.random.Generator):
    """Two people in turn; markers vanish, fly about, and come in another unit."""
    people = (Person("small", 1.58), Person("tall", 1.84))
    script = ("BAR", "BAL") * 4
    takes = [demonstrate(script, seed=k, person=each).recording for k, each in enumerate(people)]
    stream = join_people(takes, rng, interleaved=True)
    frames = stream.frames.copy()
    for _ in range(20):
        at, n = int(rng.integers(len(frames) - 80)), int(rng.integers(1, 80))
        some = rng.random(frames.shape[1]) < 0.3
        kind = int(rng.integers(4))
        if kind == 0:
            frames[at : at + n] = np.nan
        elif kind == 1:
            frames[at : at + n, some] = np.nan
        elif kind == 2:
            frames[at : at + n] *= 1000.0
        else:
            frames[at : at + n] += rng.normal(0, 1, frames.shape[1])
    return stream, frames


def test_checkpoints_of_a_bad_stream_resume_bit_for_bit():
    rng = np.random.default_rng(5)
    stream, frames = bad_stream(rng)
    learner = twin = MotionLearner(LearnerConfig(stream.channels, stream.rate_hz))
    store: dict[str, bytes] = {}
    at = n_states = 0
    while at < len(frames):
        n = int(rng.integers(40, 200))
        events = learner.learn_many(frames[at : at + n])
        if twin is not learner:
            assert repr(twin.learn_many(frames[at : at + n])) == repr(events)
        at += n
        kept = checkpoint(learner.state(), store)
        store.update(kept.new)
        twin = MotionLearner.from_state(resumed(LearnerState, kept.document, store.__getitem__))
        assert twin.state() == learner.state()
        n_states += 1
    assert n_states > 20
    assert repr(twin.end_stream()) == repr(learner.end_stream())
    assert len(learner.tree.people) == 2

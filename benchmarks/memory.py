"""What a learner holds after ten hours against after one: two people's motions, without end."""

import pickle
import time

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import demonstrate, markov_script
from mplearn.evaluation import observe
from mplearn.learner import SegmentClosed
from mplearn.recording import Segment

HOUR = 2_800  # motions of 1.28 s
HOURS = (1, 2, 5, 10)


def rows() -> list[tuple[str, str, str, str]]:
    """Return the size of all that is held, and how long the last tenth of it took.

    The segments of a short demonstration come again and again, each time a little different and by
    one person or the other; frames before segmentation are held in arrays of fixed size.
    """
    script = markov_script(60, np.random.default_rng(0), balance=0.5)
    features = observe(demonstrate(script, 3).recording)
    learner = MotionLearner(LearnerConfig(features.channels, features.rate_hz))
    found = [e.segment for e in learner.learn_many(features.frames) if isinstance(e, SegmentClosed)]
    seen = learner._view.see(features.frames)
    motions = [seen[s.start : s.end] for s in found if not s.still]
    rng = np.random.default_rng(1)
    habits = 0.02 * rng.normal(size=(2, seen.shape[1]))
    table, first, start = [], 0, 0.0
    for i in range(1, HOURS[-1] * HOUR + 1):
        if i == (HOURS[-1] - 1) * HOUR + 1:
            start = time.process_time()
        person = (i // 20) % 2
        frames = motions[int(rng.integers(len(motions)))]
        own = frames * rng.normal(1, 0.03) + habits[person] + 0.01 * rng.normal(size=len(frames[0]))
        learner._person = person
        begin = learner.n_frames + 128 * i
        learner._place(Segment(begin, begin + len(frames)), own)
        if i % HOUR == 0 and i // HOUR in HOURS:
            size = len(pickle.dumps(learner.state()))
            first = first or size
            table.append(
                (f"{i // HOUR} h", f"{size / 1e6:.1f} MB", "after 1 h", f"{size / first:.2f} x")
            )
    took = time.process_time() - start
    return [
        *table,
        ("the last hour's segments", f"{took:.0f} s", "an hour", f"{3600 / took:.0f} x"),
    ]

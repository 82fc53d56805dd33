"""Motions shown once are in a library to be performed, if asked for; nothing is like them."""

from itertools import pairwise

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import demonstrate
from mplearn.library import PrimitiveLibrary

ONCE = ("BAR", "BAL", "SQD", "SQR", "RAR", "RAL")
RATE_HZ = 25.0


def learned(script) -> MotionLearner:
    recording = demonstrate(script, seed=3, rate_hz=RATE_HZ).recording
    learner = MotionLearner(LearnerConfig(recording.channels, RATE_HZ))
    learner.learn_many(recording.frames)
    learner.end_stream()
    return learner


def once(library: PrimitiveLibrary):
    return [each for each in library.primitives if each.n_exemplars == 1]


@pytest.fixture(scope="module")
def learner() -> MotionLearner:
    return learned(ONCE)


def test_each_motion_is_there_in_its_order(learner):
    assert len(learner.snapshot()) == 0
    library = learner.snapshot(shown_once=True)
    assert len(library) == len(once(library)) == len(ONCE)
    ids = library.ids
    assert [library.graph.count(a, b) for a, b in pairwise(ids)] == [1] * (len(ids) - 1)
    assert library.graph.n_transitions == len(ids) - 1
    assert library.names == tuple(f"once-{k}" for k in range(len(ids)))
    motion = library.generate(ids)
    assert np.isfinite(motion.frames).all()


def test_nothing_is_recognised_as_what_was_shown_once(learner):
    library = learner.snapshot(shown_once=True)
    for each in library.primitives:
        assert library.recognise(each.exemplars[0]).primitive is None


def test_looking_changes_nothing_and_the_library_is_kept(learner, tmp_path):
    before = repr(learner.state())
    library = learner.snapshot(shown_once=True)
    assert repr(learner.state()) == before
    assert PrimitiveLibrary.load(library.save(tmp_path / "a.mplearn")).version == library.version


def test_what_becomes_a_primitive_is_not_there_twice():
    learner = learned((*ONCE, *ONCE[:4] * 3))
    library = learner.snapshot(shown_once=True)
    known = [each for each in library.primitives if each.n_exemplars > 1]
    assert len(known) == 4
    assert {each.name for each in once(library)} >= {"once-4", "once-5"}  # the right arm's
    assert sum(each.n_exemplars for each in library.primitives) == learner.tree.n_seen
    assert {each.id for each in known} == set(learner.tree.leaves)
    counted = learner.graph.n_transitions
    assert library.graph.n_transitions > counted == learner.graph.n_transitions

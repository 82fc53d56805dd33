"""Learner files that older code wrote still open, know what they knew then, and learn on."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.learner.learner_state import FILES
from mplearn.state import to_plain

OLD = Path(__file__).parent / "data" / "learner-schema-1.mplearner"  # in the midst of a stream


def test_a_learner_of_one_set_of_channels_knows_what_it_knew(tmp_path):
    learner = MotionLearner.load(OLD)
    assert learner.n_frames == 1000
    assert learner.config.channels == ("a", "b", "c", "d")
    library = learner.snapshot()
    assert library.ids == (1, 2, 3, 4, 5, 6)
    assert [each.n_exemplars for each in library.primitives] == [5, 5, 3, 2, 2, 2]
    copy = MotionLearner.load(learner.save(tmp_path / "copy.mplearner"))
    frames = np.concatenate([primitive.exemplars[0] for primitive in library.primitives])
    for each in (learner, copy):
        each.learn_many(frames)
        each.end_stream()
    assert copy.snapshot().version == learner.snapshot().version


def test_one_observer_becomes_that_of_the_only_set_of_markers(four, tmp_path):
    learner = MotionLearner(LearnerConfig(four.recording.channels, four.recording.rate_hz))
    learner.learn_many(four.recording.frames[:300])
    path = tmp_path / "old.mplearner"
    content = to_plain(learner.state())
    (watch,) = content.pop("watches")
    del content["stream"]
    content |= {"observer": watch["observer"], "n_people": len(watch["people"])}
    replace(FILES, schema=1, migrations={}).write(path, content)
    assert MotionLearner.load(path).state() == learner.state()

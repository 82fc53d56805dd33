"""A snapshot that is prepared a part at a time, few primitives being looked at in each."""

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner
from mplearn.learner import snapshot
from mplearn.library import Primitive


def test_all_are_looked_at_a_part_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []
    from_exemplars = Primitive.from_exemplars

    def noted(id: int, *args: object, **kwargs: object) -> Primitive:
        made.append(id)
        return from_exemplars(id, *args, **kwargs)

    monkeypatch.setattr(Primitive, "from_exemplars", noted)
    monkeypatch.setattr(snapshot, "_LOOKED_AT", 1)
    t = np.arange(1200) / 100.0
    swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]
    learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
    learner.learn_many(swing)
    ids = list(learner.tree.leaves)
    assert len(ids) == 2
    assert [learner.prepare_snapshot() for _ in ids] == [False, False]
    assert made == ids
    assert learner.prepare_snapshot()
    assert [learner.prepare_snapshot() for _ in ids] == [False, True]  # nothing to make
    learner.snapshot()
    assert made == ids
    learner.prepare_snapshot()
    learner.tree.remove(ids[1], forget=True)  # what is gone is passed over
    assert learner.prepare_snapshot()
    assert made == ids

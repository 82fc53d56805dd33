"""By the rules as the paper prints them a primitive in which others are formed is one no more."""

from pathlib import Path

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner, PrimitiveLibrary
from mplearn.learner import PrimitiveSplit, Recognised
from mplearn.recording import FloatArray
from mplearn.tree import TreeConfig

UP = np.sin(np.pi * np.arange(100) / 100.0) ** 2


def stream(seed: int, n: int = 45) -> FloatArray:
    """Swings of two joints, of several widths each, shape (100 n, 2)."""
    rng = np.random.default_rng(seed)
    widths = [rng.choice(each, n) for each in ([1.0, 1.3, 2.0], [0.3, 0.6, 1.0])]
    swings = np.transpose(widths) * (1 + 0.02 * rng.standard_normal((n, 2)))
    return np.concatenate([UP[:, None] * swing for swing in swings])


def learner() -> MotionLearner:
    rules = TreeConfig.printed()
    return MotionLearner(LearnerConfig(("a", "b"), segmenter="zero-velocity", tree=rules))


@pytest.mark.parametrize("seed", [1, 2])
def test_what_is_no_primitive_any_more_is_in_no_library(seed: int, tmp_path: Path) -> None:
    mine, split = learner(), set()
    for block in np.split(stream(seed), 45):
        for event in mine.learn_many(block):
            if isinstance(event, PrimitiveSplit):
                split.add(event.primitive)
                assert set(event.into) <= set(mine.tree.leaves)
            if isinstance(event, Recognised):
                assert event.primitive in mine.tree.leaves
        assert mine.graph.ids == mine.tree.leaves
    assert split and split.isdisjoint(mine.tree.leaves)
    assert split <= {node.id for node in mine.tree.nodes}  # more general motions
    library = mine.snapshot()
    assert tuple(each.id for each in library) == mine.tree.leaves
    path = library.save(tmp_path / "a.mplearn")
    assert PrimitiveLibrary.load(path).version == library.version


def test_it_goes_on_bit_for_bit() -> None:
    mine, frames = learner(), stream(1)
    mine.learn_many(frames[:3050])
    later = MotionLearner.from_state(mine.state())
    assert mine.learn_many(frames[3050:]) == later.learn_many(frames[3050:])
    assert mine.state() == later.state()

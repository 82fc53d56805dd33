"""A snapshot looks at what has changed, and is what one is that looks at everything."""

import copy

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner
from mplearn.learner.learner_state import LearnerState
from mplearn.learner.snapshot import Snapshots
from mplearn.state import Kept, checkpoint, resumed

N = 9


def stream(seed: int, n_moves: int) -> np.ndarray:
    """Return moves of N kinds with rests between, shape (T, N)."""
    rng = np.random.default_rng(seed)
    up = np.sin(np.linspace(0, np.pi, 60)) ** 2
    frames = [np.zeros((30, N))]
    for kind in rng.integers(0, N, n_moves):
        move = np.outer(up, np.eye(N)[kind] + 0.5 * np.eye(N)[(kind + 1) % N])
        frames += [move * rng.normal(1, 0.03), np.zeros((30, N))]
    return np.concatenate(frames)


def learner_of(n_moves: int) -> MotionLearner:
    channels = tuple(f"joint_{k}" for k in range(N))
    learner = MotionLearner(LearnerConfig(channels, segmenter="zero-velocity"))
    learner.learn_many(stream(1, n_moves))
    return learner


def test_it_is_what_one_is_that_looks_at_everything():
    learner, kept = learner_of(80), Kept()
    parts: dict[str, bytes] = {}
    tree = learner.tree
    assert len(tree.leaves) >= 8
    edits = {
        2: lambda: learner.freeze(tree.leaves[1]),
        4: lambda: learner.merge(*tree.leaves[2:4]),
        6: lambda: learner.unfreeze(tree.leaves[1]),
        8: lambda: learner.remove(tree.leaves[-1]),
        10: lambda: learner.split(tree.leaves[2]),
        12: lambda: learner.freeze(tree.leaves[0]),
    }
    for k in range(14):
        if k in edits:
            edits[k]()
        learner.learn_many(stream(100 + k, 2))
        library, state = learner.snapshot(), learner.state()
        written = checkpoint(state, kept)
        kept.add(k, written.held)
        parts |= written.new
        for key in kept.drop(k - 1) if k else ():
            del parts[key]
        back = resumed(LearnerState, written.document, parts.__getitem__)
        assert back == state
        if k % 3 == 0 or k in edits:
            assert library.version == MotionLearner.from_state(back).snapshot().version
        assert [library[name].id for name in library.names] == list(library.ids)
        assert set(parts) == set(written.parts)
        if k == 7:  # a copy goes on as it does
            learner = copy.deepcopy(learner)
            tree = learner.tree


@pytest.mark.parametrize("n_moves", [30, 90])
def test_it_looks_at_no_more_primitives_where_more_are_known(n_moves, monkeypatch):
    learner = learner_of(n_moves)
    learner.snapshot()
    looked: list[int] = []
    primitive = Snapshots._primitive
    monkeypatch.setattr(
        Snapshots,
        "_primitive",
        lambda self, tree, node, basis: (
            looked.append(node.id) or primitive(self, tree, node, basis)
        ),
    )
    basis = learner.tree.model_basis
    before = len(learner.tree.leaves)
    while not looked:
        learner.learn_many(stream(7 + learner.n_frames, 1))
        learner.snapshot()
    if learner.tree.model_basis is basis:
        assert len(looked) <= 3 < before

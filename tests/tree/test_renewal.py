"""Models made again a little with each frame: the same in the end as all at once."""

import numpy as np
import pytest

from mplearn.tree import PrimitiveTree, TreeConfig
from mplearn.tree.exemplars.bank import ExemplarBank
from mplearn.tree.exemplars.renewal import EFFORT, Renewal

WIDTH = 6


def motions(n_kinds: int, n_times: int) -> list[np.ndarray]:
    """Executions of some kinds of motion, small ones first, so that the variance of all grows."""
    rng = np.random.default_rng(3)
    size = np.repeat((0.1, 0.5, 2.0), n_kinds)
    keys = size[:, None, None] * rng.normal(size=(3 * n_kinds, 4, WIDTH))
    found = []
    for first in range(0, 3 * n_kinds, n_kinds):
        for _ in range(n_times):
            for kind in range(first, first + n_kinds):
                at = np.linspace(0, 3, int(rng.integers(70, 110)))
                curve = [np.interp(at, np.arange(4), key) for key in keys[kind].T]
                found.append(rng.normal(1, 0.05) * np.array(curve).T)
    return found


def learn(tree: PrimitiveTree, segments: list[np.ndarray], frames: int | None) -> list[object]:
    """Insert segments, so many frames after each other, or as many as each has."""
    placements = []
    for segment in segments:
        for _ in range(len(segment) if frames is None else frames):
            tree.pass_time()
        placements.append(tree.insert(segment))
    return placements


def new_tree() -> PrimitiveTree:
    return PrimitiveTree(TreeConfig(), WIDTH, 100.0)


def assert_measured(tree: PrimitiveTree) -> None:
    for node in tree.nodes:
        np.testing.assert_array_equal(node.matrix, tree.bank.matrix(node.members))


def test_a_small_tree_is_made_again_before_the_next_motion_comes():
    segments = motions(3, 5)
    at_once, gradually = new_tree(), new_tree()
    assert learn(at_once, segments, 0) == learn(gradually, segments, 300)
    assert at_once.state().floor.tolist() == gradually.state().floor.tolist()
    assert len(at_once.leaves) >= 3
    assert_measured(at_once)
    assert_measured(gradually)


@pytest.mark.parametrize("frames", [7, 30])
def test_the_new_models_are_right_whatever_happened_meanwhile(frames):
    tree = new_tree()
    floors = set()
    for segment in motions(6, 5):
        learn(tree, [segment], frames)
        floors.add(tree.state().floor.tobytes())
        assert_measured(tree)
    assert len(floors) > 2
    for _ in range(1000):
        tree.pass_time()
    assert tree.state().renewal is None
    assert_measured(tree)
    fresh = ExemplarBank(tree.config, WIDTH, tree.bank.floor)
    for number in tree.bank.numbers():
        old = tree.bank[number]
        new = fresh.model(old.columns.T, float(old.duration))
        for one, other in zip(old, new, strict=True):
            np.testing.assert_array_equal(one, other)


def test_an_empty_node_is_made_again_too():
    tree = new_tree()
    learn(tree, motions(2, 4)[:8], 0)
    bank, numbers = tree.bank.fork(), tree.bank.numbers()
    renewal = Renewal(bank, 2.0 * bank.floor, {0: [], 5: numbers})
    found = renewal.finish({0: [], 5: numbers[1:], 6: numbers[:2]})
    assert found[0].shape == (0, 0) and (bank.floor == 2.0 * tree.bank.floor).all()
    np.testing.assert_array_equal(found[5], bank.matrix(numbers[1:]))
    np.testing.assert_array_equal(found[6], bank.matrix(numbers[:2]))


def test_a_saved_tree_goes_on_in_the_middle_of_it():
    segments = motions(6, 5)
    tree = new_tree()
    while tree.state().renewal is None or tree.n_seen < 40:
        learn(tree, [segments[tree.n_seen]], 2)
    twin = new_tree()
    twin.load_state(tree.state())
    rest = segments[tree.n_seen :]
    assert learn(tree, rest, 3) == learn(twin, rest, 3)
    assert repr(tree.state()) == repr(twin.state())
    assert_measured(twin)


def test_no_frame_does_more_than_its_part(monkeypatch):
    done = []
    model, distances = ExemplarBank.model, ExemplarBank.distances

    def counted_model(self, *args):
        done.append(20)
        return model(self, *args)

    def counted_distances(self, exemplar, others, **options):
        done.append(len(others))
        return distances(self, exemplar, others, **options)

    tree = new_tree()
    for segment in motions(8, 5):
        learn(tree, [segment], 0 if tree.n_seen < 1 else 1)
    monkeypatch.setattr(ExemplarBank, "model", counted_model)
    monkeypatch.setattr(ExemplarBank, "distances", counted_distances)
    most = 0
    for segment in motions(8, 5):
        for _ in range(12):
            done.clear()
            tree.pass_time()
            most = max(most, sum(done))
        tree.insert(segment)
    assert 0 < most < 3 * EFFORT

"""A tree that makes its models when they are asked for is the tree."""

from collections.abc import Callable

import numpy as np
import pytest

from mplearn.errors import StateError
from mplearn.tree import KeptTree, PrimitiveTree, TreeConfig

D, RATE_HZ = 2, 100.0


def segments(n: int, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, 60)
    kinds = [np.stack((np.sin((k + 1) * np.pi * t), k * t * (1 - t)), axis=1) for k in range(4)]
    return [kinds[rng.integers(4)] + rng.normal(0, 0.02, (60, D)) for _ in range(n)]


@pytest.fixture
def tree() -> PrimitiveTree:
    tree = PrimitiveTree(TreeConfig(), D, RATE_HZ)
    for segment in segments(40, 1):
        tree.insert(segment)
    return tree


def kept(tree: PrimitiveTree) -> KeptTree:
    twin = KeptTree(TreeConfig(), D, RATE_HZ)
    twin.load_state(tree.state())
    return twin


def asleep(tree: KeptTree) -> bool:
    return "_memory" not in vars(tree)


def test_looking_at_it_makes_no_model(tree: PrimitiveTree) -> None:
    twin, state = kept(tree), tree.state()
    assert twin.leaves == tree.leaves
    assert [node.id for node in twin.nodes] == [node.id for node in tree.nodes]
    for node in tree.nodes:
        assert twin.node(node.id) == node
        for one, other in zip(twin.exemplars(node.id), tree.exemplars(node.id), strict=True):
            assert one is other
    assert twin.n_seen == tree.n_seen
    assert twin.state() is not state
    assert twin.state().nodes == state.nodes
    twin.require_exemplars(5)
    assert asleep(twin)


@pytest.mark.parametrize(
    "ask",
    [
        lambda tree: tree.radius(tree.leaves[0]),
        lambda tree: tree.limit,
        lambda tree: tree.bank.numbers(),
        lambda tree: tree.nearest_others().tolist(),
        lambda tree: tree.most_repeated(),
        lambda tree: list(tree.unplaced()),
        lambda tree: tree.merge(*tree.leaves[:2]),
    ],
)
def test_what_needs_models_finds_them(tree: PrimitiveTree, ask: Callable) -> None:
    twin = kept(tree)
    assert str(ask(twin)) == str(ask(tree))
    assert not asleep(twin)
    assert twin.leaves == tree.leaves


def test_it_goes_on_as_the_tree_does(tree: PrimitiveTree) -> None:
    twin = kept(tree)
    for segment in segments(30, 2):
        one, other = twin.insert(segment), tree.insert(segment)
        assert one == other
    states = [each.state() for each in (twin, tree)]
    assert [node.members.tolist() for node in states[0].nodes] == [
        node.members.tolist() for node in states[1].nodes
    ]
    for one, other in zip(twin.nodes, tree.nodes, strict=True):
        assert np.array_equal(one.matrix, other.matrix)
    twin.load_state(tree.state())
    assert asleep(twin)
    assert twin.leaves == tree.leaves


def test_what_does_not_fit_is_refused_at_once(tree: PrimitiveTree) -> None:
    with pytest.raises(StateError, match="floor"):
        KeptTree(TreeConfig(), D + 1, RATE_HZ).load_state(tree.state())
    with pytest.raises(AttributeError, match="_nothing"):
        _ = kept(tree)._nothing

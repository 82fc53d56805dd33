"""How far a person's exemplars of a primitive are apart."""

import numpy as np
import pytest

from mplearn.people import PeopleTree
from mplearn.tree import TreeConfig


@pytest.mark.parametrize("n_people", [1, 2])
def test_each_persons_exemplars_are_held_against_each_other(n_people: int) -> None:
    t = np.linspace(0, 1, 50)
    kinds = [np.stack((np.sin(np.pi * t), k * t * (1 - t)), axis=1) for k in (-4.0, 4.0, 12.0)]
    rng = np.random.default_rng(0)
    tree = PeopleTree(TreeConfig(), 2, 100.0)
    for person in range(n_people):
        for _ in range(4 + person):
            for kind in kinds:
                tree.insert(kind + rng.normal(0, 0.01, kind.shape), person)
    for person in range(n_people):
        ids, apart = tree.nearest_others(person)
        assert set(ids.tolist()) == set(tree.leaves) and len(ids) == 3
        own = tree.of(person)
        for id, distances in zip(ids.tolist(), apart, strict=True):
            (leaf,) = (n for n in own.leaves if tree.n_placed(id) and _same(tree, id, own, n))
            matrix = own.node(leaf).matrix + np.diag(np.full(4 + person, np.inf))
            expected = np.sort(matrix, axis=1)[:, :2].mean(axis=1)
            np.testing.assert_allclose(distances[: 4 + person], expected)
            assert np.isnan(distances[4 + person :]).all()
    ids, apart = tree.nearest_others(7)
    assert len(ids) == len(apart) == 0


def _same(tree: PeopleTree, id: int, own: object, leaf: int) -> bool:
    """Return whether a person's leaf is part of a primitive, by its exemplars."""
    held = [each.tobytes() for each in tree.exemplars(id)]
    return all(each.tobytes() in held for each in own.exemplars(leaf))

"""Executions of one motion are nearer to each other than to standing still, however small it is."""

from dataclasses import replace

import numpy as np
import pytest

from mplearn.recording import FloatArray
from mplearn.tree import PrimitiveTree, TreeConfig
from mplearn.tree.rules import cutoff

D, RATE_HZ, T = 6, 50.0, 40
KINDS = np.random.default_rng(0).normal(0, 1, (7, D, 3))
TIME = np.sin(np.outer(np.linspace(0, np.pi, T), [1, 2, 3]))


def execution(kind: int, rng: np.random.Generator, size: float = 1.0) -> FloatArray:
    """One of seven motions that begin and end in the same posture, shape (T, D)."""
    path = TIME @ (KINDS[kind] + rng.normal(0, 0.1, (D, 3))).T
    return np.asarray(size * path + rng.normal(0, 0.1 * size, D))


def fidget(rng: np.random.Generator, size: float) -> FloatArray:
    """A movement that never comes again, shape (T, D)."""
    return np.asarray(size * TIME @ rng.normal(0, 1, (D, 3)).T)


def learned(config: TreeConfig, small: list[FloatArray]) -> tuple[PrimitiveTree, list[int]]:
    """A tree that saw six large motions six times each and small ones between, and their homes."""
    rng = np.random.default_rng(1)
    tree, numbers = PrimitiveTree(config, D, RATE_HZ), []
    for k in range(36):
        tree.insert(execution(k % 6, rng))
        if k % 4 == 3:
            numbers.append(tree.insert(small[k // 4]).number)
    homes = {n: node.id for node in tree.nodes[1:] for n in node.members}
    return tree, [homes.get(number, 0) for number in numbers]


@pytest.mark.parametrize("size", [0.03, 0.1])
def test_small_movements_that_never_come_again_are_no_primitive(size: float) -> None:
    rng = np.random.default_rng(2)
    small = [fidget(rng, size) for _ in range(9)]
    tree, homes = learned(TreeConfig(), small)
    assert len(tree.leaves) == 6 and not any(homes)
    _, homes = learned(replace(TreeConfig(), extent_share=np.inf), small)
    assert any(homes)  # they are nearer to each other than executions of the large ones


@pytest.mark.parametrize("size", [0.1, 0.3])
def test_a_small_motion_that_comes_again_is_one(size: float) -> None:
    rng = np.random.default_rng(2)
    tree, homes = learned(TreeConfig(), [execution(6, rng, size) for _ in range(9)])
    assert len(tree.leaves) == 7 and len(set(homes)) == 1 and homes[0] in tree.leaves


@pytest.mark.parametrize("size", [0.1, 0.15])
def test_two_executions_may_differ_nearly_as_much_as_they_move(size: float) -> None:
    """Two unrelated motions of a size are sqrt(2) of it apart."""
    rng = np.random.default_rng(5)
    tree = PrimitiveTree(TreeConfig(), D, RATE_HZ)
    for k in range(36):
        tree.insert(execution(k % 6, rng))
    rng = np.random.default_rng(6)
    first, second = (
        tree.insert(size * TIME @ (KINDS[6] + rng.normal(0, 0.6, (D, 3))).T).number
        for _ in range(2)
    )
    apart = tree.bank.distances(tree.bank[first], [second])[0]
    assert 0.84 < apart / np.sqrt(np.prod(tree.bank.extents([first, second]))) < 1.1
    assert tree.node(tree.leaves[-1]).members == (first, second)


def test_what_stands_still_belongs_to_no_small_motion() -> None:
    rng = np.random.default_rng(2)
    tree, homes = learned(TreeConfig(), [execution(6, rng, 0.1) for _ in range(9)])
    recogniser = tree.recogniser()
    assert recogniser.recognise(execution(6, rng, 0.1)).primitive == homes[0]
    for _ in range(5):
        still = np.zeros((T, D)) + rng.normal(0, 1e-4, (T, D))
        assert recogniser.recognise(still).primitive is None


def test_a_birth_may_be_little_wider_than_what_is_known() -> None:
    """While most of what was seen came once, the scale of all motion says little of repetitions."""
    rng = np.random.default_rng(3)
    shown = [execution(k % 6, rng, 0.3) for k in range(12)]
    shown += [execution(k % 6, np.random.default_rng(k), 0.3) for k in range(12)]
    shown += [fidget(rng, 1.0) for _ in range(40)]
    widest = []
    for cap in (np.inf, 1.75, 1.0):
        tree = PrimitiveTree(replace(TreeConfig(), birth_cap=cap), D, RATE_HZ)
        for frames in shown:
            tree.insert(frames)
        assert len(tree.leaves) >= 6
        widest.append(cutoff(tree._structure, tree.node(0)) / tree.limit)
    assert widest[0] == 1.0 > widest[1] > widest[2] > 0.1

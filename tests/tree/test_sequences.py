"""Two that are alike are no chance where what came beside them is alike, too."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mplearn.recording import FloatArray
from mplearn.tree import PrimitiveTree, TreeConfig
from mplearn.tree.rules import _came_in_sequence, _each_others_nearest

D, RATE_HZ, T = 6, 50.0, 40
TIME = np.sin(np.outer(np.linspace(0, np.pi, T), [1, 2, 3]))
SHAPES = np.random.default_rng(0).normal(0, 1, (30, D, 3))


def motion(kind: int, rng: np.random.Generator, off: float = 0.1) -> FloatArray:
    """A motion of a kind that begins and ends in the same posture, shape (T, D)."""
    return np.asarray(TIME @ (SHAPES[kind] + rng.normal(0, off, (D, 3))).T)


def homes(config: TreeConfig, order: tuple[int, ...], seed: int, off: float) -> list[int]:
    """Where the second executions of kinds 6 and 7 are, after six kinds were shown six times."""
    rng = np.random.default_rng(seed)
    tree = PrimitiveTree(config, D, RATE_HZ)
    for k in range(36):
        tree.insert(motion(k % 6, rng))
    shown = {kind: [motion(kind, rng, off) for _ in range(2)] for kind in sorted(set(order))}
    numbers = {kind: tree.insert(shown[kind].pop()).number for kind in order}
    held = {n: node.id for node in tree.nodes[1:] for n in node.members}
    return [held.get(numbers[kind], 0) for kind in (6, 7)]


TOGETHER = (8, 6, 7, 9, 10, 6, 7, 11)
APART = (6, 8, 7, 9, 7, 10, 6, 11)


@pytest.mark.parametrize("seed", [0, 2])
def test_what_comes_in_a_sequence_twice_is_learned_though_each_is_less_alike(seed: int) -> None:
    off = (0.1, 0.15, 0.18, 2.0)  # from very like to not alike at all
    together = [all(homes(TreeConfig(), TOGETHER, seed, each)) for each in off]
    apart = [all(homes(TreeConfig(), APART, seed, each)) for each in off]
    assert together == [True, True, True, False]
    assert apart == [True, False, False, False]
    without = replace(TreeConfig(), sequence_share=0.0)
    assert [all(homes(without, TOGETHER, seed, each)) for each in off] == apart


def test_homes_are_the_leaves_that_hold_segments() -> None:
    rng = np.random.default_rng(0)
    tree = PrimitiveTree(TreeConfig(), D, RATE_HZ)
    for k in range(36):
        tree.insert(motion(k % 6, rng))
    held = {n: node.id for node in tree.nodes[1:] if not node.children for n in node.members}
    assert len(set(held.values())) == 6
    asked = list(range(-1, 38))
    found = tree._structure.homes(asked).tolist()
    assert found == [held.get(number, 0) for number in asked]


@given(
    numbers=st.lists(st.integers(0, 30), unique=True, max_size=12).map(sorted),
    in_leaf=st.dictionaries(st.integers(0, 31), st.integers(1, 3)),
    seed=st.integers(0, 99),
)
def test_which_came_in_a_sequence_is_as_said(
    numbers: list[int], in_leaf: dict[int, int], seed: int
) -> None:
    in_leaf = {number: leaf for number, leaf in in_leaf.items() if number not in numbers}
    alike = np.random.default_rng(seed).random((len(numbers),) * 2) < 0.5
    alike |= alike.T
    places = {number: i for i, number in enumerate(numbers)}

    def same(one: int, other: int) -> bool:
        if one in places and other in places:
            return bool(alike[places[one], places[other]])
        return one in in_leaf and in_leaf.get(one) == in_leaf.get(other)

    wanted = [
        [abs(a - b) > 1 and (same(a - 1, b - 1) or same(a + 1, b + 1)) for b in numbers]
        for a in numbers
    ]
    structure = SimpleNamespace(
        homes=lambda asked: np.array([in_leaf.get(number, 0) for number in asked], np.int64)
    )
    found = _came_in_sequence(structure, numbers, alike)  # type: ignore[arg-type]
    np.testing.assert_array_equal(found, np.array(wanted, bool).reshape(alike.shape))


@given(n=st.integers(0, 9), seed=st.integers(0, 99))
def test_each_others_nearest_are_as_said(n: int, seed: int) -> None:
    matrix = np.random.default_rng(seed).uniform(1, 2, (n, n))
    matrix = (matrix + matrix.T) * (1 - np.eye(n))

    def by_far(i: int, j: int) -> bool:
        others = [k for k in range(n) if k not in (i, j)]
        return bool(others) and all(1.2 * matrix[i, j] < matrix[i, k] for k in others)

    wanted = [[i != j and by_far(i, j) and by_far(j, i) for j in range(n)] for i in range(n)]
    found = _each_others_nearest(matrix)
    np.testing.assert_array_equal(found, np.array(wanted, bool).reshape(n, n))

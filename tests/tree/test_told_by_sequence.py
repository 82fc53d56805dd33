"""Two motions that are alike are told apart early where each comes beside another."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mplearn.recording import FloatArray
from mplearn.tree import ROOT, PrimitiveTree, TreeConfig
from mplearn.tree.nodes.node import Node
from mplearn.tree.nodes.structure import Structure
from mplearn.tree.rules import _beside_two

D, RATE_HZ, T = 6, 50.0, 40
TIME = np.sin(np.outer(np.linspace(0, np.pi, T), [1, 2, 3]))
SHAPES = np.random.default_rng(0).normal(0, 1, (30, D, 3))
FIRST, SECOND = 6, 7  # what comes after kind 0, or before it, and what comes beside kind 1


def motion(kind: int, unlike: float, rng: np.random.Generator) -> FloatArray:
    """A motion of a kind, shape (T, D); the second differs from the first by so much."""
    shape = SHAPES[FIRST] + unlike * SHAPES[8] if kind == SECOND else SHAPES[kind]
    return np.asarray(TIME @ (shape + rng.normal(0, 0.1, (D, 3))).T)


def order(beside: str, rng: np.random.Generator) -> list[int]:
    """Twelve rounds of all kinds, the alike ones always after the same others, before, or any."""
    kinds: list[int] = []
    for _ in range(12):
        others = rng.permutation(6).tolist()
        for kind, alike in ((0, FIRST), (1, SECOND)):
            places = {
                "after": others.index(kind) + 1,
                "before": others.index(kind),
                "any": int(rng.integers(0, len(others) + 1)),
            }
            others.insert(places[beside], alike)
        kinds += others
    return kinds


def demonstrations(unlike: float, beside: str, seed: int, **rules: float) -> float:
    """How often both were shown until they were told apart."""
    rng = np.random.default_rng(seed)
    tree = PrimitiveTree(replace(TreeConfig(), **rules), D, RATE_HZ)
    shown: list[int] = []
    for kind in order(beside, rng):
        tree.insert(motion(kind, unlike, rng))
        shown.append(kind)
        homes = [{shown[number] for number in tree.node(leaf).members} for leaf in tree.leaves]
        if {FIRST} in homes and {SECOND} in homes:
            return shown.count(FIRST) + shown.count(SECOND)
    return np.inf


@pytest.mark.parametrize("beside", ["after", "before"])
@pytest.mark.parametrize("seed", range(3))
def test_a_sequence_tells_apart_what_else_takes_long_or_is_never_told(
    seed: int, beside: str
) -> None:
    assert demonstrations(0.2, beside, seed) < 10 <= demonstrations(0.2, "any", seed)


@pytest.mark.parametrize("beside", ["after", "before"])
@pytest.mark.parametrize("seed", range(2))
def test_one_motion_stays_one_whatever_it_comes_beside(seed: int, beside: str) -> None:
    assert demonstrations(0.0, beside, seed) == np.inf
    assert demonstrations(0.1, beside, seed) == np.inf


def test_where_nothing_is_split_no_sequence_splits() -> None:
    assert demonstrations(0.2, "after", 0, split_ratio=np.inf) == np.inf
    assert demonstrations(0.2, "after", 0, split_scale=np.inf) == np.inf


def test_leaves_that_were_split_are_not_merged_with_the_node_above_them() -> None:
    assert demonstrations(0.2, "after", 0, n_candidates=0) < 10
    assert demonstrations(0.2, "after", 1, n_candidates=0) < 10


def test_where_sequences_tell_nothing_they_split_nothing() -> None:
    """As in files of before they did, and in the built-in library."""
    assert (
        demonstrations(0.2, "after", 0) < 10 <= demonstrations(0.2, "after", 0, sequence_share=0.0)
    )


@given(
    members=st.lists(st.integers(1, 40), unique=True, min_size=1, max_size=12).map(sorted),
    homes=st.dictionaries(st.integers(0, 41), st.sampled_from([1, 1, 2, 2, 3, 4, 9])),
    least=st.integers(2, 3),
)
def test_what_came_beside_two_primitives_is_as_said(
    members: list[int], homes: dict[int, int], least: int
) -> None:
    homes |= dict.fromkeys(members, 9)

    def of(kind: int) -> list[int]:
        return [number for number, home in homes.items() if home == kind]

    def expected(step: int) -> list[list[int]] | None:
        beside: dict[int, list[int]] = {}
        for i, number in enumerate(members):
            if homes.get(number + step, 9) != 9:
                beside.setdefault(homes[number + step], []).append(i)
        sizes = sorted(map(len, beside.values()), reverse=True)
        few = sum(sizes[2:])
        if len(sizes) < 2 or sizes[1] < least or few >= sizes[1] / 2:
            return None
        kinds = [kind for kind, those in beside.items() if len(those) > max(few, least - 1)]
        assert len(kinds) == 2
        for kind in kinds:
            back = [homes[n - step] for n in of(kind) if n - step in homes]
            if back.count(9) <= len(back) / 2:
                return None
        return sorted(beside[kind] for kind in kinds)

    structure = SimpleNamespace(
        least=least,
        homes=lambda asked: np.array([homes.get(number, ROOT) for number in asked], np.int64),
        nodes={kind: SimpleNamespace(members=of(kind)) for kind in (1, 2, 3, 4)},
    )
    leaf = SimpleNamespace(id=9, members=members)
    found = _beside_two(cast(Structure, structure), cast(Node, leaf))
    right = expected(-1) or expected(1)
    assert (found is None) == (right is None)
    if found is not None:
        assert sorted(each.tolist() for each in found) == right
        assert len(found[0]) >= len(found[1])

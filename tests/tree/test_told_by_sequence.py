"""Two motions that are alike are told apart early where each comes after another."""

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
from mplearn.tree.rules import _after_two

D, RATE_HZ, T = 6, 50.0, 40
TIME = np.sin(np.outer(np.linspace(0, np.pi, T), [1, 2, 3]))
SHAPES = np.random.default_rng(0).normal(0, 1, (30, D, 3))
FIRST, SECOND = 6, 7  # what comes after kind 0, and what comes after kind 1


def motion(kind: int, unlike: float, rng: np.random.Generator) -> FloatArray:
    """A motion of a kind, shape (T, D); the second differs from the first by so much."""
    shape = SHAPES[FIRST] + unlike * SHAPES[8] if kind == SECOND else SHAPES[kind]
    return np.asarray(TIME @ (shape + rng.normal(0, 0.1, (D, 3))).T)


def order(in_sequence: bool, rng: np.random.Generator, rounds: int) -> list[int]:
    """The alike ones, each always after the same other kind, or after any."""
    kinds: list[int] = []
    for _ in range(rounds):
        others = rng.permutation(6).tolist()
        after = {0: FIRST, 1: SECOND} if in_sequence else {}
        kinds += [each for kind in others for each in (kind, after.get(kind)) if each is not None]
        if not in_sequence:
            for kind in (FIRST, SECOND):
                kinds.insert(len(kinds) - int(rng.integers(0, 6)), kind)
    return kinds


def demonstrations(unlike: float, in_sequence: bool, seed: int, **rules: float) -> float:
    """How often both were shown until they were told apart."""
    rng = np.random.default_rng(seed)
    tree = PrimitiveTree(replace(TreeConfig(), **rules), D, RATE_HZ)
    shown: list[int] = []
    for kind in order(in_sequence, rng, 12):
        tree.insert(motion(kind, unlike, rng))
        shown.append(kind)
        homes = [{shown[number] for number in tree.node(leaf).members} for leaf in tree.leaves]
        if {FIRST} in homes and {SECOND} in homes:
            return shown.count(FIRST) + shown.count(SECOND)
    return np.inf


@pytest.mark.parametrize("seed", range(4))
def test_a_sequence_tells_apart_what_else_takes_long_or_is_never_told(seed: int) -> None:
    assert demonstrations(0.25, True, seed) <= 6
    assert demonstrations(0.25, False, seed) >= 12
    assert demonstrations(0.2, True, seed) <= 8
    assert demonstrations(0.2, False, seed) == np.inf


@pytest.mark.parametrize("seed", range(4))
def test_one_motion_stays_one_whatever_it_comes_after(seed: int) -> None:
    assert demonstrations(0.0, True, seed) == np.inf
    assert demonstrations(0.1, True, seed) == np.inf


def test_where_nothing_is_split_no_sequence_splits() -> None:
    assert demonstrations(0.2, True, 0, split_ratio=np.inf) == np.inf
    assert demonstrations(0.2, True, 0, split_scale=np.inf) == np.inf


@given(
    members=st.lists(st.integers(1, 40), unique=True, min_size=1, max_size=12).map(sorted),
    homes=st.dictionaries(st.integers(0, 41), st.sampled_from([1, 1, 2, 2, 3, 4, 9])),
)
def test_what_came_after_two_primitives_is_as_said(
    members: list[int], homes: dict[int, int]
) -> None:
    homes |= dict.fromkeys(members, 9)

    def of(kind: int) -> list[int]:
        return [number for number, home in homes.items() if home == kind]

    structure = SimpleNamespace(
        homes=lambda asked: np.array([homes.get(number, ROOT) for number in asked], np.int64),
        nodes={kind: SimpleNamespace(members=of(kind)) for kind in (1, 2, 3, 4)},
    )
    leaf = SimpleNamespace(id=9, members=members)
    found = _after_two(cast(Structure, structure), cast(Node, leaf))

    after: dict[int, list[int]] = {}
    for i, number in enumerate(members):
        if homes.get(number - 1, 9) != 9:
            after.setdefault(homes[number - 1], []).append(i)
    sizes = sorted(map(len, after.values()), reverse=True)
    few = sum(sizes[2:])
    if len(sizes) < 2 or sizes[1] < 2 or few >= sizes[1] / 2:
        assert found is None
        return
    kinds = [kind for kind, those in after.items() if len(those) >= 2 and len(those) > few]
    assert len(kinds) == 2
    leads = [[homes[n + 1] for n in of(kind) if n + 1 in homes] for kind in kinds]
    if any(then.count(9) <= len(then) / 2 for then in leads):
        assert found is None
        return
    assert found is not None
    assert sorted(each.tolist() for each in found) == sorted(after[kind] for kind in kinds)
    assert len(found[0]) >= len(found[1])

"""A known motion that is cut in two now and then is not two motions."""

from dataclasses import replace

import numpy as np
import pytest

from mplearn.merging import merge_trees
from mplearn.recording import FloatArray
from mplearn.tree import Change, Placement, PrimitiveTree, TreeConfig

D, RATE_HZ, T = 6, 50.0, 60
TIME = np.sin(np.outer(np.linspace(0, np.pi, T), [1, 2, 3]))
SHAPES = np.random.default_rng(3).normal(0, 1, (12, D, 3))
KEPT = replace(TreeConfig(), ignore_fragments=False)


def motion(kind: int, rng: np.random.Generator) -> FloatArray:
    """A motion of a kind, shape (T, D)."""
    return np.asarray(TIME @ (SHAPES[kind] + rng.normal(0, 0.05, (D, 3))).T)


def taught(config: TreeConfig, rng: np.random.Generator) -> PrimitiveTree:
    """A tree that was shown six kinds of motion six times."""
    tree = PrimitiveTree(config, D, RATE_HZ)
    for k in range(36):
        tree.insert(motion(k % 6, rng))
    assert len(tree.leaves) == 6
    return tree


def hesitate(tree: PrimitiveTree, kind: int, at: int, rng: np.random.Generator) -> tuple[int, int]:
    """Show a motion cut in two; return the numbers of its parts."""
    whole = motion(kind, rng)
    return tree.insert(whole[:at]).number, tree.insert(whole[at:], goes_on=True).number


def waiting(tree: PrimitiveTree) -> set[int]:
    """What waits to become a primitive."""
    return set(tree.unplaced())


@pytest.mark.parametrize("at", [14, 24, 40])
@pytest.mark.parametrize("kind", range(6))
def test_parts_of_a_known_motion_become_no_primitive(kind: int, at: int) -> None:
    rng = np.random.default_rng(kind)
    tree, kept = taught(TreeConfig(), rng), taught(KEPT, np.random.default_rng(kind))
    known = tree.leaves
    for k in range(4):
        hesitate(tree, kind, at, rng)
        hesitate(kept, kind, at, np.random.default_rng((kind, k)))
        tree.insert(motion((kind + k) % 6, rng))
    assert tree.leaves == known
    assert waiting(tree) == set()
    assert len(kept.leaves) > len(known)  # what would have come of it


def test_what_comes_alone_becomes_a_primitive_though_it_is_like_a_part() -> None:
    rng = np.random.default_rng(0)
    tree = taught(TreeConfig(), rng)
    known = tree.leaves
    parts = [hesitate(tree, 2, 24, rng) for _ in range(2)]
    for _ in range(3):
        tree.insert(motion(2, rng)[:24])
        tree.insert(motion(0, rng))
    assert len(tree.leaves) == len(known) + 1
    (new,) = set(tree.leaves) - set(known)
    assert parts[0][0] in tree.node(new).members  # by then it is known what they are


def test_parts_that_do_not_go_on_are_motions() -> None:
    rng = np.random.default_rng(0)
    tree = taught(TreeConfig(), rng)
    for _ in range(3):
        whole = motion(4, rng)
        tree.insert(whole[:24])
        tree.insert(whole[24:])
    assert len(tree.leaves) == 8


def test_parts_that_are_played_back_exactly_are_motions() -> None:
    rng = np.random.default_rng(0)
    tree = taught(TreeConfig(), rng)
    whole = motion(1, rng)
    for _ in range(3):
        tree.insert(whole[:24])
        tree.insert(whole[24:] + rng.normal(0, 1e-4, whole[24:].shape), goes_on=True)
    assert len(tree.leaves) == 8
    assert not tree.node(0).settled


def test_what_is_a_part_is_told_on_by_state_and_merging() -> None:
    rng = np.random.default_rng(1)
    tree, other = taught(TreeConfig(), rng), taught(TreeConfig(), rng)
    for each in (tree, other):
        hesitate(each, 3, 24, rng)
        assert len(each.node(0).settled) == 2
        assert waiting(each) == set()
    again = PrimitiveTree(tree.config, D, RATE_HZ)
    again.load_state(tree.state())
    assert again.node(0).settled == tree.node(0).settled
    assert waiting(merge_trees([tree, other]).tree) == set()


def ramp(rng: np.random.Generator) -> FloatArray:
    """A motion whose second part goes on as the whole does, only less far, shape (T, D)."""
    there = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, T))
    return there[:, None] * SHAPES[6, :, 0] + TIME @ rng.normal(0, 0.02, (D, 3)).T


@pytest.mark.parametrize("at", [12, 14, 16, 18])
def test_a_part_and_a_whole_are_no_two_executions(at: int) -> None:
    born: dict[bool, list[set[int]]] = {True: [], False: []}
    for config in (TreeConfig(), KEPT):
        rng = np.random.default_rng(at)
        tree = PrimitiveTree(config, D, RATE_HZ)
        shown = [tree.insert(motion(kind, rng)) for kind in range(3)]
        whole = ramp(rng)
        shown += [tree.insert(whole[:at]), tree.insert(whole[at:], goes_on=True)]
        for _ in range(2):
            shown += [tree.insert(motion(kind, rng)) for kind in range(3, 6)]
            shown.append(tree.insert(ramp(rng)))
        for placement in shown:
            moved = {number for number, node in placement.moved if node in placement.born}
            born[config.ignore_fragments] += [moved | {placement.number}] * bool(placement.born)
    assert {4, 8} in born[False]  # the second part and the first whole
    assert {4, 8} not in born[True]
    assert any({8, 12} <= each for each in born[True])  # the two wholes


@pytest.mark.parametrize("seed", range(8))
def test_motions_that_nobody_cuts_in_two_are_learned_as_if_nobody_ever_did(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree, kept = (PrimitiveTree(config, D, RATE_HZ) for config in (TreeConfig(), KEPT))
    for kind in rng.integers(0, 6, 40):
        frames = motion(int(kind), rng)
        assert tree.insert(frames, goes_on=True) == kept.insert(frames, goes_on=True)


@pytest.mark.parametrize("kind", range(6))
@pytest.mark.parametrize("follows", [True, False])
def test_a_part_that_came_before_its_motion_was_known_becomes_no_primitive(
    kind: int, follows: bool
) -> None:
    for config, born in ((TreeConfig(), int(not follows)), (KEPT, 1)):
        rng = np.random.default_rng(kind)
        early, late = (PrimitiveTree(config, D, RATE_HZ) for _ in range(2))
        whole = motion(kind, rng)
        early.insert(whole[:24])
        early.insert(whole[24:], goes_on=follows)
        for k in range(24):
            late.insert(motion(k % 6, rng))
        tree = PrimitiveTree(config, D, RATE_HZ)
        tree.load_state(merge_trees([late, early]).tree.state())  # what followed still does
        assert len(tree.leaves) == 6
        tree.insert(motion(kind, rng)[:24])  # what it goes on with is still to come
        assert len(tree.leaves) == 6 + born


def test_a_first_segment_follows_none_whatever_is_said_of_it() -> None:
    rng = np.random.default_rng(0)
    tree, again = (PrimitiveTree(TreeConfig(), D, RATE_HZ) for _ in range(2))
    for kind in (0, 1, 0, 1):
        tree.insert(motion(kind, rng), goes_on=True)
    assert tree.state().follows.tolist() == [1, 2, 3]
    again.load_state(tree.state())
    assert again.state() == tree.state()


def unsure(tree: PrimitiveTree) -> list[int]:
    """The primitives that may be parts: of fewer than five exemplars."""
    return [id for id in tree.leaves if len(tree.node(id).members) < 5]


def parts_of_one(
    tree: PrimitiveTree, id: int, shown: list[FloatArray], goes_on: list[bool]
) -> bool:
    """Whether each exemplar of a primitive, with the one beside it, is another that came as often.

    As anybody finds out who has all that was shown, and asks what it is recognised as.
    """
    recogniser, wholes = tree.recogniser(), set(tree.leaves) - {id}
    for number in tree.node(id).members:
        beside = [first for first in (number - 1, number) if goes_on[first + 1]]
        seen = [np.concatenate([shown[first], shown[first + 1]]) for first in beside]
        wholes &= {recogniser.recognise(each).primitive for each in seen}
    often = max(3, tree.node(id).n_placed)
    return any(tree.node(each).n_placed >= often for each in wholes)


@pytest.mark.parametrize("at", [14, 24, 40])
@pytest.mark.parametrize("kind", range(6))
def test_a_primitive_of_parts_goes_once_the_motion_is_known_whole(kind: int, at: int) -> None:
    trees = [PrimitiveTree(replace(TreeConfig(), drop_fragments=on), D, RATE_HZ) for on in (1, 0)]
    for tree in trees:
        rng = np.random.default_rng((kind, at))
        for _ in range(2):
            for other in range(1, 6):
                tree.insert(motion((kind + other) % 6, rng))
            hesitate(tree, kind, at, rng)
        for k in range(36):
            tree.insert(motion((kind + k) % 6, rng))
    assert len(trees[0].leaves) == 6
    assert len(trees[1].leaves) == 8


DROPPING = TreeConfig()
NOT = replace(TreeConfig(), drop_fragments=False)


@pytest.mark.parametrize("at", range(10, 22, 2))
def test_a_primitive_born_of_parts_of_its_own_motion_is_born_anew(at: int) -> None:
    rng = np.random.default_rng(at)
    tree = PrimitiveTree(DROPPING, D, RATE_HZ)
    shown: list[FloatArray] = []
    parts = []

    def show(frames: FloatArray, goes_on: bool = False) -> Placement:
        shown.append(frames)
        return tree.insert(frames, goes_on=goes_on)

    for _ in range(2):
        for kind in range(1, 6):
            show(motion(kind, rng))
        whole = ramp(rng)
        show(whole[:at])
        parts.append(show(whole[at:], goes_on=True).number)
    (false,) = (id for id in tree.leaves if parts[0] in tree.node(id).members)
    wholes, gone = [], None
    for k in range(20):
        before, recogniser = tree.node(false), tree.recogniser()
        placed = show(ramp(rng)) if k % 6 == 0 else show(motion(k % 6, rng))
        wholes += [placed.number] * (k % 6 == 0)
        if false in placed.removed:
            gone = placed
            break
    assert gone is not None and gone.parts == (false,)
    joined = [np.concatenate([shown[part - 1], shown[part]]) for part in parts]
    assert {recogniser.recognise(each).primitive for each in joined} == {false}
    assert set(before.members) == {*parts, *wholes}
    (true,) = gone.born
    assert dict(gone.moved).items() >= dict.fromkeys(wholes, true).items()
    assert tree.node(true).members[: len(wholes)] == tuple(wholes)
    assert tree.insert(ramp(rng)).node_id == true


@pytest.mark.parametrize("seed", range(6))
def test_what_is_dropped_is_what_anybody_recognises_as_parts_of_one_motion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree, shown, goes_on, dropped = PrimitiveTree(DROPPING, D, RATE_HZ), [], [False], 0
    for _ in range(70):
        kind, at = int(rng.integers(0, 4)), (14, 24, 40)[int(rng.integers(0, 3))]
        whole = motion(kind, rng)
        cut = rng.random() < 0.3
        for frames in (whole[:at], whole[at:]) if cut else (whole,):
            goes_on[-1] &= bool(rng.random() < 0.9)
            plain = PrimitiveTree(NOT, D, RATE_HZ)
            plain.load_state(tree.state())
            begins = bool(goes_on[-1])
            shown.append(frames)
            expected, placed = (each.insert(frames, goes_on=begins) for each in (plain, tree))
            goes_on.append(True)
            few = unsure(plain)
            turn = few[tree.n_seen % len(few)] if few else None
            gone = (
                turn is not None
                and expected == expected._replace(**Change()._asdict())
                and placed.number not in plain.node(turn).members
                and parts_of_one(plain, turn, shown, goes_on)
            )
            assert placed == (
                expected._replace(removed=(turn,), parts=(turn,)) if gone else expected
            )
            dropped += gone
    assert dropped


@pytest.mark.parametrize("asked", ["keep", "freeze"])
def test_what_a_person_had_a_hand_in_is_not_dropped(asked: str) -> None:
    trees = [PrimitiveTree(DROPPING, D, RATE_HZ) for _ in range(2)]
    for tree in trees:
        rng = np.random.default_rng(5)
        for _ in range(2):
            for other in range(1, 6):
                tree.insert(motion(other, rng))
            first, _ = hesitate(tree, 0, 24, rng)
        (part,) = (id for id in tree.leaves if first in tree.node(id).members)
        if tree is trees[0]:
            getattr(tree, asked)(part)
        for k in range(36):
            tree.insert(motion(k % 6, rng))
    assert set(trees[0].leaves) - set(trees[1].leaves) == {part}


def test_parts_that_are_shown_more_often_than_the_whole_are_motions() -> None:
    rng = np.random.default_rng(2)
    tree = PrimitiveTree(DROPPING, D, RATE_HZ)
    for _ in range(4):
        hesitate(tree, 0, 24, rng)
        for other in range(1, 6):
            tree.insert(motion(other, rng))
    known = set(tree.leaves)
    assert len(known) == 7
    for _ in range(3):
        tree.insert(motion(0, rng))
        for k in range(10):
            tree.insert(motion(1 + k % 5, rng))
    assert known < set(tree.leaves)

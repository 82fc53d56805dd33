"""A person changes the tree by hand: what holds afterwards, and what is refused."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from motions import RATE_HZ, Motions

from mplearn.errors import InvalidValueError, StateError, UnknownPrimitiveError
from mplearn.tree import ROOT, Merge, NodesEdit, PrimitiveTree, Reparent, TreeConfig
from mplearn.tree.exemplars.memory import SegmentMemory

D = 6


def learned(n_motions=4, n_rounds=7, seed=0, **rules):
    motions = Motions(n_motions, D, seed)
    tree = PrimitiveTree(TreeConfig(**rules), D, RATE_HZ)
    home = {}
    for motion, frames in motions.session(n_rounds):
        home[motion] = tree.insert(frames).node_id
    return tree, motions, home


def whole(tree):
    """Every link goes both ways, every segment that is held is needed, and none is missing."""
    for node in tree.nodes:
        if node.id != ROOT:
            assert node.id in tree.node(node.parent).children
        assert node.matrix.shape == (len(node.members),) * 2
        np.testing.assert_allclose(node.matrix, node.matrix.T)
    state = tree.state()
    needed = {n for node in state.nodes for n in node.members.tolist()}
    assert set(tree.bank.numbers()) == needed | set(state.sample.numbers.tolist())
    again = PrimitiveTree(tree.config, D, RATE_HZ)
    again.load_state(state)
    assert again.state() == state
    assert set(tree.recogniser().primitives) == set(tree.leaves)


def test_a_split_by_hand_stays_split():
    tree, motions, home = learned()
    leaf = home[0]
    n_placed, k = tree.node(leaf).n_placed, len(tree.node(leaf).members)
    change = tree.split(leaf, [range(k // 2), range(k // 2, k)])
    assert change.splits[0].node == leaf and change.born == change.splits[0].into
    assert leaf not in tree.leaves and set(change.born) <= set(tree.leaves)
    assert sum(tree.node(id).n_placed for id in change.born) == pytest.approx(n_placed, abs=1)
    whole(tree)
    for _ in range(5):  # one motion for the rules, but a person knows better
        assert not tree.insert(motions.perform(0)).merges
    assert set(change.born) <= set(tree.leaves)
    assert tree.node(leaf).history[-1][0] == "split"


def test_a_merge_by_hand_stays_merged():
    tree, motions, home = learned(max_exemplars=10)
    first, second = sorted((home[0], home[1]))
    placed = tree.node(first).n_placed + tree.node(second).n_placed
    change = tree.merge(second, first)
    assert change.merges == (Merge(first, second),) and not change.removed
    assert second not in [node.id for node in tree.nodes]
    assert tree.node(first).n_placed == placed
    whole(tree)
    for m in (0, 1) * 6:
        placement = tree.insert(motions.perform(m))
        assert not placement.splits
    assert first in tree.leaves


def test_what_was_split_and_merged_again_leaves_no_empty_node():
    tree, _, home = learned()
    change = tree.split(home[0])
    first, second = sorted(change.born)
    undone = tree.merge(first, second)
    assert undone.merges == (Merge(first, second),)
    assert undone.removed == (home[0],) and undone.reparented == (Reparent(first, ROOT),)
    assert tree.node(first).parent == ROOT
    whole(tree)


def test_what_was_split_and_learned_on_is_merged_again():
    tree, motions, home = learned(max_exemplars=8)
    halves = tree.split(home[0]).born
    for _ in range(12):  # both fill: together they hold more than one may
        tree.insert(motions.perform(0))
    k = sum(len(tree.node(id).members) for id in halves)
    assert k > 8
    change = tree.merge(*halves)
    assert change.merges == (Merge(*halves),) and change.removed == (home[0],)
    assert len(tree.node(halves[0]).members) == 8
    assert np.isfinite(tree.nearest_others()).all(axis=1)[tree.leaves.index(halves[0])]
    whole(tree)


@pytest.mark.parametrize("then", ["merged", "removed"])
def test_what_was_removed_and_learned_anew_comes_back_once(then):
    tree, _, home = learned()
    members, before = sorted(tree.node(home[0]).members), tree.state().nodes
    tree.remove(home[0])
    edit = NodesEdit.between(before, tree.state().nodes, tree.bank.floor.copy())
    (anew,) = tree.place_unplaced().born
    tree.exchange(edit.reversed())  # now it is a primitive twice, of the same executions
    if then == "merged":
        tree.merge(home[0], anew)
        assert sorted(tree.node(home[0]).members) == members
    else:
        tree.remove(home[0])
        tree.remove(anew)
        assert sorted(tree.node(ROOT).members) == members
    whole(tree)


@pytest.mark.parametrize("seed", range(3))
def test_what_came_to_a_merged_primitive_is_counted_where_it_belongs_when_that_is_undone(seed):
    """However few exemplars it kept of all that came, and however uneven that was."""
    tree, motions, home = learned(max_exemplars=8, seed=seed)
    first, second = sorted((home[0], home[1]))
    motion = {id: m for m, id in home.items()}
    expected = {id: (tree.node(id).n_placed, tree.node(id).n_frames) for id in (first, second)}
    before = tree.state().nodes
    tree.merge(first, second)
    edit = NodesEdit.between(before, tree.state().nodes, tree.bank.floor.copy())
    for id in [first] * 40 + [second] * 3 + [first] * 20:
        frames = motions.perform(motion[id])
        placement = tree.insert(frames)
        assert placement.node_id != second and not placement.splits
        n_placed, n_frames = expected[id]
        if placement.node_id == first:
            expected[id] = n_placed + 1, n_frames + len(frames)
    assert sum(n for n, _ in expected.values()) == tree.node(first).n_placed > 50
    tree.exchange(edit.reversed())
    for id, counts in expected.items():
        assert (tree.node(id).n_placed, tree.node(id).n_frames) == counts
    whole(tree)
    tree.exchange(edit)
    assert tree.node(first).n_placed == sum(n for n, _ in expected.values())
    whole(tree)


def test_what_two_primitives_hold_is_let_go_by_both_at_once():
    memory = SegmentMemory(TreeConfig(n_sampled=3), np.zeros(D, np.int64))
    for number in range(4):
        memory.remember(number, Motions(1, D).perform(0))
        memory.hold(number)
    (free,) = set(range(4)) - set(memory.sample().numbers.tolist())
    memory.release(free, free)
    assert free not in memory.frames and free not in memory.bank


def test_a_state_with_more_exemplars_than_the_rules_allow_is_refused():
    tree, _, _ = learned(max_exemplars=8)
    strict = PrimitiveTree(TreeConfig(max_exemplars=6), D, RATE_HZ)
    with pytest.raises(StateError, match="at most 6, not"):
        strict.load_state(tree.state())
    assert strict.leaves == ()


def test_a_removed_primitive_waits_or_is_forgotten():
    tree, motions, home = learned()
    leaf = home[2]
    members = tuple(tree.node(leaf).members)
    waiting = len(tree.node(ROOT).members)
    change = tree.remove(leaf)
    assert change.removed == (leaf,)
    assert change.moved == tuple((number, ROOT) for number in members)
    assert len(tree.node(ROOT).members) == waiting + len(members)
    whole(tree)
    again = tree.insert(motions.perform(2))
    assert not again.recognised and len(again.born) == 1 and again.born[0] != leaf
    assert {number for number, _ in again.moved} == set(members)
    tree.remove(again.born[0], forget=True)
    assert not set(members) & set(tree.node(ROOT).members)
    assert tree.insert(motions.perform(2)).node_id == ROOT
    whole(tree)


def test_a_node_is_hung_below_another():
    tree, motions, home = learned()
    pair = tree.split(home[0]).born
    change = tree.reparent(home[1], home[0])
    assert change.reparented == (Reparent(home[1], home[0]),)
    assert tree.node(home[1]).parent == home[0]
    assert tree.node(home[1]).history[-1][0] == "moved"
    whole(tree)
    assert tree.insert(motions.perform(1)).node_id == home[1]
    change = tree.reparent(pair[0], ROOT)
    assert tree.node(pair[0]).parent == ROOT and not change.removed
    change = tree.reparent(pair[1], ROOT)  # the node above holds one other only: it goes
    assert change.removed == (home[0],) and Reparent(home[1], ROOT) in change.reparented
    whole(tree)


def test_what_cannot_be_done_is_refused_and_changes_nothing():
    tree, _, home = learned()
    inner = home[0]
    pair = tree.split(inner).born
    before = tree.state()
    for act, error, said in [
        (lambda: tree.split(99), UnknownPrimitiveError, "99"),
        (lambda: tree.split(ROOT), UnknownPrimitiveError, "known are"),
        (lambda: tree.split(inner), UnknownPrimitiveError, "no primitive"),
        (lambda: tree.split(home[1], [[0, 1], [1, 2]]), InvalidValueError, "once"),
        (lambda: tree.split(home[1], [[0], [1, 2, 3]]), InvalidValueError, "at least 2"),
        (lambda: tree.merge(home[1], home[1]), InvalidValueError, "itself"),
        (lambda: tree.merge(home[1], 99), UnknownPrimitiveError, "99"),
        (lambda: tree.remove(inner), UnknownPrimitiveError, "no primitive"),
        (lambda: tree.reparent(home[1], home[2]), InvalidValueError, "must be one of"),
        (lambda: tree.reparent(inner, inner), InvalidValueError, "above it"),
        (lambda: tree.reparent(ROOT, inner), InvalidValueError, "root"),
        (lambda: tree.reparent(pair[0], 99), UnknownPrimitiveError, "99"),
        (lambda: tree.radius(inner), UnknownPrimitiveError, "radius"),
    ]:
        with pytest.raises(error, match=said):
            act()
        assert tree.state() == before

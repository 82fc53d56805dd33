"""Arrays in blocks: what is kept is what was written, and nothing depends on how it is laid out."""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent))
from motions import RATE_HZ, Motions

from mplearn.tree import PrimitiveTree, TreeConfig
from mplearn.tree.exemplars import slot_arrays
from mplearn.tree.exemplars.slot_arrays import SlotArrays


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(-1, 30), max_size=60))
def test_slots_hold_what_was_written_whatever_came_and_went(steps):
    kept = SlotArrays((2, 3), ())
    truth = {}
    for step, choice in enumerate(steps):
        if choice < 0 or not truth:
            slot = kept.take()
            assert slot not in truth
            truth[slot] = (np.full((2, 3), float(step)), float(-step))
            kept.write(slot, truth[slot])
        else:
            slot = sorted(truth)[choice % len(truth)]
            del truth[slot]
            kept.release(slot)
    slots = np.array(sorted(truth, reverse=True), dtype=np.int64)
    for which in range(2):
        expected = [truth[int(slot)][which] for slot in slots]
        assert np.array_equal(
            kept.gather(slots, which), np.array(expected).reshape(-1, *kept.shapes[which])
        )
    assert kept.n_slots <= max(1, len(steps))


@pytest.mark.parametrize("n_slots", [5, slot_arrays.BLOCK + 5])
def test_rows_lie_side_by_side_however_many_blocks_there_are(n_slots):
    kept = SlotArrays((1,))
    known = np.zeros(n_slots, [("id", np.int64), ("slot", np.int64)])
    known["slot"] = [kept.take() for _ in range(n_slots)]
    parts = list(kept.parted(known["slot"]))
    assert len(parts) == len(kept.blocks) == -(-n_slots // slot_arrays.BLOCK)
    assert all(rows.flags.c_contiguous for _, rows, _ in parts)


def test_one_array_of_some_slots_is_written_and_no_fork_sees_it(monkeypatch):
    monkeypatch.setattr(slot_arrays, "BLOCK", 4)
    kept = SlotArrays((3,), (2,))
    for slot in range(10):
        kept.write(kept.take(), (np.full(3, slot), np.full(2, slot)))
    twin, slots = kept.fork(), np.array([9, 1, 5])
    kept.write_some(slots, 0, np.array([[-1.0, -2.0], [-3.0, -4.0], [-5.0, -6.0]]))
    assert kept.gather(slots, 0).tolist() == [[-1, -2, 9], [-3, -4, 1], [-5, -6, 5]]
    assert kept.gather(np.arange(10), 1).tolist() == [[slot, slot] for slot in range(10)]
    assert twin.gather(np.arange(10), 0).tolist() == [[slot] * 3 for slot in range(10)]


def learned(config):
    motions = Motions(9, 6, 4)
    tree = PrimitiveTree(config, 6, RATE_HZ)
    said = [tree.insert(frames) for _, frames in motions.session(7)]
    assert len(tree.leaves) > 5
    tree.merge(*tree.leaves[:2])
    tree.remove(tree.leaves[2])
    said += [tree.insert(motions.perform(m)) for m in range(9)]
    return said, [(node.id, node.members, node.matrix.tobytes()) for node in tree.nodes]


def test_what_is_learned_does_not_depend_on_the_layout(monkeypatch):
    config = TreeConfig(n_sampled=40, max_exemplars=5, max_unplaced=30)
    expected = learned(config)
    monkeypatch.setattr(slot_arrays, "BLOCK", 7)
    assert learned(config) == expected


def test_the_index_that_grew_is_the_one_built_anew():
    motions = Motions(15, 3, 8)
    tree = PrimitiveTree(TreeConfig(), 3, RATE_HZ)
    for _, frames in motions.session(6):
        tree.insert(frames)
    for _ in range(3):
        tree.remove(tree.leaves[1], forget=True)
        tree.merge(*tree.leaves[-2:])
    index, bank = tree._structure.index, tree._memory.bank
    anew = type(index).from_state(tree.config, bank, index.state())
    assert tree.leaves == tuple(n.id for n in tree.nodes if n.id and n.is_leaf)
    for id, distances in zip(tree.leaves, tree.nearest_others(), strict=True):
        matrix = tree.node(id).matrix
        nearest = [np.sort(np.delete(row, k))[:2].mean() for k, row in enumerate(matrix)]
        np.testing.assert_allclose(distances[~np.isnan(distances)], nearest)
    means = np.stack([bank.mean_profile(group) for group in index.members])
    for m in range(15):
        points = tree.recogniser()._bank.model(np.resize(motions.perform(m), (16, 3)))
        assert index.search(points, bank) == anew.search(points, bank)
        offsets = means - bank.profile(points)
        nearest = np.argsort((offsets**2).sum(axis=1))[: tree.config.n_candidates]
        assert {match.node for match in index.search(points, bank)} == set(index.ids[nearest])

"""The tree on streams whose truth is known: what it finds, keeps, forgets and refuses."""

import copy
import hashlib
import json
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent))
from motions import RATE_HZ, Motions

from mplearn.errors import FrameError, InvalidValueError, UnknownPrimitiveError
from mplearn.state import checkpoint, from_plain, to_plain
from mplearn.state.packing import packed, unpacked
from mplearn.tree import ROOT, NormalisationConfig, PrimitiveTree, TreeConfig

D = 6


def new_tree(**rules):
    return PrimitiveTree(TreeConfig(**rules), D, RATE_HZ)


def learned(n_motions=5, n_rounds=7, seed=0, **rules):
    motions = Motions(n_motions, D, seed)
    session = motions.session(n_rounds)
    tree = new_tree(**rules)
    placements = [tree.insert(frames) for _, frames in session]
    return tree, placements, [motion for motion, _ in session], motions


def home_of(placements):
    home = {}
    for p in placements:
        home[p.number] = p.node_id
        home.update(p.moved)
    return home


def digest(state):
    """A hash over a state that depends on every bit."""
    return hashlib.sha256(checkpoint(state).document).hexdigest()


@pytest.mark.parametrize("n_motions", [2, 5, 25])
@pytest.mark.parametrize("seed", [0, 1])
def test_every_motion_becomes_one_primitive_however_many_there_are(n_motions, seed):
    tree, placements, labels, _ = learned(n_motions, 8, seed)
    home = home_of(placements)
    assert len(tree.leaves) == n_motions
    for leaf in tree.leaves:
        assert len({labels[n] for n, node in home.items() if node == leaf}) == 1
    late = placements[-n_motions:]
    assert sum(p.recognised for p in late) >= 0.9 * n_motions


def test_a_primitive_is_born_of_its_second_demonstration_and_confirmed_by_the_third():
    motions = Motions(3, D, 3)
    tree = new_tree()
    for motion in (0, 1, 2):
        placement = tree.insert(motions.perform(motion))
        assert placement.node_id == ROOT and not placement.born
    second = tree.insert(motions.perform(0))
    assert not second.recognised
    assert second.born == (second.node_id,)
    assert [number for number, _ in second.moved] == [0]
    assert tree.is_provisional(second.node_id)
    third = tree.insert(motions.perform(0))
    assert third.recognised and third.node_id == second.node_id and third.ratio <= 1
    assert third.distance > 0
    assert not tree.is_provisional(second.node_id)
    other = tree.insert(motions.perform(1))
    assert not other.recognised
    node = tree.node(second.node_id)
    assert node.n_placed == 3
    assert node.history == (("born", 4),)


@pytest.mark.parametrize("least", [2, 3, 4, 5])
def test_as_many_demonstrations_are_needed_as_the_rules_say(least):
    motions = Motions(3, D, 3)
    tree = new_tree(min_exemplars=least)
    births = [bool(tree.insert(motions.perform(m)).born) for m in (0, 1, 2) * 5]
    assert births.index(True) == 3 * (least - 1)


def test_what_nothing_confirms_is_forgotten_and_what_is_confirmed_stays():
    motions = Motions(4, D, 3)
    tree = new_tree(patience=10)
    ours, chance = motions.perform(0), motions.perform(1)
    born = [tree.insert(frames).born for frames in (ours, chance, motions.perform(2), ours, chance)]
    (sure,), (lone,) = born[3], born[4]
    later = [tree.insert(motions.perform(0)) for _ in range(14)]
    removed = [placement.removed for placement in later]
    assert removed == [()] * 10 + [(lone,)] + [()] * 3  # 10 more than when it was born
    assert tree.leaves == (sure,)
    assert not tree.insert(chance).recognised
    resumed = new_tree(patience=10)
    resumed.load_state(tree.state())
    assert resumed.leaves == (sure,) and not resumed.is_provisional(sure)


def test_a_cluster_that_is_one_motion_with_a_primitive_joins_it():
    """Distances as they lie: two of a kind wait, and all of a leaf's exemplars are near them."""
    motions = Motions(3, D, 5)
    tree = new_tree(young_reach=0.05, least_reach=0.05, reach=0.05)  # nothing is recognised
    for m in (0, 1, 2) * 6:
        tree.insert(motions.perform(m))
    assert len(tree.leaves) == 3
    assert sum(tree.node(id).n_placed for id in tree.leaves) >= 15


def test_unknown_motions_stay_outside():
    tree, _, _, motions = learned(5, 6)
    strangers = Motions(10, D, 99)
    assert not any(tree.insert(strangers.perform(m)).recognised for m in range(10))
    assert tree.insert(motions.perform(0)).recognised


def test_a_leaf_of_two_motions_is_split_and_both_live_on():
    motions = Motions(4, D, 5)
    offset = np.zeros(D)
    offset[0] = 0.55
    motions.keys[1] = motions.keys[0] + [[0, 0, 0, 0, 0, 0], offset, offset * 0.5, [0] * 6]
    order = [0, 1, 2, 3] * 2 + [0, 1] * 8
    tree = new_tree(spread=30.0, mean_share=0.5, reach=2.0)  # so coarse that 0 and 1 start as one
    placements = [tree.insert(motions.perform(m)) for m in order]
    splits = [split for p in placements for split in p.splits]
    assert splits, "the two motions were never mixed, or never told apart"
    assert all(split.node not in tree.leaves for split in splits)
    assert set(splits[0].into) <= set(tree.leaves)
    assert all(tree.node(child).parent == splits[0].node for child in splits[0].into)
    home = home_of(placements)
    for child in splits[0].into:
        assert len({order[n] for n, node in home.items() if node == child}) == 1


def test_two_leaves_of_one_motion_are_merged():
    tree, _, _, motions = learned(3, 8, split_ratio=np.inf)
    leaf = tree.leaves[0]
    state = tree.state()
    root, *others = state.nodes
    whole = next(node for node in others if node.id == leaf)
    k = len(whole.members) // 2
    first, twin = (
        replace(
            whole,
            id=id,
            members=whole.members[part],
            frames=whole.frames[part],
            matrix=whole.matrix[part, part],
        )
        for id, part in ((leaf, slice(k)), (77, slice(k, None)))
    )
    root = replace(root, children=(*root.children, 77))
    nodes = (root, *(first if node is whole else node for node in others), twin)
    again = new_tree(split_ratio=np.inf)
    again.load_state(replace(state, next_id=78, nodes=nodes))
    assert len(again.leaves) == 4
    merges = []
    for _ in range(6):
        for motion in range(3):
            merges += again.insert(motions.perform(motion)).merges
    assert merges == [(leaf, 77)]
    assert len(again.leaves) == 3
    with pytest.raises(UnknownPrimitiveError, match="77"):
        again.node(77)


@given(st.integers(0, 1000))
@settings(max_examples=8, deadline=None)
def test_the_recogniser_decides_as_the_tree_places(seed):
    tree, _, _, motions = learned(4, 5, seed)
    strangers = Motions(3, D, seed + 1)
    for source, m in [(motions, 0), (motions, 3), (strangers, 1), (motions, 2)]:
        frames = source.perform(m)
        said = tree.recogniser().recognise(frames)
        before = tree.state()
        placed = tree.insert(frames)
        node = next((s.node for s in placed.splits), placed.node_id)
        assert said.primitive == (node if placed.recognised else None)
        assert (said.distance, said.ratio) == (placed.distance, placed.ratio)
        tree.load_state(before)


def test_recognition_changes_nothing_and_survives_storage():
    tree, _, _, motions = learned(4, 6)
    recogniser = tree.recogniser()
    before = digest(tree.state()), digest(recogniser.state())
    frames = [motions.perform(m % 4) for m in range(8)]
    said = [recogniser.recognise(f) for f in frames]
    assert (digest(tree.state()), digest(recogniser.state())) == before
    again = type(recogniser).from_state(recogniser.state())
    assert [again.recognise(f) for f in frames] == said
    assert again.primitives == tree.leaves
    for frames_, answer in zip(frames, said, strict=True):
        assert answer.alternatives[0].distance == answer.distance
        tree.insert(frames_)  # the recogniser is frozen: what the tree learns does not reach it
    assert [recogniser.recognise(f) for f in frames] == said


def test_state_resumes_bit_for_bit():
    motions = Motions(5, D, 2)
    session = [frames for _, frames in motions.session(6)]
    straight, first = new_tree(n_sampled=8), new_tree(n_sampled=8)
    for frames in session:
        straight.insert(frames)
    for frames in session[:13]:
        first.insert(frames)
    second = new_tree(n_sampled=8)
    second.load_state(first.state())
    for frames in session[13:]:
        second.insert(frames)
    assert digest(second.state()) == digest(straight.state())


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda tree: pickle.loads(pickle.dumps(tree))])
def test_a_copy_goes_on_bit_for_bit_and_apart(copied):
    some, others = Motions(12, D, 4), Motions(12, D, 5)
    tree = new_tree()
    for _, frames in some.session(3):
        tree.insert(frames)
    twin = copied(tree)
    before = digest(twin.state())
    later = [frames for _, frames in some.session(1) + others.session(2)]
    said = [repr(tree.insert(frames)) for frames in later]
    assert digest(twin.state()) == before
    assert [repr(twin.insert(frames)) for frames in later] == said
    assert digest(twin.state()) == digest(tree.state())


def test_a_new_process_gives_the_same_bits():
    program = "import test_primitive_tree as t; print(t.digest(t.learned(4, 6, 1)[0].state()))"
    here = digest(learned(4, 6, 1)[0].state())
    there = subprocess.run(
        [sys.executable, "-c", program],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    assert there == here


def test_memory_is_bounded_however_long_the_stream():
    tree, _, _, motions = learned(3, 10, max_exemplars=6, max_unplaced=10, n_sampled=12)
    junk = Motions(40, D, 7)
    for m in range(40):
        tree.insert(junk.perform(m))
        tree.insert(motions.perform(m % 3))
    assert len(tree.node(ROOT).members) <= 10
    assert all(len(tree.exemplars(leaf)) <= 6 for leaf in tree.leaves)
    held = tree.bank.numbers()
    assert len(held) <= 10 + 12 + 6 * len(tree.leaves)
    state = tree.state()
    kept = {n for node in state.nodes for n in node.members.tolist()}
    assert kept | set(state.sample.numbers.tolist()) == set(held)
    assert sum(tree.node(leaf).n_placed for leaf in tree.leaves) >= 60


def test_poison_leaves_no_trace():
    motions = Motions(3, D, 4)
    session = [frames for _, frames in motions.session(5)]
    clean, poisoned = new_tree(), new_tree()
    lost = session[0].copy()
    lost[:, 2] = np.nan
    for i, frames in enumerate(session):
        clean.insert(frames)
        poisoned.insert(frames)
        if i % 4 == 0:
            assert "channel 2" in poisoned.insert(lost).refused
            assert "1 frames" in poisoned.insert(frames[:1]).refused
            assert "too many" in poisoned.insert(np.zeros((1_000_000, D))).refused
            assert poisoned.insert(np.full((40, D), np.nan)).refused
            with pytest.raises(FrameError, match="infinite"):
                poisoned.insert(np.full((30, D), np.inf))
            with pytest.raises(FrameError, match="6"):
                poisoned.insert(np.zeros((30, 5)))
    assert digest(poisoned.state()) == digest(clean.state())


def test_gaps_and_short_segments_are_recognised_all_the_same():
    tree, _, _, motions = learned(4, 6, tempo=np.inf)
    frames = motions.perform(1)
    whole = tree.recogniser().recognise(frames)
    gaps = frames.copy()
    gaps[10:22, 3] = np.nan
    gaps[::3, 1] = np.nan
    assert tree.recogniser().recognise(gaps).primitive == whole.primitive is not None
    assert tree.insert(gaps).recognised
    few = motions.perform(1, seconds=0.14)  # 7 frames, fewer than the states
    assert tree.recogniser().recognise(few).primitive == whole.primitive
    assert tree.insert(few).recognised
    assert tree.model(whole.primitive).n_states <= 8


def test_a_segment_far_longer_than_a_motion_is_another_one_and_a_little_longer_is_not():
    strict, _, _, motions = learned(4, 6)
    free, *_ = learned(4, 6, tempo=np.inf)
    for m in range(4):
        leaf = free.recogniser().recognise(motions.perform(m, seconds=1.1)).primitive
        assert leaf is not None
        for seconds, told_apart in ((0.95, False), (1.15, False), (0.3, True), (3.6, True)):
            frames = motions.perform(m, seconds=seconds)
            found, any_tempo = (t.recogniser().recognise(frames) for t in (strict, free))
            assert any_tempo.primitive == leaf
            assert found.primitive == (None if told_apart else leaf)
            if not told_apart:
                assert found.distance == pytest.approx(any_tempo.distance, rel=0.1)


def test_a_recording_that_is_played_again_and_again_is_learned_from():
    motions = Motions(6, D, 3)
    tree = new_tree()
    once = [motions.perform(m) for m in range(6)]
    first, second, third = ([tree.insert(frames) for frames in once] for _ in range(3))
    assert not any(placement.born for placement in first)
    assert [len(placement.born) for placement in second] == [1] * 6
    assert all(placement.recognised for placement in third)


def test_identical_segments_make_one_primitive():
    still = np.zeros((40, D))
    tree = new_tree()
    for _ in range(12):
        placement = tree.insert(still)
    assert len(tree.leaves) == 1
    assert placement.recognised and placement.distance == 0
    motions = Motions(3, D, 0)
    for m in (0, 1, 2) * 6:
        tree.insert(motions.perform(m))
    assert len(tree.leaves) >= 3


def test_the_model_of_a_node_is_in_the_units_and_the_rate_of_the_stream():
    tree, *_ = learned(3, 6)
    for leaf in tree.leaves:
        model = tree.model(leaf)
        exemplars = tree.exemplars(leaf)
        assert model.n_channels == D
        assert model is tree.model(leaf)
        expected = np.mean([len(e) for e in exemplars]) * (model.n_states - 1) / model.n_states
        assert model.durations_frames.sum() == pytest.approx(expected, rel=0.3)
        assert np.abs(model.means[0] - np.mean([e[:4].mean(0) for e in exemplars], 0)).max() < 0.3


@pytest.mark.parametrize("rate_factor", [1, 3])
def test_frame_rate_does_not_matter(rate_factor):
    motions = Motions(5, D, 6)
    tree = PrimitiveTree(TreeConfig(), D, RATE_HZ * rate_factor)
    for _, frames in motions.session(6):
        at = np.linspace(0, len(frames) - 1, len(frames) * rate_factor)
        dense = np.stack([np.interp(at, np.arange(len(frames)), c) for c in frames.T], axis=1)
        tree.insert(dense)
    assert len(tree.leaves) == 5


def test_units_do_not_matter():
    plain, scaled = new_tree(), new_tree()
    mixed = PrimitiveTree(TreeConfig(), D, RATE_HZ, groups=(0, 0, 0, 1, 1, 1))
    unit = np.array([1, 1, 1, 1000, 1000, 1000])
    for _, frames in Motions(5, D, 8).session(6):
        told = plain.insert(frames), scaled.insert(frames * 1000.0), mixed.insert(frames * unit)
        assert told[0].node_id == told[1].node_id
    assert len(plain.leaves) == len(mixed.leaves) == 5


def test_the_rules_as_printed_find_well_separated_motions():
    motions = Motions(3, D, 11)
    tree = PrimitiveTree(TreeConfig.printed(), D, RATE_HZ)
    placements = []
    labels = []
    for motion, frames in motions.session(10):
        placements.append(tree.insert(frames))
        labels.append(motion)
    nodes = {p.node_id for p in placements} - {ROOT}
    assert nodes
    assert all(
        node.parent is None or node.parent in [n.id for n in tree.nodes] for node in tree.nodes
    )


def test_bad_rules_are_named():
    for rules, message in [
        ({"power": 0.0}, "power"),
        ({"min_exemplars": 1}, "min_exemplars"),
        ({"max_exemplars": 1}, "max_exemplars"),
        ({"n_states": 40}, "n_points"),
        ({"split_ratio": 0.5}, "split_ratio"),
    ]:
        with pytest.raises(InvalidValueError, match=message):
            TreeConfig(**rules)
    with pytest.raises(InvalidValueError, match="head"):
        NormalisationConfig(head=0.9, ramp=0.2)
    with pytest.raises(InvalidValueError, match="n_channels"):
        PrimitiveTree(TreeConfig(), 0, 100.0)
    with pytest.raises(InvalidValueError, match="groups"):
        PrimitiveTree(TreeConfig(), 3, 100.0, groups=(0, 1))
    with pytest.raises(UnknownPrimitiveError, match="9"):
        new_tree().node(9)


def test_a_state_is_plain_values_and_arrays():
    tree, *_ = learned(2, 5)
    for state in (tree.state(), tree.recogniser().state()):
        body, _ = packed(to_plain(state))
        assert from_plain(type(state), unpacked(json.loads(json.dumps(body)), _)) == state


def test_a_constant_channel_and_a_segment_that_rests_spoil_nothing():
    motions = Motions(4, D, 9)
    tree = PrimitiveTree(TreeConfig(), D + 1, RATE_HZ)
    for i, (_, frames) in enumerate(motions.session(7)):
        tree.insert(np.hstack([frames, np.full((len(frames), 1), 3.0)]))
        if i % 5 == 0:
            tree.insert(np.full((60, D + 1), 0.1))  # nothing moves
    known = {
        m: tree.recogniser().recognise(np.hstack([f, np.full((len(f), 1), 3.0)])).primitive
        for m in range(4)
        for f in [motions.perform(m)]
    }
    assert None not in known.values() and len(set(known.values())) == 4
    assert all(np.isfinite(tree.model(leaf).means).all() for leaf in tree.leaves)


def test_an_insertion_far_into_a_stream_touches_few_leaves():
    tree, _, _, motions = learned(12, 6)
    looked = tree.recogniser().recognise(motions.perform(0)).alternatives
    assert len(looked) == tree.config.n_candidates < len(tree.leaves)

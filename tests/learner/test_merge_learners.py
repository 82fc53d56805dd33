from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from mplearn import merge_learners as merge
from mplearn.errors import InvalidValueError
from mplearn.learner import LearnerConfig, MotionLearner, SegmentClosed
from mplearn.recording import Recording
from mplearn.tree import TreeConfig


def learned(features: Recording, first: int, last: int) -> MotionLearner:
    rules = TreeConfig(min_exemplars=4)  # primitives that are sure in both shards
    learner = MotionLearner(LearnerConfig(features.channels, features.rate_hz, tree=rules))
    learner.learn_many(features.frames[first:last])
    learner.end_stream()
    return learner


@pytest.fixture(scope="module")
def shards(features: Recording) -> tuple[MotionLearner, MotionLearner]:
    half = len(features.frames) // 2
    return learned(features, 0, half), learned(features, half, len(features.frames))


def counts(learner: MotionLearner) -> Counter[int]:
    return Counter(row[2] for row in learner.graph.edge_rows().tolist())


def test_shards_make_one_learner_whatever_their_order(shards, features) -> None:
    a, b = shards
    ab, ba = merge([a, b]), merge([b, a])
    assert len(ab.tree.leaves) == len(ba.tree.leaves) == 4
    assert counts(ab) == counts(ba)
    assert ab.graph.n_transitions >= a.graph.n_transitions + b.graph.n_transitions
    assert set(a.tree.leaves) <= set(ab.tree.leaves)
    assert ab.n_frames == len(features.frames)
    placed = [sum(each.tree.node(id).n_placed for id in each.tree.leaves) for each in (ab, a, b)]
    waiting = [len(each.tree.node(0).members) for each in (ab, a, b)]
    assert placed[0] + waiting[0] == sum(placed[1:] + waiting[1:])


def test_counts_are_those_of_one_learner_but_for_the_seam(shards, features) -> None:
    whole, merged = learned(features, 0, len(features.frames)), merge(shards)
    asked = whole.tree.recogniser()
    same = {}
    for id in merged.tree.leaves:
        votes = Counter(asked.recognise(x).primitive for x in merged.tree.exemplars(id))
        same[id] = votes.most_common(1)[0][0]
    assert len(set(same.values())) == 4
    differences = [
        abs(merged.graph.count(i, j) - whole.graph.count(same[i], same[j]))
        for i in same
        for j in same
    ]
    # the seam, and segments that one learner recognised and another did not
    assert sum(differences) <= 0.15 * whole.graph.n_transitions
    assert abs(whole.graph.n_transitions - merged.graph.n_transitions) <= 5


def test_a_merged_learner_goes_on(shards, features) -> None:
    merged = merge(shards)
    before = len(merged.tree.leaves), merged.graph.n_transitions
    events = [e for frame in features.frames[:6000] for e in merged.learn_one(frame)]
    closed = [e.placement for e in events if isinstance(e, SegmentClosed) and e.placement]
    assert np.mean([placement.recognised for placement in closed]) > 0.8
    assert 0 <= len(merged.tree.leaves) - before[0] <= 1
    assert merged.graph.n_transitions > before[1]
    resumed = MotionLearner.from_state(merge(shards).state())
    again = [e for frame in features.frames[:6000] for e in resumed.learn_one(frame)]
    assert again == events


def test_merging_changes_nobody_and_three_are_as_good_as_two(shards) -> None:
    a, b = shards
    before = a.graph.n_transitions, a.tree.n_seen, a.n_frames
    three = merge([a, b, a])
    assert (a.graph.n_transitions, a.tree.n_seen, a.n_frames) == before
    assert len(three.tree.leaves) == 4
    nested = merge([merge([a, b]), a]), merge([a, merge([b, a])])
    assert counts(nested[0]) == counts(nested[1]) == counts(three)


@pytest.mark.parametrize("whose", [0, 1])
def test_what_is_frozen_stays_as_it_is(shards, whose) -> None:
    learners = [MotionLearner.from_state(each.state()) for each in shards]
    id = learners[whose].tree.leaves[0]
    held = learners[whose].tree.exemplars(id)
    learners[whose].freeze(id)
    merged = merge(learners)
    (frozen,) = [node for node in merged.tree.nodes if node.frozen]
    assert merged.tree.exemplars(frozen.id) == held
    assert len(merged.tree.leaves) == len(merge(shards).tree.leaves) + 1
    assert MotionLearner.from_state(merged.state()).state() == merged.state()


def test_exemplars_are_shared_however_many_are_merged(shards) -> None:
    seen = {
        id(frames)
        for each in shards
        for node in each.tree.nodes
        for frames in each.tree.exemplars(node.id)
    }
    merged = merge([*shards, *shards, *shards])
    assert merged.n_frames == 3 * sum(each.n_frames for each in shards)
    found = [x for node in merged.tree.nodes for x in merged.tree.exemplars(node.id)]
    assert len(found) > 20
    assert {id(frames) for frames in found} <= seen


def test_what_cannot_be_merged(shards) -> None:
    for no_list in (shards[0], ["monday.db"]):
        with pytest.raises(InvalidValueError, match="a list of learners"):
            merge(no_list)
    with pytest.raises(InvalidValueError, match="at least one"):
        merge([])
    other = MotionLearner(replace(shards[0].config, longest_pause_s=3.0))
    with pytest.raises(InvalidValueError, match="same configuration"):
        merge([shards[0], other])
    alone = merge([shards[0]])
    assert alone.tree.leaves == shards[0].tree.leaves
    assert f"({len(alone.tree.leaves)} primitives of 1 person; {alone.n_frames} fr" in repr(alone)
    empty = MotionLearner(shards[0].config)
    assert counts(merge([empty, shards[0]])) == counts(merge([shards[0], empty]))

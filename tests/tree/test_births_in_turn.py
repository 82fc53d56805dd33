"""A segment forms few primitives: where there are more to form, the next ones form them."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import Motions
from test_sequences import RATE_HZ, TOGETHER, D, motion

from mplearn.graph import TransitionGraph
from mplearn.learner import TransitionSeen
from mplearn.learner.chain import Chain
from mplearn.recording import Segment
from mplearn.tree import PrimitiveTree, TreeConfig

AT_ONCE = replace(TreeConfig(), max_born=math.inf)
IN_TURN = replace(TreeConfig(), max_born=1)
N = 6  # motions that are known first


def placed(config, segments, resumed=False):
    """Return a tree that took segments, and what each formed but by splits."""
    tree, born = PrimitiveTree(config, D, RATE_HZ), []
    for frames in segments:
        found = tree.insert(frames)
        split = {id for each in found.splits for id in each.into}
        born.append([id for id in found.born if id not in split])
        if resumed:
            state = tree.state()
            tree = PrimitiveTree(config, D, RATE_HZ)
            tree.load_state(state)
    return tree, born


def groups(tree):
    """Numbers of the exemplars of each primitive."""
    return sorted(sorted(tree.node(id).members) for id in tree.leaves)


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 99), order=st.permutations([0, 0, 1, 1, 2, 2]))
def test_no_segment_forms_more_than_one_and_soon_the_same_is_formed(seed, order):
    motions = Motions(12, n_channels=D, seed=seed)
    kinds = [*(m for _ in range(5) for m in range(N)), *(N + k for k in order), 9, 10, 11]
    segments = [motions.perform(kind) for kind in kinds]
    (in_turn, born), (at_once, born_at_once) = (
        placed(config, segments) for config in (IN_TURN, AT_ONCE)
    )
    assert max(map(len, born)) <= 1
    assert sum(map(len, born)) == sum(map(len, born_at_once))
    assert groups(in_turn) == groups(at_once)


def twice(seed=0, after=(0, 1, 0)):
    """Six kinds six times, then two in a sequence that came twice, and then known ones."""
    rng = np.random.default_rng(seed)
    first = [motion(k % N, rng) for k in range(6 * N)]
    shown = {kind: [motion(kind, rng, 0.18) for _ in range(2)] for kind in sorted(set(TOGETHER))}
    return [*first, *(shown[kind].pop() for kind in TOGETHER[:-1]), *(first[k] for k in after)]


def test_a_sequence_that_came_twice_is_formed_by_what_comes_then_also_a_known_motion():
    segments = twice()
    _, at_once = placed(AT_ONCE, segments)
    tree, in_turn = placed(IN_TURN, segments)
    assert [len(each) for each in at_once[-4:]] == [2, 0, 0, 0]
    assert [len(each) for each in in_turn[-4:]] == [1, 1, 0, 0]
    assert placed(IN_TURN, segments, resumed=True)[1] == in_turn
    assert sorted(tree.leaves[-2:]) == sorted(at_once[-4])


def test_what_follows_what_is_counted_where_a_known_motion_forms_another_one():
    counts = []
    for config in (AT_ONCE, IN_TURN):
        tree, chain = PrimitiveTree(config, D, RATE_HZ), Chain(TransitionGraph(), RATE_HZ, 2.0)
        seen = [
            event
            for k, frames in enumerate(twice())
            for event in chain.follow(Segment(40 * k, 40 * k + 40), tree.insert(frames), 1e-9)
        ]
        transitions = [each for each in seen if isinstance(each, TransitionSeen)]
        counts.append(Counter(each.segment.start // 40 for each in transitions))
    assert max(counts[0].values()) == max(counts[1].values()) == 1  # nothing is counted twice
    assert counts[0] == counts[1] and max(counts[0]) == len(twice()) - 1

"""Primitives that were shown twice: known at once, then confirmed, or forgotten."""

from itertools import pairwise

import numpy as np
import pytest

from mplearn.errors import UnknownPrimitiveError
from mplearn.learner import (
    LearnerConfig,
    MotionLearner,
    PrimitiveBorn,
    PrimitiveConfirmed,
    PrimitiveForgotten,
    TransitionSeen,
)
from mplearn.tree import TreeConfig

RATE_HZ = 50.0


def walk(postures, order, seed=0):
    """Minimum-jerk movements from posture to posture, shape (T, D)."""
    rng = np.random.default_rng(seed)
    pieces = []
    for a, b in pairwise(order):
        x = np.linspace(0, 1, 50 + int(rng.integers(-4, 5)))[:, None]
        bell = x**3 * (10 - 15 * x + 6 * x**2)
        pieces.append(postures[a] + bell * (postures[b] - postures[a]) + rng.normal(0, 0.01, 4))
    return np.concatenate(pieces)


def learner(**rules):
    return MotionLearner(LearnerConfig(tuple("abcd"), RATE_HZ, tree=TreeConfig(**rules)))


POSTURES = np.random.default_rng(0).normal(size=(12, 4))


def test_a_primitive_is_born_provisional_and_confirmed_by_the_third_demonstration():
    mine = learner()
    events = mine.learn_many(walk(POSTURES, [0, 1, 2] * 3 + [0])) + mine.end_stream()
    born = [event for event in events if isinstance(event, PrimitiveBorn)]
    sure = [event for event in events if isinstance(event, PrimitiveConfirmed)]
    assert [(event.exemplars, event.provisional) for event in born] == [(2, True)] * 3
    assert [event.primitive for event in sure] == [event.primitive for event in born]
    assert all(event.exemplars == 3 for event in sure)
    assert not any(mine.tree.is_provisional(id) for id in mine.tree.leaves)


def test_with_three_demonstrations_asked_for_none_is_provisional():
    mine = learner(min_exemplars=3)
    events = mine.learn_many(walk(POSTURES, [0, 1, 2] * 4)) + mine.end_stream()
    born = [event for event in events if isinstance(event, PrimitiveBorn)]
    assert [(event.exemplars, event.provisional) for event in born] == [(3, False)] * 3
    assert not [event for event in events if isinstance(event, PrimitiveConfirmed)]


def test_what_nothing_confirms_is_forgotten_with_its_transitions():
    twice = [6, 7, 8, 6, 7, 8]
    frames = walk(POSTURES, [*twice, *([0, 1, 2] * 10)])
    mine = learner(patience=12)
    at = len(frames) // 2
    events = mine.learn_many(frames[:at])
    resumed = MotionLearner.from_state(mine.state())
    rest = mine.learn_many(frames[at:])
    assert resumed.learn_many(frames[at:]) == rest
    events += rest
    gone = {event.primitive for event in events if isinstance(event, PrimitiveForgotten)}
    born = {event.primitive for event in events if isinstance(event, PrimitiveBorn)}
    sure = {event.primitive for event in events if isinstance(event, PrimitiveConfirmed)}
    assert gone and gone == born - set(mine.tree.leaves) and gone.isdisjoint(sure)
    seen = {event.primitive for event in events if isinstance(event, TransitionSeen)}
    assert seen & gone
    assert set(mine.graph.ids) == set(mine.tree.leaves)
    assert set(mine.snapshot().graph.ids) == set(mine.tree.leaves)


def test_what_a_person_keeps_is_not_forgotten():
    frames = walk(POSTURES, [6, 7, 8, 6, 7, 8])
    mine, kept = learner(patience=12), learner(patience=12)
    for each in (mine, kept):
        each.learn_many(frames)
    first, *_ = mine.tree.leaves
    assert mine.tree.is_provisional(first)
    kept.keep(first)
    later = walk(POSTURES, [0, 1, 2] * 10)
    for each in (mine, kept):
        each.learn_many(later)
    assert set(kept.tree.leaves) - set(mine.tree.leaves) == {first}
    with pytest.raises(UnknownPrimitiveError, match=r"no primitive 999; known are \["):
        kept.keep(999)


def arc(stops, rng):
    """A way from the first posture to the second by a third, with stops on it, shape (T, D)."""
    s = np.concatenate([p + BELL * (q - p) for p, q in pairwise([0.0, *stops, 1.0])])[:, None]
    ends = (1 - s) * POSTURES[0] + s * POSTURES[1] + rng.normal(0, 0.01, 4)
    return ends + 4 * s * (1 - s) * POSTURES[9]


BELL = (x := np.linspace(0, 1, 50)) ** 3 * (10 - 15 * x + 6 * x**2)


def test_a_primitive_of_parts_is_forgotten_as_such_and_its_transitions_with_it():
    rng = np.random.default_rng(1)
    frames, n_cut = [], 3  # by then no primitive is provisional
    for k in range(14):
        frames += [arc([0.3] if k < n_cut else [], rng), walk(POSTURES, [1, *range(2, 9), 0], k)]
    mine, unaided = learner(), learner(drop_fragments=False)
    events = [each.learn_many(np.concatenate(frames)) for each in (mine, unaided)]
    gone = [event for event in events[0] if isinstance(event, PrimitiveForgotten)]
    assert gone and all(event.part for event in gone)
    assert not [event for event in events[1] if isinstance(event, PrimitiveForgotten)]
    assert len(unaided.tree.leaves) == len(mine.tree.leaves) + len(gone)
    assert set(mine.graph.ids) == set(mine.tree.leaves)


def test_what_came_nearest_to_a_primitive_is_told():
    mine = learner(min_exemplars=4)
    mine.learn_many(walk(POSTURES, [0, 1, 2, 0, 1, 2, 0]))
    mine.end_stream()
    assert not mine.tree.leaves
    found = mine.tree.most_repeated()
    assert found.times == 2 and found.apart < 1 and found.n_unplaced >= 5
    once = learner()
    once.learn_many(walk(POSTURES, range(7)))
    once.end_stream()
    alone = once.tree.most_repeated()
    assert alone.times == 1 and alone.apart > 1
    assert learner().tree.most_repeated() == (0, 0, np.inf)

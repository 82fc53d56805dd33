"""Learners that have seen several people, merged: bodies say who is who."""

from collections import Counter

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner, Recording
from mplearn.demonstrator import Person, demonstrate
from mplearn.errors import InvalidValueError
from mplearn.evaluation.streams import join_people
from mplearn.learner import PersonChanged, Recognised, SegmentClosed
from mplearn.merging import merge_learners as merge

SCRIPT = ("BAR", "BAL") * 6
SIZES = {"small": 1.58, "middle": 1.70, "tall": 1.84}


def performed(name: str, seed: int) -> Recording:
    return demonstrate(SCRIPT, seed=seed, person=Person(name, SIZES[name])).recording


def learned(*sessions: Recording) -> MotionLearner:
    stream = join_people(sessions, np.random.default_rng(0), interleaved=True)
    learner = MotionLearner(LearnerConfig(stream.channels, stream.rate_hz))
    for _ in learner.learn_recording(stream):
        pass
    return learner


@pytest.fixture(scope="module")
def shards() -> tuple[MotionLearner, MotionLearner]:
    """The tall one is in both, before other cameras and with another number."""
    one = learned(performed("small", 1), performed("tall", 2))
    return one, learned(performed("tall", 3), performed("middle", 4))


@pytest.fixture(scope="module")
def merged(shards) -> MotionLearner:
    return merge(shards)


def counts(learner: MotionLearner) -> Counter[tuple[int, int, int]]:
    """How often which motion followed which; of two ones it does not matter which is which."""
    first, second = learner.graph.ids
    count = learner.graph.count
    pairs = [(first, first, second), (second, second, first)]
    return Counter((count(a, b), count(b, c), count(c, a)) for a, b, c in pairs)


def test_who_is_in_both_is_one_person(shards, merged) -> None:
    one, two = shards
    assert len(one.tree.people) == len(two.tree.people) == 2
    assert len(merged.tree.people) == 3
    seen = sorted(merged.tree.of(person).n_seen for person in merged.tree.people)
    both = [tree.of(person).n_seen for tree in (one.tree, two.tree) for person in tree.people]
    assert sum(seen) == sum(both)
    assert max(seen) > 1.5 * max(both)


def test_each_motion_is_one_primitive_and_counts_add(shards, merged) -> None:
    one, two = shards
    assert len(merged.tree.leaves) == len(one.tree.leaves) == 2
    assert merged.tree.leaves == one.tree.leaves
    for id in merged.tree.leaves:
        assert len(merged.tree.node(id).children) >= 2
    assert merged.graph.n_transitions >= one.graph.n_transitions + two.graph.n_transitions
    back = merge([two, one])
    assert counts(back) == counts(merged)
    assert back.graph.n_transitions == merged.graph.n_transitions
    assert back.n_frames == merged.n_frames == one.n_frames + two.n_frames
    assert len(merged.snapshot()) == 2


def test_a_merged_learner_knows_everybody_and_goes_on(merged) -> None:
    resumed = MotionLearner.from_state(merged.state())
    stream = join_people(
        [performed("middle", 5), performed("tall", 6)], np.random.default_rng(1), interleaved=False
    )
    events = [event for each in resumed.learn_recording(stream) for event in each]
    again = MotionLearner.from_state(merged.state())
    assert [event for each in again.learn_recording(stream) for event in each] == events
    assert not any(event.new for event in events if isinstance(event, PersonChanged))
    assert len(resumed.tree.people) == 3
    moving = [e for e in events if isinstance(e, SegmentClosed) and e.placement]
    assert sum(isinstance(e, Recognised) for e in events) >= 0.8 * len(moving)
    assert resumed.tree.leaves == merged.tree.leaves


@pytest.fixture(scope="module")
def alone() -> dict[str, MotionLearner]:
    """Learners that have seen one person each; two are the same one."""
    seen = {"tall": ("tall", 2), "tall again": ("tall", 3), "small": ("small", 1)}
    return {key: learned(performed(*who).sliced(0, 700)) for key, who in seen.items()}


@pytest.mark.parametrize(
    ("who", "names", "expected"),
    [
        (("tall", "tall again"), (), 1),
        (("tall", "tall again"), ("ann", "ben"), 2),
        (("tall", "tall again"), ("ann", ""), 1),
        (("tall", "small"), (), 2),
        (("tall", "small"), ("ann", "ann"), 1),
        (("tall", "small", "tall again"), ("ann", "ben", "ben"), 2),
    ],
)
def test_people_are_who_they_are_told_to_be_whatever_their_bodies(
    alone, who, names, expected
) -> None:
    merged = merge([alone[each] for each in who], names)
    assert len(merged.tree.people) == merged.watching.n_people == expected
    assert sum(merged.tree.of(person).n_seen for person in merged.tree.people) == sum(
        alone[each].tree.n_seen for each in who
    )
    assert MotionLearner.from_state(merged.state()).tree.people == merged.tree.people


def test_as_many_names_as_learners_are_needed(alone) -> None:
    with pytest.raises(InvalidValueError, match="each of 2 learners"):
        merge([alone["tall"], alone["small"]], ["ann"])
    with pytest.raises(InvalidValueError, match="not 'ab'"):
        merge([alone["tall"], alone["small"]], "ab")

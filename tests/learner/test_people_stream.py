"""Several people in one stream of markers: nobody is announced."""

from itertools import pairwise

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner, Recording
from mplearn.demonstrator import Person, demonstrate
from mplearn.evaluation.experiments.people import learn_stream, people_table
from mplearn.evaluation.streams import join_people
from mplearn.learner import PersonChanged, PrimitiveBorn, SegmentClosed, TransitionSeen

SCRIPT = ("BAR", "BAL") * 7


@pytest.fixture(scope="module")
def sessions() -> list[Recording]:
    people = (Person("small", 1.58), Person("tall", 1.84))
    return [demonstrate(SCRIPT, seed=i, person=p).recording for i, p in enumerate(people)]


@pytest.fixture(scope="module")
def mixed(sessions) -> Recording:
    return join_people(sessions, np.random.default_rng(2), interleaved=True)


def changes_of(stream: Recording) -> list[tuple[int, int]]:
    """Last motion's end and next one's start, where the person changes between them."""
    pairs = pairwise(stream.labels)
    return [(a.end, b.start) for a, b in pairs if a.person != b.person]


@pytest.fixture(scope="module")
def learned(mixed):
    learner = MotionLearner(LearnerConfig(mixed.channels, mixed.rate_hz))
    return learner, [event for each in learner.learn_recording(mixed) for event in each]


def test_every_change_of_person_is_noticed(mixed, learned) -> None:
    learner, events = learned
    changes = [event for event in events if isinstance(event, PersonChanged)]
    truth = changes_of(mixed)
    assert len(changes) == len(truth) >= 4
    for change, (end, start) in zip(changes, truth, strict=True):
        assert end - 5 <= change.frame <= start + 5
    assert [change.new for change in changes] == [True] + [False] * (len(changes) - 1)
    assert {change.person for change in changes} == {0, 1}
    assert learner.n_frames == len(mixed)


def test_two_people_share_one_primitive_a_motion(learned) -> None:
    learner, events = learned
    assert learner.tree.people == (0, 1)
    assert len(learner.tree.leaves) == 2
    for id in learner.tree.leaves:
        assert len(learner.tree.node(id).children) == 2
    born = {event.primitive for event in events if isinstance(event, PrimitiveBorn)}
    assert set(learner.tree.leaves) <= born
    library = learner.snapshot()
    assert len(library) == 2
    assert {node.parent for node in library.tree} >= set(library.ids)
    walk = library.generate(list(library.ids))
    assert np.isfinite(walk.frames).all()


def test_segments_and_transitions_end_where_the_person_changes(mixed, learned) -> None:
    _, events = learned
    changes = {event.frame for event in events if isinstance(event, PersonChanged)}
    closed = [event.segment for event in events if isinstance(event, SegmentClosed)]
    assert all(a.end == b.start for a, b in pairwise(closed))
    assert not any(s.start < frame < s.end for s in closed for frame in changes)
    seen = [event for event in events if isinstance(event, TransitionSeen)]
    starts = {segment.start for segment in closed}
    assert changes <= starts
    assert not changes & {event.segment.start for event in seen}


def test_a_learner_saved_while_people_change_goes_on_bit_for_bit(mixed) -> None:
    at = changes_of(mixed)[0][0] + 3
    learner = MotionLearner(LearnerConfig(mixed.channels, mixed.rate_hz))
    learner.learn_many(mixed.frames[:at])
    resumed = MotionLearner.from_state(learner.state())
    rest = mixed.frames[at : at + 500]
    assert repr(resumed.learn_many(rest)) == repr(learner.learn_many(rest))
    assert resumed.state() == learner.state()


def test_the_experiment_rates_a_stream(mixed) -> None:
    outcome = learn_stream(mixed, interleaved=True)
    assert outcome.people == tuple(dict.fromkeys(label.person for label in mixed.labels))
    assert outcome.identified == 1.0
    assert outcome.learning.rates.n_classes == 2
    table = people_table([outcome, outcome])
    assert "100.0 %" in table.to_markdown()
    assert len(table.rows) == 4


@pytest.mark.parametrize("interleaved", [False, True])
def test_a_stream_holds_every_motion_once_in_its_persons_order(sessions, interleaved) -> None:
    stream = join_people(sessions, np.random.default_rng(0), interleaved=interleaved)
    assert len(stream) == sum(map(len, sessions))
    for session in sessions:
        own = [label.label for label in stream.labels if label.person == session.person]
        assert own == [label.label for label in session.labels]
    assert len(changes_of(stream)) == 1 if not interleaved else len(changes_of(stream)) > 3
    again = join_people(sessions, np.random.default_rng(0), interleaved=interleaved)
    assert np.array_equal(stream.frames, again.frames, equal_nan=True)


def test_people_of_one_size_are_taken_for_one_and_nothing_is_mixed_up() -> None:
    people = (
        Person("brisk", tempo={"BAR": 0.9, "BAL": 0.9}, joint_reach={"elbow_l": 1.05}),
        Person("calm", tempo={"BAR": 1.1, "BAL": 1.1}, joint_reach={"shoulder_pitch_r": 0.95}),
    )
    own = [demonstrate(SCRIPT, seed=i, person=p).recording for i, p in enumerate(people)]
    stream = join_people(own, np.random.default_rng(3), interleaved=True)
    outcome = learn_stream(stream, interleaved=True)
    learner, rates = outcome.learning.learner, outcome.learning.rates
    assert learner.tree.people == (0,)
    assert sorted(rates.classes.values()) == ["BAL", "BAR"]
    assert rates.n_wrong == 0
    assert rates.n_inside >= 0.9 * rates.n_motions

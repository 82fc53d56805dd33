"""One learner of streams that have different markers: an observer for each, the same primitives."""

from dataclasses import replace

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner, Recording
from mplearn.body import human_body, marker_set
from mplearn.demonstrator import Demonstration, demonstrate
from mplearn.errors import BodyError, FrameError
from mplearn.learner import LearnerState, PersonChanged
from mplearn.merging import merge_learners
from mplearn.recording import marker_channels
from mplearn.state import checkpoint, resumed

SCRIPT = ("BAR", "BAL", "SQD", "SQR") * 8
RATE_HZ = 25.0


def by_landmarks(shown: Demonstration) -> Recording:
    """The same motions, by the places that skeletons are recognised by."""
    tree, places = human_body().tree, marker_set("landmarks")
    attached = places.attach(tree)
    at = [tree.points(posture, *attached) for posture in shown.posture.frames]
    frames = np.array(at).reshape(len(at), -1)
    return replace(shown.recording, frames=frames, channels=marker_channels(places.names))


@pytest.fixture(scope="module")
def shown() -> tuple[Recording, Recording]:
    shown = demonstrate(SCRIPT, seed=2, rate_hz=RATE_HZ)
    return shown.recording, by_landmarks(shown)


def learn(learner: MotionLearner, recording: Recording) -> list[str]:
    return [repr(event) for each in learner.learn_recording(recording, 50) for event in each]


def learned(*recordings: Recording) -> MotionLearner:
    learner = MotionLearner(LearnerConfig(recordings[0].channels, RATE_HZ))
    for recording in recordings:
        learn(learner, recording)
    return learner


def primitives(learner: MotionLearner, start: int, end: int) -> list[tuple[int, int, int | None]]:
    """Segments of a stretch of frames, from its start, and what they are known as in the end."""
    links = [seen for block in learner.chain.state().segments for seen in block.segments()]
    return [
        (link.segment.start - start, link.segment.end - start, link.primitive)
        for link in links
        if start <= link.segment.start and link.segment.end <= end
    ]


@pytest.mark.parametrize("first", [0, 1])
def test_motions_seen_both_ways_are_the_same_primitives(shown, first):
    learner = learned(shown[first])
    assert len(learner.tree.leaves) == 4
    middle = learner.n_frames
    learn(learner, shown[1 - first])
    assert len(learner.tree.leaves) == 4
    assert len(learner.watching.watches) == len(learner.tree.people) == 2
    before, after = primitives(learner, 0, middle), primitives(learner, middle, learner.n_frames)
    pairs = [
        (one, two)
        for start, end, one in before
        for begin, stop, two in after
        if min(end, stop) - max(start, begin) > 0.7 * max(end - start, stop - begin)
    ]
    assert len(pairs) > 0.9 * len(SCRIPT)
    assert sum(one == two is not None for one, two in pairs) >= 0.98 * len(pairs)


def test_who_comes_back_by_the_same_markers_is_the_same_person(shown):
    learner = learned(shown[0].sliced(0, 400), shown[1].sliced(0, 400))
    learner.begin_stream(shown[0].channels)
    events = learner.learn_many(shown[0].frames[400:800])
    assert [e.new for e in events if isinstance(e, PersonChanged)] == [False]
    assert (learner.person, len(learner.watching.watches)) == (0, 2)


def test_markers_in_another_order_or_fewer_are_the_same_set(shown):
    recording = shown[0]
    order = np.random.default_rng(0).permutation(len(recording.marker_names))
    markers = recording.markers[:, order]
    shuffled = replace(
        recording,
        frames=markers.reshape(len(markers), -1),
        channels=marker_channels(tuple(recording.marker_names[k] for k in order)),
    )
    lacking = replace(
        shuffled,
        frames=shuffled.frames[:, 6:],
        channels=tuple(map(str.lower, shuffled.channels[6:])),
    )
    learner = learned(recording, lacking)
    twin, other = (MotionLearner.from_state(learned(recording).state()) for _ in range(2))
    assert learn(twin, recording) == learn(other, shuffled)
    assert len(learner.watching.watches) == len(learner.tree.people) == 1


def test_what_is_no_body_is_refused_and_changes_nothing(shown):
    learner = learned(shown[0].sliced(0, 300))
    learner.learn_many(shown[0].frames[:50])
    before = repr(learner.state())
    with pytest.raises(BodyError, match="no marker set knows"):
        learner.begin_stream(marker_channels(("A", "B")))
    with pytest.raises(FrameError, match="observes a body"):
        learner.begin_stream(("angle",))
    assert repr(learner.state()) == before
    plain = MotionLearner(LearnerConfig(("a", "b")))
    with pytest.raises(FrameError, match="made for 2"):
        plain.begin_stream(("a", "c"))


def test_a_learner_of_several_sets_is_kept_and_goes_on_bit_for_bit(shown, tmp_path):
    learner = learned(shown[0].sliced(0, 600))
    learner.begin_stream(shown[1].channels)
    learner.learn_many(shown[1].frames[:333])
    kept = checkpoint(learner.state(), {})
    again = resumed(LearnerState, kept.document, kept.new.__getitem__)
    twins = [
        MotionLearner.load(learner.save(tmp_path / "learner.mplearn")),
        MotionLearner.from_state(again),
    ]
    after = [repr(learner.learn_many(shown[1].frames[333:700])), *learn(learner, shown[0])]
    for twin in twins:
        assert [repr(twin.learn_many(shown[1].frames[333:700])), *learn(twin, shown[0])] == after
    assert repr(learner.state()) == repr(twins[0].state())


def test_learners_of_different_sets_are_merged(shown):
    one, two = learned(shown[0]), learned(shown[1])
    merged = merge_learners([one, two, one])
    assert len(merged.tree.leaves) == 4
    assert merged.watching.n_people == len(merged.tree.people) == 2
    assert [len(watch.people) for watch in merged.watching.watches] == [1, 1]
    assert merged.n_frames == 2 * one.n_frames + two.n_frames
    events = learn(merged, shown[1])
    assert sum("Recognised" in event for event in events) > 0.9 * len(SCRIPT)
    assert merged.watching.n_people == 2

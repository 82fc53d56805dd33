"""Bad input: named, or a stated degradation, and never a poisoned model."""

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner, Recording
from mplearn.demonstrator import Demonstration
from mplearn.errors import FrameError
from mplearn.learner import PersonChanged, SegmentClosed


def knowledge(learner: MotionLearner) -> tuple[object, object]:
    """All that was learned, the streams' own state left aside."""
    return learner.tree.state(), learner.graph.state()


def learner_for(recording: Recording) -> MotionLearner:
    return MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))


POISONS = {
    "NaN in a channel": lambda frame: np.where(np.arange(len(frame)) == 3, np.nan, frame),
    "NaN in all": lambda frame: np.full(len(frame), np.nan),
    "infinity": lambda frame: np.where(np.arange(len(frame)) == 0, np.inf, frame),
    "a narrow frame": lambda frame: frame[:-1],
    "text": lambda frame: ["x"] * len(frame),
}


@pytest.mark.parametrize("poison", POISONS.values(), ids=POISONS)
def test_features_that_are_refused_leave_no_trace(features: Recording, poison) -> None:
    part = features.frames[:1500]
    clean, poisoned = learner_for(features), learner_for(features)
    clean.learn_many(part)
    for t, frame in enumerate(part):
        if 600 <= t < 640:
            with pytest.raises(FrameError):
                poisoned.learn_one(poison(frame))
        poisoned.learn_one(frame)
    assert poisoned.state() == clean.state()


def test_a_clock_that_jumps_or_runs_double_is_refused(features: Recording) -> None:
    clean, poisoned = learner_for(features), learner_for(features)
    for t, frame in enumerate(features.frames[:900]):
        clean.learn_one(frame, t / 100)
        if t and t % 100 == 0:
            for wrong in ((t + 60) / 100, (t - 0.6) / 100, (t - 1) / 100):
                with pytest.raises(FrameError, match="apart"):
                    poisoned.learn_one(frame, wrong)
        poisoned.learn_one(frame, t / 100)
    assert poisoned.state() == clean.state()


@pytest.fixture(scope="module")
def start(four: Demonstration) -> Recording:
    return four.recording.sliced(0, 2600)


@pytest.fixture(scope="module")
def learned(start: Recording) -> MotionLearner:
    """A learner that has seen the first 1,600 frames of markers as a stream."""
    learner = learner_for(start)
    learner.learn_many(start.frames[:1600])
    learner.end_stream()
    return learner


STREAMS = {
    "nothing in sight for a minute": lambda frames: np.full((6000, frames.shape[1]), np.nan),
    "one frame": lambda frames: frames[:1],
    "a statue": lambda frames: np.repeat(frames[:1], 4000, axis=0),
    "one marker": lambda frames: np.where(np.arange(frames.shape[1]) < 3, frames[:300], np.nan),
}


@pytest.mark.parametrize("stream", STREAMS.values(), ids=STREAMS)
def test_a_stream_without_motion_teaches_nothing(learned, start, stream) -> None:
    learner = MotionLearner.from_state(learned.state())
    before = knowledge(learner)
    for frame in stream(start.frames):
        try:
            learner.learn_one(frame)
        except Exception as error:  # named, and the stream goes on
            assert type(error).__module__.startswith("mplearn."), error
    learner.end_stream()
    assert knowledge(learner) == before
    # and what comes next is learned as if nothing had been
    plain = MotionLearner.from_state(learned.state())
    for each in (learner, plain):
        each.learn_many(start.frames[1600:])
        each.end_stream()
    assert knowledge(learner) == knowledge(plain)


def test_a_person_out_of_sight_for_a_minute_is_the_same_person(learned, start) -> None:
    learner = MotionLearner.from_state(learned.state())
    frames = start.frames[1600:2200].copy()
    gone = np.full((6000, frames.shape[1]), np.nan)
    events = learner.learn_many(np.concatenate((frames[:300], gone, frames[300:])))
    events += learner.end_stream()
    assert not any(isinstance(event, PersonChanged) for event in events)
    assert learner.tree.people == (0,)
    closed = [event for event in events if isinstance(event, SegmentClosed)]
    assert closed[-1].segment.end == learner.n_frames


def test_a_marker_that_is_never_seen_changes_little(learned, start) -> None:
    channel = start.channels.index("LFIN.x") if "LFIN.x" in start.channels else 0
    frames = start.frames.copy()
    frames[:, channel : channel + 3] = np.nan
    learner = learner_for(start)
    learner.learn_many(frames[:1600])
    learner.end_stream()
    assert learner.tree.n_seen == pytest.approx(learned.tree.n_seen, abs=1)


def test_a_constant_channel_takes_nothing_away(features: Recording) -> None:
    part = features.frames[:2500]
    wide = Recording(
        np.column_stack((part, np.full(len(part), 0.3))), 100.0, (*features.channels, "dead")
    )
    narrow = Recording(part, 100.0, tuple(f"angle_{i}" for i in range(part.shape[1])))
    found = []
    for recording in (wide, narrow):
        learner = learner_for(recording)
        learner.learn_many(recording.frames)
        learner.end_stream()
        found.append(learner.tree.n_seen)
    assert found[0] == found[1]


def test_a_million_equal_frames_cost_no_memory_and_teach_nothing() -> None:
    learner = MotionLearner(LearnerConfig(("a", "b")))
    frame = np.array([0.4, -0.1])
    for _ in range(60_000):  # the state is periodic: the rest is the same again
        learner.learn_one(frame)
    size = len(repr(learner.state()))
    for _ in range(20_000):
        learner.learn_one(frame)
    assert len(repr(learner.state())) <= size + 64
    assert learner.tree.n_seen == 0

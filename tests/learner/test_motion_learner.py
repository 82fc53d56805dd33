import hashlib
import json
import subprocess
import sys
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn import LearnerConfig, MotionLearner, PrimitiveLibrary, Recording
from mplearn.demonstrator import Demonstration
from mplearn.errors import FrameError, InvalidValueError
from mplearn.learner import (
    Event,
    PrimitiveBorn,
    Recognised,
    SegmentClosed,
    TransitionSeen,
    plain_event,
)
from mplearn.recording import Segment, marker_channels
from mplearn.state import checkpoint
from mplearn.tree import TreeConfig


def learner_for(recording: Recording, **options: object) -> MotionLearner:
    return MotionLearner(LearnerConfig(recording.channels, recording.rate_hz, **options))


def learn(recording: Recording, **options: object) -> tuple[MotionLearner, list[Event]]:
    learner = learner_for(recording, **options)
    return learner, [event for events in learner.learn_recording(recording) for event in events]


@pytest.fixture(scope="module")
def learned(four: Demonstration) -> tuple[MotionLearner, list[Event]]:
    return learn(four.recording)


def truth_of(segment: Segment, four: Demonstration) -> str:
    def shared(label) -> int:
        return min(label.end, segment.end) - max(label.start, segment.start)

    return max(four.truth, key=shared).label


def test_four_primitives_and_their_order_are_learned_from_markers(
    learned: tuple[MotionLearner, list[Event]], four: Demonstration
) -> None:
    learner, events = learned
    assert len(learner.tree.leaves) == 4
    meaning = {}
    for leaf in learner.tree.leaves:
        said = Counter(
            truth_of(event.segment, four)
            for event in events
            if isinstance(event, Recognised) and event.primitive == leaf
        )
        assert len(said) == 1, said
        meaning[leaf] = next(iter(said))
    assert sorted(meaning.values()) == ["BAD", "BAL", "BAR", "BAU"]
    names = {name: leaf for leaf, name in meaning.items()}
    graph = learner.graph.to_networkx()
    assert list(graph.successors(names["BAD"])) == [names["BAU"]]  # always
    assert list(graph.successors(names["BAR"])) == [names["BAL"]]
    assert set(graph.successors(names["BAU"])) == {names["BAR"], names["BAD"]}


def test_the_past_of_a_new_primitive_counts(
    learned: tuple[MotionLearner, list[Event]],
) -> None:
    learner, events = learned
    seen = [event for event in events if isinstance(event, TransitionSeen)]
    assert learner.graph.n_transitions == len(seen)
    assert len({event.segment.start for event in seen}) == len(seen)  # none twice
    born = {e.primitive: e.segment.start for e in events if isinstance(e, PrimitiveBorn)}
    early = [event for event in seen if event.segment.start < born[event.primitive]]
    assert (
        len(early) >= len(born) - 1
    )  # one demonstration of each was before, none before the first
    # as many as there are neighbours that are known by now
    segments = learner.chain._segments
    known = [seen.primitive is not None for seen in segments]
    assert len(seen) == sum(
        a and b and seen.follows for a, b, seen in zip(known, known[1:], segments[1:], strict=False)
    )


def test_segments_tile_the_stream(
    learned: tuple[MotionLearner, list[Event]], four: Demonstration
) -> None:
    closed = [event.segment for event in learned[1] if isinstance(event, SegmentClosed)]
    assert closed[0].start == 0
    assert closed[-1].end == len(four.recording)
    assert all(a.end == b.start for a, b in pairwise(closed))


def test_nothing_looks_ahead(features: Recording, four: Demonstration) -> None:
    whole, first = learner_for(features), learner_for(features)
    at = len(features) // 2
    first_events = first.learn_many(features.frames[:at])
    whole_events = [whole.learn_one(frame) for frame in features.frames]
    assert first_events == [event for events in whole_events[:at] for event in events]


def test_learn_many_is_the_loop(features: Recording) -> None:
    one, many = learner_for(features), learner_for(features)
    events = [event for frame in features.frames for event in one.learn_one(frame)]
    assert many.learn_many(features.frames) == events
    assert many.snapshot().version == one.snapshot().version


@settings(max_examples=4, deadline=None)
@given(share=st.floats(0.01, 0.99), markers=st.booleans())
def test_a_saved_learner_goes_on_bit_for_bit(
    four: Demonstration, features: Recording, share: float, markers: bool
) -> None:
    recording = four.recording.sliced(0, 1500) if markers else features
    learner = learner_for(recording)
    at = round(share * len(recording))
    learner.learn_many(recording.frames[:at])
    resumed = MotionLearner.from_state(learner.state())
    rest = recording.frames[at:]
    assert resumed.learn_many(rest) == learner.learn_many(rest)
    assert resumed.end_stream() == learner.end_stream()
    assert resumed.snapshot().version == learner.snapshot().version


def test_looking_changes_nothing(features: Recording) -> None:
    plain, looked = learner_for(features), learner_for(features)
    half = len(features) // 2
    plain.learn_many(features.frames[:half])
    looked.learn_many(features.frames[:half])
    library = looked.snapshot()
    library.recognise(features.frames[100:220])
    library.predict_next([library.ids[0]])
    library.generate([library.ids[0]])
    assert looked.learn_many(features.frames[half:]) == plain.learn_many(features.frames[half:])
    assert looked.snapshot().version == plain.snapshot().version


def test_the_library_recognises_what_the_learner_did(
    features: Recording, four: Demonstration
) -> None:
    learner, events = learn(features)
    library = learner.snapshot()
    last = [event for event in events if isinstance(event, Recognised)][-8:]
    for event in last:
        part = features.frames[event.segment.start : event.segment.end]
        assert library.recognise(part).primitive == event.primitive


def test_a_stream_of_another_person_is_a_stream_of_its_own(features: Recording) -> None:
    learner = learner_for(features, tree=TreeConfig(min_exemplars=4))  # copies are no four
    list(learner.learn_recording(features))
    before = learner.graph.n_transitions, learner.n_frames
    events = [event for each in learner.learn_recording(features) for event in each]
    first = next(event for event in events if isinstance(event, TransitionSeen))
    closed = [event for event in events if isinstance(event, SegmentClosed)]
    assert closed[0].segment.start == before[1]
    assert first.segment.start > closed[0].segment.start  # no transition across the streams
    assert not any(isinstance(event, PrimitiveBorn) for event in events)
    assert learner.n_frames == 2 * len(features)


def test_the_same_in_a_new_process(features: Recording, tmp_path) -> None:
    np.save(tmp_path / "frames.npy", features.frames)
    script = f"""
import numpy as np
from mplearn import LearnerConfig, MotionLearner
frames = np.load({str(tmp_path / "frames.npy")!r})
learner = MotionLearner(LearnerConfig({features.channels!r}, {features.rate_hz}))
learner.learn_many(frames)
print(learner.snapshot().version)
"""
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    learner = learner_for(features)
    learner.learn_many(features.frames)
    assert done.stdout.strip() == learner.snapshot().version


def digest(learner: MotionLearner) -> str:
    return hashlib.sha256(checkpoint(learner.state()).document).hexdigest()


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        (np.zeros(5), r"\(33,\).*\(5,\)"),
        (np.full(33, np.nan), "base_height"),
        (np.full(33, np.inf), "inf"),
        (["a"] * 33, "numbers"),
        (np.zeros((33, 1)), r"\(33, 1\)"),
    ],
)
def test_a_bad_frame_is_refused_and_changes_nothing(
    features: Recording, frame: object, said: str
) -> None:
    learner = learner_for(features)
    learner.learn_many(features.frames[:300])
    before = digest(learner)
    with pytest.raises(FrameError, match=said):
        learner.learn_one(frame)
    assert digest(learner) == before


def test_the_clock_must_fit_the_rate(features: Recording) -> None:
    learner = learner_for(features)
    learner.learn_one(features.frames[0], time_s=7.0)
    learner.learn_one(features.frames[1], time_s=7.012)
    for wrong in (7.012, 7.0, 9.0, np.nan):
        with pytest.raises(FrameError, match=r"time_s|apart"):
            learner.learn_one(features.frames[2], time_s=wrong)
    learner.learn_one(features.frames[2], time_s=7.022)


def test_a_recording_at_another_rate_or_of_other_channels_is_refused(features: Recording) -> None:
    learner = learner_for(features)
    other = Recording(features.frames, 30.0, features.channels, "slow")
    with pytest.raises(FrameError, match=r"'slow' has 30 Hz.*rate_hz=100"):
        list(learner.learn_recording(other))
    other = Recording(features.frames[:, :3], 100.0, features.channels[:3], "narrow")
    with pytest.raises(FrameError, match=r"'narrow' has 3 channels"):
        list(learner.learn_recording(other))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"channels": ()}, "at least one channel"),
        ({"channels": ("a",), "rate_hz": 5.0}, "5.0"),
        ({"channels": ("a",), "observe": "dog"}, "dog"),
        ({"channels": ("a",), "segmenter": "by eye"}, r"one of \['kinematic.*not 'by eye'"),
        ({"channels": ("a",), "longest_pause_s": 0.0}, "longest_pause_s"),
    ],
)
def test_a_configuration_that_cannot_work_is_refused(options: dict, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        LearnerConfig(**options)


def test_an_unknown_segmenter_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="guess"):
        MotionLearner(LearnerConfig(("a", "b"), segmenter="guess"))


def test_markers_can_be_learned_as_they_are(four: Demonstration) -> None:
    part = four.recording.sliced(0, 1500)
    filled = np.where(np.isnan(part.frames), 0.0, part.frames)
    learner = learner_for(part, observe="markers")
    learner.learn_many(filled)
    assert learner.channels == part.channels
    assert learner.snapshot().body == ""


def test_other_channels_make_a_library_of_no_body() -> None:
    t = np.arange(6000) / 50.0
    frames = np.stack((np.sin(t), 0.5 * np.sin(t + 0.4)), axis=1)
    learner = MotionLearner(LearnerConfig(("shoulder", "elbow"), 50.0))
    learner.learn_many(frames)
    library = learner.snapshot()
    assert isinstance(library, PrimitiveLibrary)
    assert library.channels == ("shoulder", "elbow")
    assert len(library) == 2  # to and fro


def test_a_stream_that_ends_at_once_leaves_nothing(four: Demonstration) -> None:
    learner = learner_for(four.recording)
    assert learner.end_stream() == []
    learner.learn_one(four.recording.frames[0])
    assert all(isinstance(event, SegmentClosed) for event in learner.end_stream())
    assert learner.snapshot().ids == ()


def test_memory_stays_where_nothing_moves() -> None:
    learner = MotionLearner(LearnerConfig(marker_channels(("A",)), observe="markers"))
    frame = np.array([0.1, 0.2, 0.3])
    for _ in range(30_000):
        learner.learn_one(frame)
    assert len(learner._buffer) < 2000
    assert learner.tree.leaves == ()


def test_looking_changes_nothing_that_is_seen_later(four: Demonstration) -> None:
    frames = four.recording.frames[:2500]
    plain, watched = learner_for(four.recording), learner_for(four.recording)
    plain.learn_many(frames)
    for start in range(0, len(frames), 250):
        watched.learn_many(frames[start : start + 250])
        watched.snapshot()
    resumed = MotionLearner.from_state(watched.state())
    assert watched.snapshot().version == plain.snapshot().version
    assert resumed.snapshot().version == plain.snapshot().version


def test_every_event_is_plain_values_at_a_time(learned: tuple[MotionLearner, list[Event]]) -> None:
    learner, events = learned
    rate_hz = learner.config.rate_hz
    plain = [json.loads(json.dumps(plain_event(e, rate_hz), allow_nan=False)) for e in events]
    assert [each["event"] for each in plain] == [type(event).__name__ for event in events]
    assert all(0 < each["time_s"] <= learner.n_frames / rate_hz for each in plain)
    closed = next(each for each in plain if each["event"] == "SegmentClosed" and each["placement"])
    assert closed["placement"]["distance"] is None  # the first: nothing was known
    assert closed["segment"]["end"] == pytest.approx(closed["time_s"] * rate_hz)

"""Learn, disturb, learn on: a glitch costs a glitch, and what was lost is said."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mplearn import LearnerConfig, MotionLearner, Recording
from mplearn.demonstrator import Demonstration
from mplearn.errors import InvalidValueError
from mplearn.learner import (
    AxesChanged,
    Event,
    FramesLost,
    PersonChanged,
    PrimitiveBorn,
    Recognised,
)
from mplearn.learner.absurd import BRIEF_S, AbsurdFrames
from mplearn.learner.learner import ABSURD

KNOWN, AT = 4000, 300  # frames learned undisturbed; where it is disturbed after that


@pytest.fixture(scope="module")
def after(four: Demonstration) -> np.ndarray:
    return four.recording.frames[KNOWN:]


@pytest.fixture(scope="module")
def learned(four: Demonstration) -> MotionLearner:
    """A learner that knows the four motions, in the middle of its stream."""
    learner = MotionLearner(LearnerConfig(four.recording.channels, four.recording.rate_hz))
    learner.learn_many(four.recording.frames[:KNOWN])
    return learner


def go_on(learned: MotionLearner, frames: np.ndarray) -> list[Event]:
    learner = MotionLearner.from_state(learned.state())
    events = learner.learn_many(frames) + learner.end_stream()
    assert learner.n_frames == KNOWN + len(frames)
    return events


def recognised(events: list[Event]) -> list[tuple[int, int, int]]:
    return [
        (event.segment.start, event.segment.end, event.primitive)
        for event in events
        if isinstance(event, Recognised)
    ]


@pytest.fixture(scope="module")
def undisturbed(learned: MotionLearner, after: np.ndarray) -> list[tuple[int, int, int]]:
    found = recognised(go_on(learned, after))
    assert len(found) > 15
    return found


def share(events: list[Event], truth: list[tuple[int, int, int]], since: int) -> float:
    """Share of the motions that begin after a frame and are recognised as without disturbance."""
    found, rest = recognised(events), [each for each in truth if each[0] > KNOWN + since]
    same = [
        any(id == p and min(b, e) - max(a, s) > 0.7 * (b - a) for s, e, p in found)
        for a, b, id in rest
    ]
    return float(np.mean(same))


def lost(events: list[Event]) -> list[tuple[int, int]]:
    return [(e.start - KNOWN, e.end - KNOWN) for e in events if isinstance(e, FramesLost)]


Change = Callable[[np.ndarray], np.ndarray]


def noise(sigma_m: float) -> Change:
    return lambda x: x + np.random.default_rng(1).normal(0, sigma_m, x.shape)


IMPOSSIBLE: dict[str, Change] = {
    "zeros": lambda x: 0.0 * x,
    "millimetres": lambda x: 1000.0 * x,
    "a point far away": lambda x: 0.0 * x + 1e6,
    "far away": lambda x: x + 1e6,
    "a million times as large": lambda x: 1e6 * x,
    "noise of 20 cm": noise(0.2),
    "noise of 5 cm": noise(0.05),
    "1.3 times as large": lambda x: 1.3 * x,
    "0.8 times as large": lambda x: 0.8 * x,
    "names in reverse": lambda x: x.reshape(len(x), -1, 3)[:, ::-1].reshape(x.shape),
    "beyond all numbers": lambda x: np.where(np.arange(x.shape[1]) % 2, 1e300, -np.inf),
}


@pytest.mark.parametrize("n", [1, 4])
@pytest.mark.parametrize("change", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_a_glitch_costs_a_glitch(learned, after, undisturbed, change: Change, n: int) -> None:
    frames = after[: None if change is IMPOSSIBLE["1.3 times as large"] else 1300].copy()
    frames[AT : AT + n] = change(frames[AT : AT + n])
    events = go_on(learned, frames)
    assert not any(
        isinstance(event, PersonChanged | AxesChanged | PrimitiveBorn) for event in events
    )
    assert lost(events) == [(AT, AT + n)]
    seen = [each for each in undisturbed if each[1] < KNOWN + len(frames) - 50]
    assert share(events, seen, AT) == 1.0


@pytest.mark.parametrize("change", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_seconds_of_it_cost_those_seconds(learned, after, undisturbed, change: Change) -> None:
    frames = after[:1500].copy()
    frames[AT : AT + 110] = change(frames[AT : AT + 110])
    events = go_on(learned, frames)
    assert not any(isinstance(event, PersonChanged | PrimitiveBorn) for event in events)
    said = lost(events)
    if said:  # where the axes or the unit changed to and fro, nothing is lost
        assert sum(end - start for start, end in said) < 110 + 200
    else:
        assert sum(isinstance(event, AxesChanged) for event in events) == 2
    seen = [each for each in undisturbed if each[1] < KNOWN + len(frames) - 50]
    assert share(events, seen, AT + 110) == 1.0


def turned(x: np.ndarray) -> np.ndarray:
    c, s = np.cos(1.0), np.sin(1.0)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return (x.reshape(len(x), -1, 3) @ turn + (1.5, -0.7, 0.3)).reshape(x.shape)


@pytest.mark.parametrize(
    ("change", "size"), [(turned, 1.0), (lambda x: 1000.0 * x, 1000.0)], ids=["axes", "unit"]
)
def test_axes_and_unit_may_change_in_the_middle(learned, after, undisturbed, change, size) -> None:
    frames = after[:1500].copy()
    frames[AT:] = change(frames[AT:])
    events = go_on(learned, frames)
    moved = [event for event in events if isinstance(event, AxesChanged)]
    assert [event.frame - KNOWN for event in moved] == [AT]
    assert moved[0].size == pytest.approx(size, rel=0.01)
    assert lost(events) == []
    seen = [each for each in undisturbed if each[1] < KNOWN + len(frames) - 50]
    assert share(events, seen, 0) == 1.0


@pytest.mark.parametrize("name", ["LFHD", "LELB", "RWRA", "LTOE"])
def test_a_lost_marker_is_bridged_by_the_body(learned, four, after, undisturbed, name) -> None:
    frames = after[:2000].copy()
    channel = four.recording.channels.index(f"{name}.x")
    frames[AT : AT + 1600, channel : channel + 3] = np.nan
    events = go_on(learned, frames)
    assert not any(isinstance(e, PersonChanged | FramesLost | PrimitiveBorn) for e in events)
    seen = [each for each in undisturbed if each[1] < KNOWN + len(frames) - 50]
    assert share(events, seen, 0) == 1.0


@pytest.mark.parametrize("names", [("LELB", "RELB"), ("LTOE", "LELB"), ("LFHD", "RFHD")])
def test_swapped_markers_cost_little(learned, four, after, undisturbed, names) -> None:
    frames = after[:1500].copy()
    one, other = (four.recording.channels.index(f"{name}.x") for name in names)
    for axis in range(3):
        pair = [one + axis, other + axis]
        frames[AT : AT + 100, pair] = frames[AT : AT + 100, pair[::-1]]
    events = go_on(learned, frames)
    assert not any(isinstance(e, PersonChanged | FramesLost | PrimitiveBorn) for e in events)
    seen = [each for each in undisturbed if each[1] < KNOWN + len(frames) - 50]
    assert share(events, seen, 0) == 1.0


@pytest.mark.parametrize("change", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_a_bad_start_is_left_out(four: Demonstration, change: Change) -> None:
    clean, bad = four.recording.frames[:800], four.recording.frames[:800].copy()
    bad[10:25] = change(bad[10:25])
    segments = []
    for frames in (clean, bad):
        learner = MotionLearner(LearnerConfig(four.recording.channels))
        events = learner.learn_many(frames) + learner.end_stream()
        assert learner.tree.people == (0,)
        segments.append(learner.tree.n_seen)
    assert lost(events) == [(10 - KNOWN, 25 - KNOWN)]
    assert segments[0] == segments[1]


def test_a_stream_that_is_nobodys_is_said_to_be_lost(four: Demonstration) -> None:
    learner = MotionLearner(LearnerConfig(four.recording.channels))
    events = learner.learn_many(1000.0 * four.recording.frames[:700]) + learner.end_stream()
    assert [type(event) for event in events] == [FramesLost]
    assert (events[0].start, events[0].end) == (0, 700)
    assert "millimetres" in events[0].reason
    assert learner.tree.n_seen == 0


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300, -1e9])
def test_absurd_values_of_plain_channels_are_held_and_said(features: Recording, value) -> None:
    part = features.frames[:2500]
    wrong = part.copy()
    wrong[700, 3] = wrong[1200:1203, 5] = value
    clean, poisoned = (MotionLearner(LearnerConfig(features.channels)) for _ in range(2))
    before = clean.learn_many(part) + clean.end_stream()
    events = poisoned.learn_many(wrong) + poisoned.end_stream()
    said = [(e.start, e.end) for e in events if isinstance(e, FramesLost)]
    assert said == [(700, 701), (1200, 1203)]
    assert len(recognised(events)) == len(recognised(before))
    assert poisoned.n_frames == clean.n_frames == 2500


@pytest.mark.parametrize("at", [0, 3, 700])
@pytest.mark.parametrize("long", [1, 5])
def test_a_glitch_of_plain_channels_costs_what_it_hides(
    features: Recording, at: int, long: int
) -> None:
    long = long if at else 1
    part = features.frames[:2500]
    wrong = part.copy()
    wrong[at : at + long] *= 1000.0
    clean, one, many = (MotionLearner(LearnerConfig(features.channels)) for _ in range(3))
    before = clean.learn_many(part) + clean.end_stream()
    first = [event for frame in wrong for event in one.learn_one(frame)]
    assert many.learn_many(wrong) == first
    assert many.state() == one.state()
    events = first + one.end_stream()
    said = [(e.start, e.end, e.reason) for e in events if isinstance(e, FramesLost)]
    assert said == [(at, at + long, ABSURD)]
    assert len(recognised(events)) >= len(recognised(before))
    assert len(one.tree.leaves) == len(clean.tree.leaves)


def test_a_first_frame_is_judged_by_the_second_also_over_a_save(features: Recording) -> None:
    wrong = features.frames[:600].copy()
    wrong[0] = 1e6
    one = MotionLearner(LearnerConfig(features.channels))
    assert one.learn_one(wrong[0]) == []
    resumed = MotionLearner.from_state(one.state())
    assert one.learn_many(wrong[1:]) == resumed.learn_many(wrong[1:])
    assert one.state() == resumed.state()


@given(
    rate=st.sampled_from([20.0, 50.0, 200.0]),
    seed=st.integers(0, 10**6),
    n_channels=st.integers(1, 4),
)
def test_no_frame_of_smooth_motion_is_absurd_however_still_it_began(
    rate: float, seed: int, n_channels: int
) -> None:
    rng = np.random.default_rng(seed)
    still = rng.normal(0, 0.01, (int(rate), n_channels))
    t = np.arange(int(6 * rate)) / rate
    pulse = 0.5 - 0.5 * np.cos(2 * np.pi * rng.uniform(0.3, 1.0, n_channels) * t[:, None])
    frames = np.concatenate([still, pulse * rng.uniform(0.1, 2.0, n_channels)])
    frames += rng.normal(0, 0.001, frames.shape)
    absurd = AbsurdFrames(n_channels, rate)
    assert not absurd.hold(frames)[1][5:].any()


@pytest.mark.parametrize("rate", [20.0, 100.0])
def test_a_step_that_lasts_is_believed_after_a_moment(rate: float) -> None:
    t = np.arange(int(2 * rate)) / rate
    frames = np.sin(2 * np.pi * t)[:, None]
    moved = np.concatenate([frames, frames + 100.0])
    held, wrong = AbsurdFrames(1, rate).hold(moved)
    n = round(BRIEF_S * rate)
    assert np.flatnonzero(wrong).tolist() == list(range(len(t), len(t) + n))
    assert np.array_equal(held[~wrong], moved[~wrong])
    assert (held[wrong] == frames[-1]).all()


def test_a_bad_second_of_plain_channels_ends_no_recording(features: Recording) -> None:
    frames = features.frames[:2500].copy()
    frames[1000:1100] = np.nan
    learner = MotionLearner(LearnerConfig(features.channels))
    events = [
        event
        for each in learner.learn_recording(Recording(frames, 100.0, features.channels))
        for event in each
    ]
    said = [event for event in events if isinstance(event, FramesLost)]
    assert len(said) == 1 and said[0].end == 1100 and said[0].start > 700
    assert learner.n_frames == 2500


def test_what_is_far_beyond_is_believed_where_it_lasts() -> None:
    learner = MotionLearner(LearnerConfig(("a", "b")))
    low, high = np.tile((0.1, 0.2), (300, 1)), np.tile((1e5, 0.2), (300, 1))
    events = learner.learn_many(np.concatenate((low, high))) + learner.end_stream()
    said = [(e.start, e.end) for e in events if isinstance(e, FramesLost)]
    assert len(said) == 1 and said[0][1] == 350


def test_many_frames_at_once_are_the_loop(four: Demonstration) -> None:
    frames = four.recording.frames[:1400].copy()
    for at, change in zip((20, 300, 500, 700), list(IMPOSSIBLE.values())[:4], strict=True):
        frames[at : at + 3] = change(frames[at : at + 3])
    frames[850:860] = np.nan
    frames[1000:] = turned(frames[1000:])
    one, many, odd = (MotionLearner(LearnerConfig(four.recording.channels)) for _ in range(3))
    events = [event for frame in frames for event in one.learn_one(frame)]
    assert many.learn_many(frames) == events
    assert odd.learn_many(frames[:707]) + odd.learn_many(frames[707:]) == events
    assert len([event for event in events if isinstance(event, FramesLost)]) >= 4
    rest = four.recording.frames[1400:1600]
    resumed = MotionLearner.from_state(many.state())
    assert resumed.learn_many(rest) == many.learn_many(rest) == one.learn_many(rest)
    digests = [each.snapshot().version for each in (one, many, odd)]
    assert digests[0] == digests[1]
    recording = Recording(frames, 100.0, four.recording.channels)
    alike = [MotionLearner(LearnerConfig(four.recording.channels)) for _ in range(2)]
    each, blocks = alike[0].learn_recording(recording), alike[1].learn_recording(recording, 50)
    assert [e for events in each for e in events] == [e for events in blocks for e in events]
    with pytest.raises(InvalidValueError, match="at_once"):
        next(alike[0].learn_recording(recording, 0))

"""What holds for every segmenter."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_motions import bell_motions

from mplearn.errors import FrameError, InvalidValueError
from mplearn.segmentation import SEGMENTERS, Segmenter, make_segmenter

NAMES = sorted(SEGMENTERS)
every_segmenter = pytest.mark.parametrize("name", NAMES)
FRAMES, _ = bell_motions(12, 5, 50.0, seed=0, noise=0.001)


def assert_tiles(segments, n_frames):
    assert segments[0].start == 0
    assert segments[-1].end == n_frames
    for a, b in pairwise(segments):
        assert a.end == b.start
    for segment in segments:
        assert 0.0 <= segment.confidence <= 1.0
        assert segment.end - 1 <= segment.decided_at < n_frames


@every_segmenter
@pytest.mark.parametrize("rate_hz", [20.0, 25.0, 100.0, 250.0])
def test_segments_tile_the_stream(name, rate_hz):
    frames, _ = bell_motions(12, 4, rate_hz, seed=3, noise=0.002)
    segments = make_segmenter(name, 4, rate_hz).segment(frames)
    assert_tiles(segments, len(frames))


@pytest.mark.parametrize("name", ["kohlmorgen-lemm", "zero-velocity"])
@pytest.mark.parametrize("rate_hz", [30.0, 100.0, 200.0])
@pytest.mark.parametrize("turn_s", [0.21, 0.25, 0.3, 0.4])
def test_a_stream_that_begins_in_the_midst_of_a_motion_is_cut_at_its_first_turn(
    name, rate_hz, turn_s
):
    t = np.arange(round(4 * rate_hz)) / rate_hz
    swing = np.sin(np.pi * (t + 0.5 - turn_s))  # turns then, and each second after
    segments = make_segmenter(name, 2, rate_hz).segment(np.stack([swing, 0.5 * swing], axis=1))
    ends = np.array([each.end for each in segments[:3]]) / rate_hz
    np.testing.assert_allclose(ends, turn_s + np.arange(3.0), atol=1.01 / rate_hz)


@every_segmenter
@given(seed=st.integers(0, 10_000), scale=st.sampled_from([1e-6, 1.0, 1e6]))
@settings(max_examples=15, deadline=None)
def test_any_signal_is_tiled(name, seed, scale):
    rng = np.random.default_rng(seed)
    frames = scale * rng.normal(size=(int(rng.integers(1, 900)), 3)).cumsum(axis=0)
    frames[rng.integers(len(frames)) :] = frames[-1]
    segments = make_segmenter(name, 3, 60.0).segment(frames)
    assert_tiles(segments, len(frames))


@every_segmenter
@given(cut=st.integers(0, len(FRAMES)))
@settings(max_examples=12, deadline=None)
def test_resumes_bit_for_bit(name, cut):
    whole = make_segmenter(name, 5, 50.0).segment(FRAMES)
    first = make_segmenter(name, 5, 50.0)
    head = [s for frame in FRAMES[:cut] for s in first.update(frame)]
    second = make_segmenter(name, 5, 50.0)
    second.load_state(first.state())
    for frame in FRAMES[cut : cut + 7]:  # the first goes on: nothing is shared
        first.update(frame)
    tail = [s for frame in FRAMES[cut:] for s in second.update(frame)]
    assert head + tail + second.flush() == whole


class OneByOne(Segmenter):
    """Any segmenter, which takes no more than a frame at a time."""

    def __init__(self, inside):
        self.inside = inside

    def update(self, frame):
        return self.inside.update(frame)

    flush = state = load_state = scaffold = None


OneByOne.__abstractmethods__ = frozenset()


@every_segmenter
@pytest.mark.parametrize("one_by_one", [False, True])
@given(st.lists(st.integers(1, 90), min_size=1), st.integers(0, len(FRAMES)))
@settings(max_examples=10, deadline=None)
def test_many_frames_are_one_after_the_other(name, one_by_one, sizes, bad):
    frames = np.insert(FRAMES, bad, np.nan, axis=0)
    single, many = make_segmenter(name, 5, 50.0), make_segmenter(name, 5, 50.0)
    taker = OneByOne(many) if one_by_one else many
    at, cuts = 0, []
    while at < len(frames):
        block = frames[at : at + sizes[at % len(sizes)]]
        if at == bad:
            with pytest.raises(FrameError, match="finite"):
                taker.advance(block)
            at += 1
            continue
        taken, closed = taker.advance(block)
        assert 0 < taken <= len(block) and (closed or taken == len(block) or at + taken == bad)
        expected = [single.update(frame) for frame in frames[at : at + taken]]
        assert not any(expected[:-1]) and expected[-1] == closed
        at += taken
        cuts += closed
    assert cuts and many.state() == single.state()


@every_segmenter
def test_flush_starts_afresh(name):
    segmenter = make_segmenter(name, 5, 50.0)
    once = segmenter.segment(FRAMES)
    assert segmenter.segment(FRAMES) == once
    assert segmenter.flush() == []


@every_segmenter
def test_constant_input_is_still(name):
    segmenter = make_segmenter(name, 3, 100.0)
    segments = segmenter.segment(np.full((3000, 3), 1.7))
    assert_tiles(segments, 3000)
    assert all(segment.still for segment in segments)
    assert max(segment.length_frames for segment in segments) <= 1100


@every_segmenter
def test_a_hundred_thousand_identical_frames_after_a_motion(name):
    segmenter = make_segmenter(name, 5, 50.0)
    for frame in FRAMES:
        segmenter.update(frame)
    frame = FRAMES[-1]
    late = [s for _ in range(100_000) for s in segmenter.update(frame)]
    assert all(segment.still for segment in late[3:])
    again = [s for frame in FRAMES for s in segmenter.update(frame)]
    assert any(not segment.still for segment in again)


@every_segmenter
def test_one_frame_is_one_segment(name):
    segmenter = make_segmenter(name, 2, 100.0)
    assert segmenter.update(np.zeros(2)) == []
    (only,) = segmenter.flush()
    assert (only.start, only.end, only.still) == (0, 1, True)


@every_segmenter
@pytest.mark.parametrize(
    "frame",
    [
        np.full(5, np.nan),
        np.array([0.0, 0.0, np.inf, 0.0, 0.0]),
        np.zeros(4),
        np.zeros((1, 5)),
        ["a", 0, 0, 0, 0],
        None,
    ],
)
def test_a_bad_frame_changes_nothing(name, frame):
    clean = make_segmenter(name, 5, 50.0)
    poisoned = make_segmenter(name, 5, 50.0)
    expected, got = [], []
    for i, good in enumerate(FRAMES):
        expected += clean.update(good)
        if i in (0, 100, 101):
            with pytest.raises(FrameError):
                poisoned.update(frame)
        got += poisoned.update(good)
    assert got + poisoned.flush() == expected + clean.flush()


@every_segmenter
def test_a_constant_channel_does_not_matter(name):
    with_constant = np.column_stack([FRAMES, np.full(len(FRAMES), 9.81)])
    a = make_segmenter(name, 5, 50.0).segment(FRAMES)
    b = make_segmenter(name, 6, 50.0).segment(with_constant)
    assert [(s.start, s.end, s.still) for s in a] == [(s.start, s.end, s.still) for s in b]


@every_segmenter
def test_a_jump_of_the_signal_does_no_lasting_harm(name):
    jumped = np.concatenate([FRAMES, FRAMES + 50.0, FRAMES + 50.0])
    segments = make_segmenter(name, 5, 50.0).segment(jumped)
    assert_tiles(segments, len(jumped))
    plain = make_segmenter(name, 5, 50.0).segment(FRAMES)
    late = [s for s in segments if s.start > 2 * len(FRAMES)]
    assert len(late) >= int(0.7 * len(plain))


@every_segmenter
def test_wrong_states_are_refused(name):
    segmenter = make_segmenter(name, 5, 50.0)
    with pytest.raises(InvalidValueError, match="rate_hz"):
        make_segmenter(name, 5, 60.0).load_state(segmenter.state())
    with pytest.raises(InvalidValueError, match="shape"):
        make_segmenter(name, 6, 50.0).load_state(segmenter.state())
    with pytest.raises(InvalidValueError, match="lacks"):
        segmenter.load_state(replace(segmenter.state(), arrays={}))
    with pytest.raises(InvalidValueError, match="segmenter"):
        segmenter.load_state(replace(segmenter.state(), segmenter="Other"))


@every_segmenter
@pytest.mark.parametrize(("n_channels", "rate_hz"), [(0, 100.0), (3, 0.0), (3, np.nan), (3, 5.0)])
def test_wrong_arguments_are_named(name, n_channels, rate_hz):
    with pytest.raises(InvalidValueError, match=r"n_channels|rate_hz"):
        make_segmenter(name, n_channels, rate_hz)


def test_an_unknown_segmenter_is_named():
    with pytest.raises(InvalidValueError, match="'zero'"):
        make_segmenter("zero", 3, 100.0)


@every_segmenter
@pytest.mark.parametrize("noise", [0.008, 0.012])
@pytest.mark.parametrize("extra", [0, 150])
def test_motion_after_a_long_rest_is_motion(name, noise, extra):
    """However long nobody moved, and wherever the pause was last closed for its length."""
    at_s = np.arange(600) / 20.0
    motions = np.sin(2 * np.pi * at_s[:, None] / 1.6 + np.array([0.0, 0.3, 0.0, 0.3]))
    rng = np.random.default_rng(1)
    rest = motions[-1] + noise * rng.normal(size=(15 * 60 * 20 + extra, 4))
    stream = np.concatenate([motions, rest, motions, rest, motions])
    segments = make_segmenter(name, 4, 20.0).segment(stream)

    def moving(first):
        end = first + len(motions) + 40
        return sum(not s.still and first <= s.start and s.end <= end for s in segments)

    shown = moving(0)
    assert shown >= 15
    least = 1 if name == "kohlmorgen-lemm-posture" else 0.8 * shown  # postures of rest are many
    for k in (1, 2):
        assert moving(k * (len(motions) + len(rest)) - 20) >= least

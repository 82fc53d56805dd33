"""Any rate, any channels, bad input, and what the confidence of a boundary is worth."""

import numpy as np
import pytest
from known_motions import bell_motions

from mplearn.errors import FrameError, InvalidValueError
from mplearn.evaluation.boundaries import score_boundaries
from mplearn.recording import LabelledSegment
from mplearn.segmentation import SEGMENTERS, KinematicCentroid, make_segmenter

CUTTERS = ["kohlmorgen-lemm", "zero-velocity"]
NAMES = sorted(SEGMENTERS)


def held_motions(rate_hz, n_channels=8, seed=0):
    """A motion in continuous time, seen at any rate: moves out, a short hold, moves back, [s]."""
    rng = np.random.default_rng(seed)
    knots, postures = [0.0], [rng.normal(size=n_channels)]
    for _ in range(30):
        knots += [knots[-1] + rng.uniform(0.6, 1.4)]
        postures += [postures[-1] + rng.normal(size=n_channels)]
        knots += [knots[-1] + rng.choice([1e-6, 0.15])]
        postures += [postures[-1]]
    t = np.arange(0.0, knots[-1], 1.0 / rate_hz)
    i = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2)
    start, end = np.array(knots)[i], np.array(knots)[i + 1]
    x = ((t - start) / (end - start))[:, None]
    bell = x**3 * (10 - 15 * x + 6 * x**2)
    at = np.array(postures)
    frames = np.round(np.array(knots) * rate_hz).astype(int)
    labels = [LabelledSegment(a, b, "m") for a, b in zip(frames[::2], frames[1::2], strict=False)]
    return at[i] + bell * (at[i + 1] - at[i]), labels


@pytest.mark.parametrize("name", CUTTERS)
@pytest.mark.parametrize("rate_hz", [20.0, 30.0, 60.0, 100.0, 120.0, 250.0])
def test_the_same_motion_is_cut_at_the_same_times_at_any_rate(name, rate_hz):
    frames, labels = held_motions(rate_hz)
    score = score_boundaries(
        make_segmenter(name, 8, rate_hz).segment(frames), labels, rate_hz, tolerance_s=0.1
    )
    assert score.f1 >= 0.96
    assert score.median_error_s <= 0.03
    often, all_labels = held_motions(250.0)
    reference = score_boundaries(make_segmenter(name, 8, 250.0).segment(often), all_labels, 250.0)
    assert abs(score.n_found - reference.n_found) <= 1
    assert score.median_delay_s <= reference.median_delay_s + 0.05


@pytest.mark.parametrize("name", CUTTERS)
@pytest.mark.parametrize("n_channels", [1, 3, 40, 130])
def test_any_number_of_channels_is_cut(name, n_channels):
    frames, labels = bell_motions(20, n_channels, 60.0, seed=5)
    segments = make_segmenter(name, n_channels, 60.0).segment(frames)
    assert score_boundaries(segments, labels, 60.0, tolerance_s=0.15).f1 >= 0.9


def test_surer_boundaries_are_right_more_often():
    """In a stream with real turns and mere slowings down, the sure half is more often right."""
    rng = np.random.default_rng(6)
    pieces, turns, end = [], [], 0
    sign = 1.0
    for _ in range(150):
        turning = rng.random() < 0.5
        depth = 1.0 if turning else rng.uniform(0.72, 0.95)  # how far the speed falls at its end
        x = np.linspace(0, 1, 80)[1:]
        pieces.append(sign * (1 - depth * np.cos(np.pi * x) ** 16))
        end += len(x)
        if turning:
            turns.append(end)
            sign = -sign
    frames = (np.cumsum(np.concatenate(pieces)) / 100.0)[:, None] * np.array([[1.0, 0.5]])
    segments = make_segmenter("kohlmorgen-lemm", 2, 100.0).segment(frames)
    ends = np.array([s.end for s in segments[:-1]])
    sure = np.array([s.confidence for s in segments[:-1]])
    right = np.abs(ends[:, None] - np.array(turns)[None]).min(axis=1) <= 10
    assert not right.all()
    half = sure >= np.median(sure)
    assert right[half].mean() > right[~half].mean() + 0.2


@pytest.mark.parametrize("name", NAMES)
def test_a_decision_is_no_earlier_than_its_boundary_and_not_late(name):
    frames, _ = bell_motions(20, 5, 100.0, seed=7)
    segments = make_segmenter(name, 5, 100.0).segment(frames)
    delays = [s.decided_at - s.end for s in segments[:-1]]
    assert min(delays) >= -1
    assert np.median(delays) <= 100


@pytest.mark.parametrize("name", NAMES)
def test_a_minute_without_measurements_is_as_if_it_had_not_been(name):
    frames, _ = bell_motions(8, 4, 60.0, seed=8)
    whole = make_segmenter(name, 4, 60.0).segment(frames)
    broken = make_segmenter(name, 4, 60.0)
    got = [s for frame in frames[:200] for s in broken.update(frame)]
    missing = np.full(4, np.nan)
    partly = np.array([0.0, np.nan, 0.0, 0.0])
    for i in range(3600):
        with pytest.raises(FrameError, match="not finite"):
            broken.update(missing if i % 2 else partly)
    got += [s for frame in frames[200:] for s in broken.update(frame)]
    assert got + broken.flush() == whole


def test_a_million_identical_frames_take_no_memory():
    segmenter = make_segmenter("kohlmorgen-lemm", 2, 100.0)
    size = {name: array.nbytes for name, array in segmenter.state().arrays.items()}
    frames, closed = np.tile([1.0, 2.0], (10_000, 1)), []
    for left in [len(frames)] * 100:
        while left:
            taken, segments = segmenter.advance(frames[-left:])
            closed += segments
            left -= taken
    assert closed and all(s.still for s in closed)
    assert {name: array.nbytes for name, array in segmenter.state().arrays.items()} == size


@pytest.mark.parametrize("name", CUTTERS)
def test_a_stream_at_double_rate_loses_no_boundary_but_the_short_ones(name):
    frames, labels = bell_motions(30, 5, 100.0, seed=9)
    twice = np.repeat(frames, 2, axis=0)
    twice[1:-1:2] = 0.5 * (frames[:-1] + frames[1:])
    late = [LabelledSegment(2 * a.start, 2 * a.end, a.label) for a in labels]
    segments = make_segmenter(name, 5, 100.0).segment(twice)
    assert score_boundaries(segments, late, 200.0, tolerance_s=0.1).f1 >= 0.9


def test_the_farthest_posture_is_a_boundary_for_the_kinematic_centroid():
    t = np.arange(2000) / 100.0
    away = np.abs(np.sin(np.pi * t / 2.5))  # out and back: far at 1.25 s, home at 2.5 s, ...
    segments = KinematicCentroid(2, 100.0).segment(np.column_stack([away, 0.3 * away]))
    ends = np.array([s.end for s in segments[:-1]])
    np.testing.assert_allclose(ends[:14], 125 * np.arange(1, 15), atol=4)


@pytest.mark.parametrize("name", NAMES)
def test_scaffolding_that_says_nothing_changes_nothing(name):
    frames, _ = bell_motions(8, 4, 60.0, seed=10)
    plain = make_segmenter(name, 4, 60.0).segment(frames)
    told = make_segmenter(name, 4, 60.0)
    got = []
    for frame in frames:
        told.scaffold(np.full(4, 7.0), 0.5)
        got += told.update(frame)
    assert got + told.flush() == plain


@pytest.mark.parametrize("name", CUTTERS)
def test_scaffolding_hides_channels_and_moves_the_threshold(name):
    frames, labels = bell_motions(16, 3, 60.0, seed=11)
    sway = np.cumsum(np.random.default_rng(12).normal(0, 0.08, (len(frames), 3)), axis=0)
    noisy = np.column_stack([frames, sway])
    blind, told = make_segmenter(name, 6, 60.0), make_segmenter(name, 6, 60.0)
    told.scaffold(np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
    scores = [
        score_boundaries([s for f in noisy for s in each.update(f)], labels, 60.0).f1
        for each in (blind, told)
    ]
    assert scores[1] >= 0.95 > scores[0]
    numbers = []
    for ending in (0.0, 0.5, 1.0):
        segmenter = make_segmenter(name, 6, 60.0)
        segmenter.scaffold(None, ending)
        numbers.append(sum(len(segmenter.update(frame)) for frame in noisy))
    assert numbers[0] < numbers[1] < numbers[2]


def test_wrong_hints_are_named():
    segmenter = make_segmenter("zero-velocity", 3, 60.0)
    for weights in (np.ones(2), -np.ones(3), np.zeros(3), np.full(3, np.nan)):
        with pytest.raises(InvalidValueError, match="weights"):
            segmenter.scaffold(weights)
    for ending in (-0.1, 1.1, np.nan):
        with pytest.raises(InvalidValueError, match="ending"):
            segmenter.scaffold(None, ending)

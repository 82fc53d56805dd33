"""Slow streams are cut as what lies between their frames would be."""

import numpy as np
import pytest
from data_folder import DATA, needs_data
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from mplearn.errors import StateError
from mplearn.evaluation.experiments import frame_rate_table
from mplearn.mocap import open_recordings
from mplearn.segmentation import KohlmorgenLemm, ZeroVelocity, make_segmenter
from mplearn.segmentation.upsampling import LEAST_HZ, Upsampled


def wandering(n_frames, rate_hz, seed=0, n_channels=4):
    """Motion of a few frequencies below 2.5 Hz, known at any time, shape (T, D)."""
    rng = np.random.default_rng(seed)
    t = np.arange(n_frames)[:, None, None] / rate_hz
    hertz = rng.uniform(0.2, 2.5, size=(n_channels, 6))
    waves = rng.normal(size=(n_channels, 6)) / hertz
    return (waves * np.sin(2 * np.pi * hertz * t + rng.uniform(0, 6, size=(n_channels, 6)))).sum(-1)


def by_polynomials(frames, factor):
    """Return frames with points of the parabola through three of them between the last two."""
    known = np.concatenate([frames[:1], frames[:1], frames])
    points = [frames[:1]]
    for k in range(1, len(frames)):
        places = np.arange(1, factor + 1) / factor
        through = [
            Polynomial.fit([-1, 0, 1], column, 2, domain=[-1, 1]) for column in known[k : k + 3].T
        ]
        points.append(np.stack([each(places) for each in through], axis=1))
    return np.concatenate(points)


@pytest.mark.parametrize("make", [KohlmorgenLemm, ZeroVelocity])
@pytest.mark.parametrize(("rate_hz", "factor"), [(20.0, 5), (24.0, 5), (30.0, 4), (60.0, 2)])
def test_a_slow_stream_is_cut_as_parabolas_through_its_frames(make, rate_hz, factor):
    frames = wandering(round(25 * rate_hz), rate_hz)
    slow = Upsampled(4, rate_hz, make)
    assert slow.step_hz == factor * rate_hz >= LEAST_HZ > (factor - 1) * rate_hz
    segments = slow.segment(frames)
    fine = make(4, factor * rate_hz).segment(by_polynomials(frames, factor))
    assert len(fine) > 8 and [s.cause for s in segments] == [s.cause for s in fine]
    assert [s.still for s in segments] == [s.still for s in fine]
    for cut, step in zip(segments[:-1], fine[:-1], strict=True):
        assert -0.5 <= cut.end - step.end / factor < 0.5
        assert 0 <= cut.decided_at - step.decided_at / factor < 1
        assert cut.confidence == pytest.approx(step.confidence, abs=1e-9)
    assert segments[-1].end == len(frames)


@given(st.integers(0, 10_000), st.sampled_from([10.0, 20.0, 29.97, 50.0, 99.0]), st.data())
@settings(max_examples=40, deadline=None)
def test_frames_may_come_in_any_portions_and_a_state_resumes(seed, rate_hz, data):
    frames = wandering(data.draw(st.integers(1, 250)), rate_hz, seed, 2)
    whole = make_segmenter("kohlmorgen-lemm", 2, rate_hz).segment(frames)
    assert [s.start for s in whole] == [0, *(s.end for s in whole[:-1])]
    assert whole[-1].end == len(frames)
    segmenter, found, taken = make_segmenter("kohlmorgen-lemm", 2, rate_hz), [], 0
    while taken < len(frames):
        n, closed = segmenter.advance(frames[taken : taken + data.draw(st.integers(1, 90))])
        taken, found = taken + n, found + closed
        other = make_segmenter("kohlmorgen-lemm", 2, rate_hz)
        other.load_state(segmenter.state())
        assert other.state() == segmenter.state() and segmenter.state().n_frames == taken
        segmenter = other
    assert found + segmenter.flush() == whole
    assert segmenter.segment(frames) == whole  # afresh after a flush


def test_a_stream_that_began_without_goes_on_so_up_to_its_end():
    frames = wandering(300, 30.0)
    plain, late = KohlmorgenLemm(4, 30.0), make_segmenter("kohlmorgen-lemm", 4, 30.0)
    found = [s for frame in frames[:150] for s in plain.update(frame)]
    late.load_state(plain.state())
    assert late.state() == plain.state()
    assert found + [s for frame in frames[150:] for s in late.update(frame)] + late.flush() == (
        KohlmorgenLemm(4, 30.0).segment(frames)
    )
    assert late.segment(frames) == make_segmenter("kohlmorgen-lemm", 4, 30.0).segment(frames)


def test_a_damaged_state_is_refused_and_changes_nothing():
    segmenter = make_segmenter("kohlmorgen-lemm", 4, 30.0)
    segmenter.advance(wandering(20, 30.0))
    state = segmenter.state()
    for damage in (np.zeros((3, 4)), np.full((2, 4), np.nan), np.zeros((2, 4), int)):
        broken = type(state)(
            state.segmenter, state.rate_hz, state.n_frames, {**state.arrays, "latest": damage}
        )
        with pytest.raises(StateError, match=r"arrays\.latest"):
            segmenter.load_state(broken)
    wrong = type(state)(state.segmenter, state.rate_hz, state.n_frames + 1, state.arrays)
    with pytest.raises(StateError, match="n_frames"):
        segmenter.load_state(wrong)
    assert segmenter.state() == state


@pytest.mark.parametrize("rate_hz", [20.0, 24.0, 30.0, 50.0])
def test_motion_that_never_rests_is_cut_alike_at_any_rate(rate_hz):
    """Without what is put in between, of these cuts 25 % are other ones at 20 Hz."""
    n_same = n_all = 0
    for seed in range(6):
        slow, fast = (
            np.array([s.end for s in make_segmenter("kohlmorgen-lemm", 4, hz).segment(frames)]) / hz
            for hz in (rate_hz, 120.0)
            for frames in [wandering(round(40 * hz), hz, seed)]
        )
        n_same += sum(np.abs(fast - cut).min() <= 0.1 for cut in slow)
        n_same += sum(np.abs(slow - cut).min() <= 0.1 for cut in fast)
        n_all += len(slow) + len(fast)
    assert n_same / n_all >= 0.95


@needs_data
def test_people_are_cut_alike_at_any_rate():
    table = frame_rate_table(open_recordings(DATA / "cmu"), rates_hz=(20.0, 30.0, 60.0))
    scores = [float(cell.split()[0]) for cell in table.rows[-1][3:]]
    assert len(table.rows) > 5 and min(scores) >= 0.95

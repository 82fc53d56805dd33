"""Resampling against closed forms: sinusoids pass or vanish, gaps stay, labels keep their times."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn.mocap import resample
from mplearn.recording import LabelledSegment, Recording


def sinusoids(rate_hz: float, frequencies_hz: list[float], duration_s: float = 6.0) -> Recording:
    time = np.arange(int(duration_s * rate_hz)) / rate_hz
    frames = np.stack([np.sin(2 * np.pi * f * time + 0.3) for f in frequencies_hz], axis=1)
    return Recording(frames, rate_hz, tuple(f"{f} Hz" for f in frequencies_hz))


def inner(recording: Recording) -> slice:
    """Without the first and last second, where a filter knows only one side."""
    return slice(int(recording.rate_hz), -int(recording.rate_hz))


@pytest.mark.parametrize(
    ("old", "new"), [(120, 100), (100, 30), (250, 60), (20, 100), (59.94, 100)]
)
def test_slow_sinusoids_pass(old: float, new: float) -> None:
    limit = 0.4 * min(old, new)
    frequencies = [0.3, 0.5 * limit, limit]
    got = resample(sinusoids(old, frequencies), new)
    want = sinusoids(new, frequencies, duration_s=7.0).frames[: len(got)]
    assert got.rate_hz == new
    assert got.frames[inner(got)] == pytest.approx(want[inner(got)], abs=2e-3)


@pytest.mark.parametrize(("old", "new"), [(120, 50), (250, 100), (100, 20)])
def test_fast_sinusoids_do_not_alias(old: float, new: float) -> None:
    got = resample(sinusoids(old, [0.56 * new, 0.7 * new, 0.95 * new]), new)
    assert np.abs(got.frames[inner(got)]).max() < 2e-3


@pytest.mark.parametrize("new", [33.0, 100.0, 240.0])
def test_a_straight_line_stays_straight_up_to_both_ends(new: float) -> None:
    line = np.linspace(-3.0, 5.0, 101)[:, None]
    got = resample(Recording(line, 50.0, ("a",)), new)
    assert got.frames[:, 0] == pytest.approx(-3.0 + 4.0 * np.arange(len(got)) / new, abs=1e-4)


def test_a_step_that_wobbles_the_level_would_show() -> None:
    got = resample(Recording(np.full((80, 2), 7.5), 100.0, ("a", "b")), 64.0)
    assert got.frames == pytest.approx(np.full((51, 2), 7.5), abs=1e-12)


@settings(deadline=None, max_examples=60)
@given(
    n_old=st.integers(2, 200),
    old=st.floats(5.0, 300.0),
    new=st.floats(5.0, 300.0),
    seed=st.integers(0, 99),
)
def test_times_gaps_and_labels_stay(n_old: int, old: float, new: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames = rng.normal(size=(n_old, 3))
    missing = rng.random(frames.shape) < 0.2
    frames[missing] = np.nan
    cut = int(rng.integers(1, n_old))
    labels = (LabelledSegment(0, cut, "a", "anna"), LabelledSegment(cut, n_old, "b"))
    got = resample(Recording(frames, old, ("x", "y", "z"), "n", "p", labels), new)

    times = np.arange(len(got)) / new
    assert times[-1] <= (n_old - 1) / old + 1e-9 < times[-1] + 1 / new + 1e-8
    if new != old:
        nearest = np.minimum(np.rint(times * old).astype(int), n_old - 1)
        assert np.array_equal(np.isnan(got.frames), missing[nearest])
    assert (got.name, got.person) == ("n", "p")
    for label in got.labels:  # exactly the new frames whose times lie inside
        before = next(b for b in labels if b.label == label.label)
        inside = (times >= before.start / old - 1e-9) & (times < before.end / old - 1e-9)
        assert np.flatnonzero(inside).tolist() == list(range(label.start, label.end))


def test_gaps_do_not_spread() -> None:
    whole = sinusoids(100.0, [1.0])
    frames = whole.frames.copy()
    frames[200:210] = np.nan
    got = resample(Recording(frames, 100.0, whole.channels), 50.0)
    want = resample(whole, 50.0)
    assert np.flatnonzero(np.isnan(got.frames[:, 0])).tolist() == [100, 101, 102, 103, 104]
    seen = ~np.isnan(got.frames)
    assert got.frames[seen] == pytest.approx(want.frames[seen], abs=0.02)


def test_a_channel_that_was_never_seen_stays_missing() -> None:
    got = resample(Recording(np.full((50, 1), np.nan), 100.0, ("a",)), 30.0)
    assert np.isnan(got.frames).all()


def test_same_rate_changes_nothing() -> None:
    recording = sinusoids(100.0, [1.0])
    assert resample(recording, 100.0).frames is recording.frames


@pytest.mark.parametrize("rate_hz", [0.0, -5.0, np.nan, np.inf, 1e9])
def test_impossible_rates(rate_hz: float) -> None:
    with pytest.raises(InvalidValueError, match="rate_hz"):
        resample(sinusoids(100.0, [1.0]), rate_hz)

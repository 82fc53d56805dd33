"""The low-pass filter against scipy's."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, group_delay, sosfiltfilt

from mplearn.errors import InvalidValueError
from mplearn.maths.filters import butterworth, lowpass

RATE = 100.0


@settings(max_examples=50, deadline=None)
@given(st.floats(20.0, 1000.0), st.floats(0.005, 0.495))
def test_the_design_is_scipys(rate_hz, share):
    numerator, denominator = butter(2, share * rate_hz, fs=rate_hz)
    own = butterworth(share * rate_hz, rate_hz)
    np.testing.assert_allclose(own.gain * np.array([1.0, 2.0, 1.0]), numerator, rtol=1e-9)
    np.testing.assert_allclose((1.0, own.a1, own.a2), denominator, atol=1e-12)
    _, (delay,) = group_delay((numerator, denominator), w=[1e-6], fs=rate_hz)
    assert own.delay_frames == pytest.approx(delay, rel=1e-4)


@settings(max_examples=30, deadline=None)
@given(st.integers(3, 200), st.floats(0.3, 49.0), st.integers(0, 2**32))
def test_the_filter_is_scipys(n_frames, cutoff_hz, seed):
    frames = np.cumsum(np.random.default_rng(seed).standard_normal((n_frames, 2)), axis=0)
    pad = min(n_frames - 1, int(np.ceil(200 / cutoff_hz)))
    sections = butter(2, cutoff_hz, fs=100, output="sos")
    expected = sosfiltfilt(sections, frames, axis=0, padtype="odd", padlen=pad)
    np.testing.assert_allclose(
        lowpass(frames, 100.0, cutoff_hz), expected, atol=1e-9 * np.abs(frames).max()
    )


def test_lowpass_keeps_ends_phase_and_slow_motion():
    t = np.arange(400) / RATE
    slow, fast = np.sin(2 * np.pi * 0.5 * t), np.sin(2 * np.pi * 20 * t)
    filtered = lowpass(np.stack([slow, slow + fast, t], axis=1), RATE, 4.0)
    np.testing.assert_allclose(filtered[:, 0], slow, atol=0.02)
    np.testing.assert_allclose(filtered[30:-30, 1], slow[30:-30], atol=0.02)
    np.testing.assert_allclose(filtered[:, 2], t, atol=1e-4)
    np.testing.assert_array_equal(lowpass(slow[:, None], RATE, 60.0), slow[:, None])
    halved = lowpass(np.sin(2 * np.pi * 4 * t)[:, None], RATE, 4.0)[150:250]
    assert np.abs(halved).max() == pytest.approx(0.5, abs=0.02)


def test_a_wrong_cut_off_or_frame_is_named():
    with pytest.raises(InvalidValueError, match="positive, not 0"):
        lowpass(np.zeros((9, 1)), RATE, 0.0)
    with pytest.raises(InvalidValueError, match="finite"):
        lowpass(np.full((9, 1), np.nan), RATE, 5.0)

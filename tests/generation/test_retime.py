from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.lib.stride_tricks import sliding_window_view
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from mplearn.errors import InvalidValueError
from mplearn.generation import Trajectory, retime
from mplearn.generation.retime import slowed_down
from mplearn.generation.warp import Warp

RATE = 100.0


def motion(seed, n_pieces=3, n_channels=4, rate_hz=RATE):
    """Smooth random motion through pieces of different vigour."""
    rng = np.random.default_rng(seed)
    lengths = rng.integers(25, 70, n_pieces)
    t = np.arange(lengths.sum()) / rate_hz
    frames = sum(
        rng.normal(0, 1, n_channels) * np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6))
        for f in (0.3, 0.8, 1.6)
    )
    ids = np.repeat(rng.permutation(n_pieces), lengths)
    return Trajectory(frames, rate_hz, tuple("abcdefgh"[:n_channels]), ids)


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    velocity=st.floats(0.2, 30),
    acceleration=st.none() | st.floats(0.5, 300),
    speed=st.floats(0.2, 2.5),
    rate_hz=st.sampled_from([20.0, 100.0, 250.0]),
)
def test_limits_always_hold_and_the_way_stays_the_same(
    seed, velocity, acceleration, speed, rate_hz
):
    before = motion(seed, rate_hz=rate_hz)
    limits = velocity * np.array([1.0, 0.5, 2.0, np.inf])
    a_limits = None if acceleration is None else acceleration * np.array([1, np.inf, 0.5, 3])
    after = retime(before, limits, a_limits, speed)
    assert (np.abs(after.velocities) <= limits).all()
    if a_limits is not None:
        assert (np.abs(after.accelerations) <= a_limits).all()
    assert after.path == before.path
    assert (len(after) - 1) / (len(before) - 1) >= 1 / speed - 1e-6
    np.testing.assert_allclose(after.frames[[0, -1]], before.frames[[0, -1]], atol=1e-9)
    if speed <= 1:  # every posture on the way is still passed, between two frames
        step = np.abs(np.diff(before.frames, axis=0)).max(axis=0) + 1e-3
        nearest = np.abs(after.frames[:, None] - before.frames[None]).max(axis=2).min(axis=0)
        assert (nearest <= step.max()).all()


def test_within_limits_nothing_changes():
    before = motion(1)
    assert retime(before) is before
    assert retime(before, np.full(4, 1e6), np.full(4, 1e6)) is before


def test_half_speed_is_half_speed():
    before = motion(2)
    after = retime(before, speed=0.5)
    assert len(after) == 2 * len(before) - 1
    np.testing.assert_allclose(after.frames[::2], before.frames, atol=1e-9)
    assert after.starts.tolist() == (2 * before.starts).tolist()
    np.testing.assert_allclose(
        np.abs(after.velocities).max(), np.abs(before.velocities).max() / 2, rtol=0.02
    )


def test_the_slow_down_is_the_smallest_and_each_primitives_own():
    t = np.arange(400) / RATE
    velocity = 1 + 3 / (1 + np.exp(-(t - 2.2) / 0.03))
    frames = np.stack([np.cumsum(velocity) / RATE, np.zeros(400)], axis=1)
    ids = np.repeat([5, 6], 200)
    before = Trajectory(frames, RATE, ("x", "y"), ids)
    after = retime(before, np.array([2.0, 1.0]))
    lengths = np.diff(np.append(after.starts, len(after)))
    # 1 /s is within 2 /s, 4 /s needs twice the time; the slow-down sets in 0.2 s before the join
    assert 200 <= lengths[0] <= 225
    assert 395 <= lengths[1] <= 405
    assert np.abs(after.velocities).max() == pytest.approx(2.0, rel=0.01)


def too_fast(before, limits, a_limits, factors, blend_s=0.1):
    """Return by what factor each primitive is too fast, from the definition."""
    half = round(blend_s * before.rate_hz)
    slowness = np.repeat(factors, np.diff(np.append(before.starts, len(before))))
    for of in (np.max, np.mean):
        around = sliding_window_view(np.pad(slowness, half, mode="edge"), 2 * half + 1)
        slowness = of(around, axis=1)
    fine = np.linspace(0, len(before) - 1, 200 * (len(before) - 1) + 1)
    passed = cumulative_trapezoid(
        np.interp(fine, np.arange(len(before)), slowness), fine, initial=0
    )
    n = int(np.ceil(passed[-1] - 1e-9)) + 1
    passed *= (n - 1) / passed[-1]
    place = np.interp(np.arange(n), passed, fine)
    frames = CubicSpline(np.arange(len(before)), before.frames)(place)
    over = np.zeros(n)
    over[1:] = (np.abs(np.diff(frames, axis=0)) * before.rate_hz / limits).max(axis=1)
    bends = (np.abs(np.diff(frames, n=2, axis=0)) * before.rate_hz**2 / a_limits).max(axis=1)
    over[1:-1] = np.maximum(over[1:-1], np.sqrt(bends))
    return np.maximum.reduceat(over, np.ceil(passed[200 * before.starts] - 1e-9).astype(int))


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    n_pieces=st.integers(1, 5),
    velocity=st.floats(0.5, 8),
    acceleration=st.floats(3, 120),
    rate_hz=st.sampled_from([50.0, 100.0, 250.0]),
)
def test_slow_downs_suffice_and_no_smaller_one_would_be_much_shorter(
    seed, n_pieces, velocity, acceleration, rate_hz
):
    before = motion(seed, n_pieces=n_pieces, rate_hz=rate_hz)
    limits, a_limits = np.full(4, velocity), np.full(4, acceleration)
    warp = Warp(before, limits, a_limits)
    factors, timing = slowed_down(warp, 1.0)
    assert (too_fast(before, limits, a_limits, factors) <= 1 + 1e-9).all()
    assert len(timing.places) == len(retime(before, limits, a_limits))
    for p, factor in product(np.flatnonzero(factors > 1), np.arange(1.03, 1.4, 0.03)):
        smaller = factors.copy()
        smaller[p] = max(smaller[p] / factor, 1.0)
        other = warp.timing(smaller)
        assert len(other.places) > 0.97 * len(timing.places) or warp.excess(other).max() > 1


@pytest.mark.parametrize("seed", [0, 3])
def test_no_pair_of_slow_downs_is_much_shorter(seed):
    """Brute force over both factors of a path of two primitives, in steps of 6 %."""
    rng = np.random.default_rng(seed)
    before = motion(seed, n_pieces=2, n_channels=2)
    limits, a_limits = np.full(2, rng.uniform(1, 8)), np.full(2, rng.uniform(5, 120))
    after = retime(before, limits, a_limits)
    warp = Warp(before, limits, a_limits)
    grid = 1.06 ** np.arange(0, 1 + np.log(len(after) / 25) / np.log(1.06))
    timings = [warp.timing(np.array(pair)) for pair in product(grid[grid < 6], repeat=2)]
    shorter = [timing for timing in timings if len(timing.places) < 0.95 * len(after)]
    assert len(shorter) > 10
    assert all(warp.excess(timing).max() > 1 for timing in shorter)


def test_accelerations_fall_with_the_square():
    t = np.arange(200) / RATE
    before = Trajectory(np.sin(np.pi * t)[:, None], RATE, ("x",), np.zeros(200))
    peak = np.abs(before.accelerations).max()
    after = retime(before, acceleration_limits=np.array([peak / 4]))
    assert len(after) == pytest.approx(400, abs=6)


def test_a_jump_becomes_a_ramp_within_limits():
    frames = np.repeat([0.0, 1.0], 30)[:, None]
    before = Trajectory(frames, RATE, ("x",), np.zeros(60))
    after = retime(before, np.array([2.0]), np.array([40.0]))
    assert np.abs(after.velocities).max() <= 2.0
    assert np.abs(after.accelerations).max() <= 40.0


def test_bad_limits_are_named():
    before = motion(3)
    for wrong, match in (
        ({"velocity_limits": np.ones(3)}, "velocity_limits must be 4"),
        ({"velocity_limits": np.array([1, 0, 1, 1])}, "velocity_limits"),
        ({"acceleration_limits": np.array([1, np.nan, 1, 1])}, "acceleration_limits"),
        ({"speed": 0.0}, "speed"),
        ({"speed": np.inf}, "speed"),
        ({"velocity_limits": np.full(4, 1e-12)}, "would stretch"),
        ({"speed": 1e5}, "without a frame"),
    ):
        with pytest.raises(InvalidValueError, match=match):
            retime(before, **wrong)
    still = Trajectory(np.zeros((1, 1)), RATE, ("x",), np.zeros(1))
    assert len(retime(still, np.ones(1), speed=0.5)) == 1

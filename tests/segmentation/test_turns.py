"""Motion that never rests: cut where it turns round, at any rate, and what only drifts is not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_motions import bell_motions

from mplearn.segmentation import KohlmorgenLemm, TurnConfig, ZeroVelocity
from mplearn.segmentation.kernels import Smooth
from mplearn.segmentation.turns import follow_axis, new_trail, turn_settings

RATES = [20.0, 30.0, 60.0, 100.0, 120.0, 250.0]


def cycle(rate_hz, frequency_hz, seed=0, seconds=25.0, n_channels=12, narrow=0.65):
    """A rhythm whose speed never falls far: an ellipse in random directions, turning at 0 and 0.5.

    Returns:
        Frames (T, D), and the number of cycles passed at each, (T,).
    """
    rng = np.random.default_rng(seed)
    basis = np.linalg.qr(rng.normal(size=(n_channels, 4)))[0].T
    passed = frequency_hz * np.arange(0.0, seconds, 1.0 / rate_hz)
    angle = 2 * np.pi * passed[:, None]
    waves = np.hstack([np.cos(angle), narrow * np.sin(angle), 0.1 * np.sin(2 * angle + 1.0)])
    return waves @ basis[:3], passed


def drift(seconds, seed, n_channels=12, rate_hz=100.0):
    """Slow sway in all directions, without a period."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / rate_hz)[:, None, None]
    shape = (n_channels, 20)
    slow, phase = rng.uniform(0.02, 0.3, shape), rng.uniform(0, 2 * np.pi, shape)
    return (rng.normal(size=shape) / np.sqrt(slow) * np.sin(2 * np.pi * slow * t + phase)).sum(2)


def pace(frames):
    return float(np.median(np.linalg.norm(np.diff(frames, axis=0), axis=1)))


@pytest.mark.parametrize("rate_hz", RATES)
@pytest.mark.parametrize("frequency_hz", [0.4, 0.8, 1.3, 1.8])
def test_a_rhythm_is_cut_twice_a_cycle_at_its_turns_at_any_rate(rate_hz, frequency_hz):
    frames, passed = cycle(rate_hz, frequency_hz)
    assert len(ZeroVelocity(12, rate_hz).segment(frames)) <= 4  # there is no rest, and no dip
    segments = KohlmorgenLemm(12, rate_hz).segment(frames)[:-1]
    late = [s for s in segments if passed[s.end] > 1.5]
    cuts = passed[[s.end for s in late]]
    assert abs(len(cuts) / (passed[-1] - 1.5) - 2.0) <= 0.1
    off = (2 * cuts + 0.5) % 1 - 0.5  # in half cycles, from the turn
    frame = 2 * frequency_hz / rate_hz
    assert np.abs(off).max() <= 0.12 + frame
    assert np.std(off) <= 0.04 + frame / 2
    assert {s.cause for s in late} <= {"turn", "return"}
    delays = np.array([s.decided_at - s.end for s in segments]) / rate_hz
    assert np.median(delays) <= max(0.25, 0.3 / frequency_hz)


def test_what_is_held_is_no_motion():
    frames, _ = cycle(100.0, 0.9)
    still = frames[-1] + 1e-3 * np.random.default_rng(0).normal(size=(4000, 12))
    segments = KohlmorgenLemm(12, 100.0).segment(np.concatenate([frames, still]))
    assert all(s.still for s in segments if s.start > len(frames) + 60)


@pytest.mark.parametrize("share", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_what_only_drifts_is_hardly_cut(seed, share):
    """Where a rhythm as fast would be cut 100 times a minute, and the longest segment is 10 s."""
    frames, _ = cycle(100.0, 0.9)
    sway = drift(60.0, seed)
    sway *= share * pace(frames) / pace(sway)
    stream = np.concatenate([frames, frames[-1] + sway - sway[0]])
    segments = KohlmorgenLemm(12, 100.0).segment(stream)
    assert len([s for s in segments if s.start > len(frames)]) <= 20


def test_a_boundary_says_what_made_it():
    rhythm, _ = cycle(100.0, 0.9, n_channels=6, seconds=12.0)
    bells, _ = bell_motions(12, 6, 100.0, seed=2)
    stream = np.concatenate([rhythm, rhythm[-1] + bells - bells[0]])
    segments = KohlmorgenLemm(6, 100.0).segment(stream)
    turned = [s for s in segments if 200 < s.end < len(rhythm) - 60]
    rested = [s for s in segments[:-1] if s.still]
    assert {s.cause for s in turned} == {"turn"}
    assert rested
    assert {s.cause for s in rested} == {"rest"}
    assert {s.cause for s in segments[:-1]} == {"turn", "rest", "dip"}
    assert segments[-1].cause == "end"


@given(cut=st.integers(0, 999))
@settings(max_examples=10, deadline=None)
def test_a_rhythm_resumes_bit_for_bit(cut):
    frames, _ = cycle(50.0, 0.9, n_channels=5, seconds=20.0)
    whole = KohlmorgenLemm(5, 50.0).segment(frames)
    first, second = KohlmorgenLemm(5, 50.0), KohlmorgenLemm(5, 50.0)
    head = [s for frame in frames[:cut] for s in first.update(frame)]
    second.load_state(first.state())
    assert head + second.segment(frames[cut:]) == whole


def test_the_axis_is_the_first_principal_component_of_the_velocity():
    rng = np.random.default_rng(3)
    velocity = (
        rng.normal(size=(400, 7)) @ np.diag([3.0, 1.5, 1, 1, 1, 1, 1]) @ rng.normal(size=(7, 7))
    )
    trail = new_trail(7, 50)
    config = turn_settings(TurnConfig(axis_s=1e9, axis_share=1e-6), 100.0, 0.1)[0]
    parts = [np.zeros(7) for _ in Smooth._fields]
    smooth = Smooth(*parts)
    smooth.weights[:] = rng.uniform(0.5, 2.0, size=7)
    path = 0.0
    for t, v in enumerate(velocity):
        smooth.velocity[:] = v
        weighted = np.sqrt(smooth.weights) * v
        follow_axis(t, float(np.linalg.norm(weighted)), smooth, config, trail)
        path += 0.01 * float(trail.axis @ weighted)
    weighted = np.sqrt(smooth.weights) * velocity
    np.testing.assert_allclose(trail.covariance, weighted.T @ weighted / 400, rtol=1e-6, atol=1e-9)
    main = np.linalg.eigh(weighted.T @ weighted)[1][:, -1]
    assert abs(main @ trail.axis) > 1 - 1e-4
    assert trail.turning["path"][0] == pytest.approx(path)
    assert trail.paths[399 % 50] == pytest.approx(path)

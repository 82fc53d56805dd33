"""Activities of made-up motions, and the parts of the method against brute force."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.activities import ActivityConfig, find_activities, postures_of
from mplearn.activities.mixing import group, nearest_in_each
from mplearn.activities.stretches import band_of_links, best_stretches
from mplearn.body import feature_channels, view_of
from mplearn.errors import InvalidValueError
from mplearn.evaluation.partitions import agreement

PERIODS_S = {"a": 1.1, "b": 2.3, "c": 3.1}


def motion(script, rate_hz, seed=0):
    """Return frames and truth: each letter is a closed curve, gone through at a varying speed."""
    rng = np.random.default_rng(seed)
    curves = {kind: rng.normal(size=(6, 5)) for kind in "abc"}
    frames, truth = [], []
    for kind, seconds in script:
        n = round(seconds * rate_hz)
        speed = 1.0 + 0.1 * np.sin(np.arange(n) / rate_hz + rng.uniform(0, 6))
        phase = 2 * np.pi * np.cumsum(speed) / rate_hz / PERIODS_S[kind]
        waves = (1.0 + 0 * phase, np.sin(phase), np.cos(phase), np.sin(2 * phase))
        waves = np.stack((*waves, np.cos(2 * phase)))
        frames.append((curves[kind] @ waves).T + 0.05 * rng.normal(size=(n, 6)))
        truth += [kind] * n
    return np.concatenate(frames), np.array(truth)


SCRIPT = (("a", 9), ("b", 12), ("a", 7), ("c", 14), ("b", 8))


@pytest.mark.parametrize("rate_hz", [20.0, 59.94, 250.0])
def test_activities_that_come_back_are_found_at_any_rate(rate_hz):
    frames, truth = motion(SCRIPT, rate_hz)
    result = agreement(truth, find_activities(frames, rate_hz))
    assert result.n_found == 3
    assert result.ari > 0.93 and result.change_f1 == 1


def test_neither_place_nor_scale_nor_axes_matter():
    frames, _ = motion(SCRIPT, 30.0)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(6, 6)))[0]
    expected = find_activities(frames, 30.0)
    np.testing.assert_array_equal(find_activities(7.0 * frames @ turn + 3.0, 30.0), expected)


def test_an_activity_of_any_length_is_one():
    frames, _ = motion((("b", 90),), 30.0)
    np.testing.assert_array_equal(find_activities(frames, 30.0), 0)
    still = np.ones((900, 4))
    np.testing.assert_array_equal(find_activities(still, 30.0), 0)
    assert find_activities(frames[:1], 30.0).tolist() == [0]


@pytest.mark.parametrize("step_s", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("per_s", [0.25, 0.5, 1.0])
def test_what_comes_back_to_the_very_same_postures_is_one(per_s, step_s):
    """Its periods are whole numbers of steps: its copies are equally near but for rounding."""
    phase = 2 * np.pi * per_s * np.arange(3000) / 50.0
    frames = np.column_stack((np.sin(phase), 0.5 * np.cos(phase)))
    config = ActivityConfig(step_s=step_s)
    np.testing.assert_array_equal(find_activities(frames, 50.0, config), 0)


def test_missing_values_are_bridged():
    frames, truth = motion(SCRIPT, 30.0)
    frames[100:110] = np.nan
    frames[700:720, 2] = np.nan
    gaps = np.column_stack((frames, np.full(len(frames), np.nan)))
    assert agreement(truth, find_activities(gaps, 30.0)).ari > 0.9
    np.testing.assert_array_equal(find_activities(np.full((500, 3), np.nan), 30.0), 0)


def test_bad_input_is_named():
    with pytest.raises(InvalidValueError, match="T > 0"):
        find_activities(np.zeros((0, 3)), 30.0)
    with pytest.raises(InvalidValueError, match="finite"):
        find_activities(np.full((50, 3), np.inf), 30.0)
    with pytest.raises(InvalidValueError, match="rate_hz"):
        find_activities(np.zeros((50, 3)), 0.0)
    with pytest.raises(InvalidValueError, match="mixing"):
        ActivityConfig(mixing=0.0)
    with pytest.raises(InvalidValueError, match="increase"):
        ActivityConfig(apart_s=9.0)


def test_links_are_those_of_the_nearest_within_reach():
    points = np.random.default_rng(2).normal(size=(150, 3))  # more than one block of rows
    apart, reach, count, recurrence = 3, 20, 4, 0.7
    expected = np.zeros((150, reach + 1))
    for i in range(150):
        allowed = [j for j in range(150) if apart < abs(i - j) <= reach]
        near = sorted(allowed, key=lambda j: ((points[i] - points[j]) ** 2).sum())[:count]
        for j in allowed:
            link = (j in near) / count - recurrence / len(allowed)
            expected[max(i, j), abs(i - j)] += link
    found = band_of_links(points, apart, reach, count, recurrence)
    np.testing.assert_allclose(found, expected, atol=1e-12)


@given(st.integers(0, 10_000), st.integers(1, 4))
@settings(max_examples=30, deadline=None)
def test_stretches_are_the_best_of_all(seed, least):
    n, width = 9, 5
    band = np.random.default_rng(seed).normal(size=(n, width))
    band[:, 0] = 0.0
    band[np.arange(n)[:, None] < np.arange(width)] = 0.0

    def inside(starts):
        bounds = itertools.pairwise([*starts, n])
        return sum(
            band[v, d] for a, b in bounds for v in range(a, b) for d in range(min(width, v - a + 1))
        )

    every = (
        [0, *cuts]
        for k in range(n // least)
        for cuts in itertools.combinations(range(1, n), k)
        if all(b - a >= least for a, b in itertools.pairwise([0, *cuts, n]))
    )
    best = max(every, key=inside)
    found = best_stretches(band, least)
    assert inside(found) == pytest.approx(inside(best))
    assert all(b - a >= least for a, b in itertools.pairwise([*found, n]))


def test_stretches_of_one_distribution_mix():
    rng = np.random.default_rng(3)
    centres = (0.0, 8.0, 0.0, 8.0, 0.0)
    points = np.concatenate([c + rng.normal(size=(60, 2)) for c in centres])
    assert group(points, range(0, 300, 60), 5, 20, 0.5).tolist() == [0, 1, 0, 1, 0]
    assert group(points, [0], 5, 20, 0.5).tolist() == [0]
    near = nearest_in_each(points, range(0, 300, 60), 5, 20)
    others = [j for j in range(60) if abs(j - 30) > 5]
    expected = np.sort(((points[30] - points[others]) ** 2).sum(axis=1))[:20]
    np.testing.assert_allclose(near[30, 0], expected, rtol=1e-5)


def test_a_skeleton_keeps_its_height_and_loses_its_place():
    root = tuple(f"hips.{axis}" for axis in ("tx", "tz", "ty", "rz", "rx", "ry"))
    frames = np.arange(18.0).reshape(2, 9)
    postures = postures_of(frames, (*root, "knee.rx", "spine.tz", "LeftHand.rz"))
    np.testing.assert_allclose(postures, frames[:, [1, 6, 7]] * [1.0, 0.2, 1.0])


def test_a_robots_features_are_seen_as_a_body():
    channels = feature_channels()
    frames = np.zeros((3, len(channels)))
    np.testing.assert_array_equal(postures_of(frames, channels), view_of(channels).see(frames))
    np.testing.assert_array_equal(postures_of(frames[:, :2], ("x", "y")), frames[:, :2])

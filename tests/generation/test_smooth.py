import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.generation.joins import drawn_from, joined
from mplearn.generation.smooth import most_likely_trajectory


def dense_solution(means, variances, states, rate_hz):
    """Solve the same least squares with whole matrices, channel by channel."""
    n_frames = len(states)
    identity = np.eye(n_frames)
    velocity = np.zeros((n_frames, n_frames))
    acceleration = np.zeros((n_frames, n_frames))
    for t in range(1, n_frames - 1):
        velocity[t, [t - 1, t + 1]] = -rate_hz / 2, rate_hz / 2
        acceleration[t, [t - 1, t, t + 1]] = rate_hz**2, -2 * rate_hz**2, rate_hz**2
    w = np.concatenate([identity, velocity, acceleration])
    solution = []
    for d in range(means.shape[2]):
        u = 1 / variances[:, states, d].ravel()
        mu = means[:, states, d].ravel()
        solution.append(np.linalg.solve(w.T @ (u[:, None] * w), w.T @ (u * mu)))
    return np.transpose(solution)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 40), st.integers(1, 4), st.integers(0, 2**32), st.sampled_from([20.0, 100.0]))
def test_the_banded_solution_is_the_dense_one(n_frames, n_channels, seed, rate_hz):
    rng = np.random.default_rng(seed)
    shape = (3, 5, n_channels)
    scale = np.array([1.0, 5.0, 50.0])[:, None, None]
    means = scale * rng.standard_normal(shape)
    variances = scale**2 * rng.uniform(0.01, 1.0, shape)
    states = np.sort(rng.integers(0, 5, n_frames))
    found = most_likely_trajectory(means, variances, states, rate_hz)
    np.testing.assert_allclose(
        found, dense_solution(means, variances, states, rate_hz), rtol=1e-7, atol=1e-8
    )


def test_a_start_holds_at_rest_and_its_trace_is_lost():
    means = np.zeros((3, 1, 2))
    variances = np.array([0.1, 1.0, 20.0])[:, None, None] * np.ones((3, 1, 2))
    states = np.zeros(300, dtype=np.int64)
    found = most_likely_trajectory(means, variances, states, 100.0, np.array([1.0, -2.0]))
    np.testing.assert_allclose(found[0], [1.0, -2.0], atol=1e-6)
    np.testing.assert_allclose(found[1], found[0], atol=1e-6)
    np.testing.assert_allclose(found[-1], 0.0, atol=1e-3)
    assert np.abs(np.diff(found, n=2, axis=0)).max() * 100**2 < 200


def test_steps_become_a_smooth_course():
    means = np.zeros((3, 2, 1))
    means[0, 1] = 1.0
    variances = np.array([0.05, 1.0, 30.0])[:, None, None] * np.ones((3, 2, 1))
    course = most_likely_trajectory(means, variances, np.repeat([0, 1], 100), 100.0)[:, 0]
    assert (np.diff(course) > -1e-3).all()
    assert np.abs(np.diff(course)).max() < 0.05
    assert (course[0], course[-1]) == (pytest.approx(0, abs=0.02), pytest.approx(1, abs=0.02))


@given(st.integers(2, 60), st.floats(0.0, 0.5), st.integers(0, 2**32))
def test_a_blend_starts_as_asked_and_returns_to_the_course(n_frames, blend_s, seed):
    rng = np.random.default_rng(seed)
    rate = 100.0
    frames = np.cumsum(0.01 * rng.standard_normal((n_frames, 2)), axis=0)
    posture, velocity = rng.standard_normal(2), rng.standard_normal(2)
    bent = drawn_from(frames, posture, velocity, rate, blend_s)
    np.testing.assert_allclose(bent[0], posture)
    back = int(np.ceil(blend_s * rate)) + 1
    np.testing.assert_allclose(bent[back:], frames[back:], atol=1e-9)


def test_a_blend_has_the_velocity_asked_for_in_the_limit():
    rate = 100_000.0
    t = np.arange(50_000)[:, None] / rate
    frames = np.sin(3 * t) * np.array([1.0, -2.0])
    posture, velocity = np.array([0.4, 0.1]), np.array([2.0, -1.0])
    bent = drawn_from(frames, posture, velocity, rate, 0.2)
    np.testing.assert_allclose((bent[1] - bent[0]) * rate, velocity, atol=1e-3)
    curvature = np.diff(bent - frames, n=2, axis=0) * rate**2
    assert np.abs(np.diff(curvature, axis=0)).max() < 1.0  # no kink anywhere


def test_joined_pieces_are_continuous_in_velocity():
    t = np.linspace(0, 1, 100)[:, None]
    pieces = [np.sin(2 * t), 5 + np.cos(4 * t), -3 * t]
    motion = joined(pieces, 100.0, 0.2)
    assert len(motion) == 300
    free = np.abs(np.diff(motion, axis=0)).max()
    assert free < 1.9 * 8 / 0.2 / 100  # the largest gap within the blend, no jump
    for join in (100, 200):
        around = np.diff(motion[join - 2 : join + 2], axis=0).ravel()
        np.testing.assert_allclose(around[1], around[0], atol=1e-9)

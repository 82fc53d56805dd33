"""The average of many draws against whole matrices."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.generation.averaging import average_of_motions, stretched


def whole(columns):
    """Return the matrices, shape (D, T, T), of their columns from the diagonal down."""
    n = len(columns)
    out = np.zeros((columns.shape[2], n, n))
    for t in range(n):
        for i in range(min(columns.shape[1], n - t)):
            out[:, t + i, t] = out[:, t, t + i] = columns[t, i]
    return out


def matrix_of(n_drawn, n_frames):
    """Return what stretches a motion linearly, shape (n_frames, n_drawn)."""
    place = np.linspace(0, n_drawn - 1, n_frames)
    return np.stack([np.interp(place, np.arange(n_drawn), row) for row in np.eye(n_drawn)], axis=1)


class Given:
    """Noise that is given instead of drawn."""

    def __init__(self, noise):
        self.noise = noise

    def standard_normal(self, shape):
        assert shape == self.noise.shape
        return self.noise


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 6), st.integers(1, 4), st.integers(1, 30), st.integers(1, 9), st.integers(0, 99)
)
def test_an_average_has_the_distribution_of_the_average_of_draws(
    n_motions, n_states, n_frames, longest, seed
):
    """Mean and covariance from whole matrices; the covariance, up to 3, may well be singular."""
    rng = np.random.default_rng(seed)
    stays = rng.integers(1, longest + 1, (n_motions, n_states))
    means, variances = rng.standard_normal((n_states, 2)), rng.uniform(0, 3, (n_states, 2))
    mean, covariance = np.zeros((n_frames, 2)), np.zeros((2, n_frames, n_frames))
    for own in stays:
        states, stretch = np.repeat(np.arange(n_states), own), matrix_of(own.sum(), n_frames)
        mean += stretch @ means[states] / n_motions
        for d in range(2):
            covariance[d] += stretch * variances[states, d] @ stretch.T / n_motions**2
    shares, products = stretched(stays, n_frames)
    np.testing.assert_allclose(shares @ means, mean, atol=1e-12)
    columns = products @ variances
    np.testing.assert_allclose(whole(columns), covariance, atol=1e-12)
    unit = np.eye(n_frames)
    rows = [
        average_of_motions(0 * means, variances, stays, n_frames, Given(np.stack([one, one], 1)))
        for one in unit
    ]
    factor = np.stack(rows, axis=1)  # L of each channel, by columns
    np.testing.assert_allclose(np.einsum("ikd,jkd->dij", factor, factor), covariance, atol=1e-8)
    drawn = average_of_motions(means, variances, stays, n_frames, Given(np.zeros((n_frames, 2))))
    np.testing.assert_allclose(drawn, mean, atol=1e-12)

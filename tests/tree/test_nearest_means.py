"""The search sums no further than it must, and finds the same leaves."""

import numpy as np
import pytest

from mplearn.tree.nodes.search import _squared_offsets


@pytest.mark.parametrize("width", [1, 3, 63, 64, 66, 190])
def test_the_nearest_means_are_those_of_brute_force(width: int) -> None:
    rng = np.random.default_rng(width)
    means = rng.normal(0, 1, (300, width))
    means[7] = means[123]  # equally far
    profile = means[123] + rng.normal(0, 0.3, width)
    parts = np.split(rng.permutation(300), [40, 41, 200])
    best = np.full(6, np.inf)
    found = np.concatenate([_squared_offsets(means, rows, profile, best) for rows in parts])
    far = ((means[np.concatenate(parts)] - profile) ** 2).sum(axis=1)
    nearest = np.argsort(far, kind="stable")[:6]
    assert set(np.argsort(found, kind="stable")[:6]) == set(nearest)
    np.testing.assert_allclose(found[nearest], far[nearest])
    np.testing.assert_allclose(best, far[nearest])
    assert (np.isinf(found) | np.isclose(found, far)).all()

"""The search sums no further than it must, and finds the same leaves."""

import numpy as np
import pytest

from mplearn.tree import TreeConfig
from mplearn.tree.exemplars.bank import ExemplarBank
from mplearn.tree.nodes.search import NodeIndex, _squared_offsets


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


@pytest.mark.parametrize(
    ("seed", "away", "size"),
    [(0, 0.0, 1.0), (1, 0.0, 1.0), (2, 0.0, 1.0), (3, 3e3, 1.0), (4, 1e8, 1.0), (5, 0.0, 1e22)],
)
def test_few_means_are_looked_at_in_full_and_the_nearest_are_found(
    seed: int, away: float, size: float
) -> None:
    """Also far from zero, and where squares are too large for single precision."""
    rng, config = np.random.default_rng(seed), TreeConfig(n_candidates=5)
    bank = ExemplarBank(config, 3, np.full(3, 0.01))
    index = NodeIndex(config, bank)
    for number in range(700):  # more than a block of slots
        noise = rng.normal(0, rng.choice([0.05, 1.0]), (config.normalisation.n_points, 3))
        frames = size * (noise + rng.normal(0, 1, 3) * (number % 7)) + away
        bank.add(number, bank.model(frames))
        index.enter((number + 1, 0, True, 1.0), [number], bank)
    index.drop(300)
    copy = bank.model(bank[20].columns.T)  # as near as can be
    for exemplar in (copy, *(bank[int(n)] for n in rng.integers(0, 700, 20))):
        profile = bank.profile(exemplar)
        means = np.array([bank.mean_profile(numbers) for numbers in index.members])
        far = ((means - profile) ** 2).sum(axis=1)
        wanted = np.sort(index.ids[np.argsort(far, kind="stable")[:5]])
        assert index.near(exemplar, bank) == wanted.tolist()

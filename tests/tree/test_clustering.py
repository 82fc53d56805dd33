"""Complete linkage, against scipy's."""

import numpy as np
import pytest
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import pdist, squareform

from mplearn.tree.nodes.clustering import clusters_below, complete_linkage, two_branches


def distances(seed: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return distances of points in groups, condensed and as a matrix."""
    rng = np.random.default_rng(seed)
    centres = rng.normal(0, 2, (5, 3))
    condensed = pdist(centres[rng.integers(5, size=n)] + rng.normal(0, 0.5, (n, 3)))
    return condensed, squareform(condensed)


@pytest.mark.parametrize("n", [2, 3, 12, 13, 60])
@pytest.mark.parametrize("seed", range(3))
def test_the_joins_are_scipys(n: int, seed: int) -> None:
    condensed, matrix = distances(seed, n)
    expected = linkage(condensed, "complete")
    merges, homes = complete_linkage(matrix, np.inf)
    np.testing.assert_array_equal(merges, expected)
    assert (homes == 0).all()
    branches = two_branches(matrix, 2)
    assert branches is None or sorted(np.concatenate(branches)) == list(range(n))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("least", [1, 2, 3])
def test_clusters_are_scipys(seed: int, least: int) -> None:
    condensed, matrix = distances(seed, 40)
    for cutoff in np.quantile(condensed, [0.0, 0.05, 0.3, 1.0]):
        labels = fcluster(linkage(condensed, "complete"), cutoff, "distance")
        expected = {tuple(np.flatnonzero(labels == label).tolist()) for label in set(labels)}
        found = clusters_below(matrix, cutoff, least)
        assert {tuple(each.tolist()) for each in found} == {e for e in expected if len(e) >= least}
        widths = [matrix[np.ix_(each, each)].max() for each in found]
        assert widths == sorted(widths)
    assert clusters_below(matrix, -1.0, least) == []
    assert clusters_below(matrix, np.nan, least) == []


def test_copies_are_one_cluster_each() -> None:
    at = np.array([0.0, 0.0, 0.0, 3.0, 3.0, 9.0])
    found = clusters_below(np.abs(at[:, None] - at), 1.0, 2)
    assert sorted(each.tolist() for each in found) == [[0, 1, 2], [3, 4]]

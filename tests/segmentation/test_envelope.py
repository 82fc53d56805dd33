"""The switching cost that the data choose, against all paths written out."""

from itertools import pairwise, product

import numpy as np
import pytest
from known_motions import bell_motions, mackey_glass

from mplearn.errors import InvalidValueError
from mplearn.evaluation.boundaries import Boundary, match_boundaries
from mplearn.segmentation import KohlmorgenLemm, KohlmorgenLemmConfig, ZeroVelocityConfig
from mplearn.segmentation.envelope import costs_by_count, longest_range


@pytest.mark.parametrize("seed", range(5))
def test_costs_by_count_are_those_of_the_cheapest_paths(seed):
    distances = np.random.default_rng(seed).uniform(size=(6, 4))
    cheapest = np.full(7, np.inf)
    for path in product(range(4), repeat=6):
        count = 1 + sum(a != b for a, b in pairwise(path))
        cost = sum(distances[t, s] for t, s in enumerate(path))
        cheapest[count] = min(cheapest[count], cost)
    # a path may stay where it is and still count as a change: at most, not exactly, n segments
    at_most = np.minimum.accumulate(cheapest[1:])
    np.testing.assert_allclose(costs_by_count(distances, 6), at_most, atol=1e-12)


def test_the_longest_range_is_the_one_that_a_scan_over_all_costs_finds():
    costs = np.array([10.0, 9.0, 4.0, 3.2, 3.0, 2.9, 2.85])
    scanned = [
        1 + int(np.argmin(costs + c * np.arange(len(costs)))) for c in np.arange(0.0005, 12, 0.001)
    ]
    counts = {n: scanned.count(n) for n in set(scanned) - {1, len(costs)}}
    n, low, high = longest_range(costs)
    assert n == max(counts, key=lambda count: counts[count]) == 3
    assert high - low == pytest.approx(1e-3 * counts[3], abs=2e-3)


def test_where_no_change_saves_anything_there_is_one_segment():
    n, low, high = longest_range(np.array([10.0, 9.9, 9.85, 9.8]))
    assert n == 1
    assert low < 0.2 < high


def test_mackey_glass_modes_are_found_without_a_given_cost():
    config = KohlmorgenLemmConfig(
        density="posture",
        embedding=6,
        delay_s=0.01,
        window_s=0.5,
        fifo_s=15.0,
        switch_cost_s=None,
        sigma=0.8,
        neighbours_s=0.06,
        zero_velocity=ZeroVelocityConfig(max_length_s=30.0),
    )
    found, truth = [], []
    for seed in (1, 2, 3):
        series, ends = mackey_glass(10, 300, seed)
        segments = KohlmorgenLemm(1, 100.0, config).segment(series[:, None])
        found += [s.end + 10_000 * seed for s in segments[:-1]]
        truth += [t + 10_000 * seed for t in ends]
    pairs = match_boundaries(
        [Boundary(t, t) for t in truth], [Boundary(f, f) for f in found], tolerance_frames=25
    )
    assert 2 * len(pairs) / (len(found) + len(truth)) >= 0.7


def test_the_unit_of_the_motion_does_not_matter_to_the_cost():
    frames, _ = bell_motions(12, 4, 50.0, seed=4, noise=1e-3)
    config = KohlmorgenLemmConfig(switch_cost_s=None)
    plain = KohlmorgenLemm(4, 50.0, config).segment(frames)
    scaled = KohlmorgenLemm(4, 50.0, config).segment(1000.0 * frames)
    assert [(s.start, s.end) for s in plain] == [(s.start, s.end) for s in scaled]


def test_an_exact_path_needs_a_cost():
    with pytest.raises(InvalidValueError, match="switch_cost_s"):
        KohlmorgenLemmConfig(exact=True, switch_cost_s=None)

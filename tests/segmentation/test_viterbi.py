"""Paths through window states, against all paths written out."""

from itertools import pairwise, product

import numpy as np
import pytest
from densities import density_distance
from known_motions import mackey_glass

from mplearn.evaluation.boundaries import Boundary, match_boundaries
from mplearn.recording import Segment
from mplearn.segmentation import KohlmorgenLemm, KohlmorgenLemmConfig, ZeroVelocityConfig
from mplearn.segmentation.viterbi import (
    exact_changes,
    exact_path,
    extend_path,
    last_changes,
    new_path,
)
from mplearn.segmentation.windows import new_windows, push_point

ONE = np.ones(1)  # all channels alike


def extend(t, first, distances, path):
    """One step of the on-line path over a ring that loses nothing."""
    extend_path(t, first, first, distances, path)


def cost_of(distances, states, cost):
    switches = sum(a != b for a, b in pairwise(states))
    return sum(distances[t, s] for t, s in enumerate(states)) + cost * switches


@pytest.mark.parametrize("seed", range(12))
def test_exact_path_is_the_cheapest_of_all(seed):
    rng = np.random.default_rng(seed)
    distances, cost = rng.uniform(size=(6, 4)), rng.uniform(0.05, 0.8)
    states = np.zeros(6, dtype=np.int64)
    total = exact_path(distances, np.full(6, cost), states)
    cheapest = min(cost_of(distances, path, cost) for path in product(range(4), repeat=6))
    assert total == pytest.approx(cheapest, abs=1e-12)
    assert cost_of(distances, list(states), cost) == pytest.approx(cheapest, abs=1e-12)


def windows_of(points, length, sigma):
    ends = range(length - 1, len(points))
    return np.array(
        [
            [
                density_distance(
                    points[s - length + 1 : s + 1], points[t - length + 1 : t + 1], sigma
                )
                for s in ends
            ]
            for t in ends
        ]
    )


def test_online_path_costs_hardly_more_than_the_exact_one():
    same, worst = 0, 0.0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        centres = rng.normal(size=(3, 2)) * 2
        points = centres[np.repeat(rng.integers(0, 3, 5), 10)] + rng.normal(size=(50, 2)) * 0.3
        length, cost, size = 3, 1.5, 90
        windows, path = new_windows(2, length, size - length), new_path(size)
        path.switch_costs[:] = cost
        for t in range(len(points)):
            push_point(points[t], ONE, t, 1.0, windows)
            if t >= length - 1:
                extend(t, length - 1, windows.distances, path)
        distances = windows_of(points, length, 1.0)
        states = np.zeros(len(distances), dtype=np.int64)
        exact = exact_path(distances, np.full(len(distances), cost), states)
        online = path.best_costs[(len(points) - 1) % size]
        assert online >= exact - 1e-9
        same += abs(online - exact) < 1e-9
        worst = max(worst, online / exact - 1.0)
    assert same >= 12
    assert worst < 0.05


def test_changes_of_a_clear_switch():
    points = np.repeat([[0.0], [5.0], [0.0]], 30, axis=0)
    length, size = 4, 100
    windows, path = new_windows(1, length, size - length), new_path(size)
    matrix = np.zeros((size, size))
    path.switch_costs[:] = 2.0
    for t in range(90):
        push_point(points[t], ONE, t, 0.5, windows)
        if t >= length - 1:
            extend(t, length - 1, windows.distances, path)
            for s in range(length - 1, t + 1):
                matrix[s, t] = matrix[t, s] = windows.distances[s]
    found = np.zeros(8, dtype=np.int64)
    n = last_changes(89, length - 1, path.best_entered, found)
    assert n == 2
    assert abs(found[0] - 60 - length // 2) <= 2
    assert abs(found[1] - 30 - length // 2) <= 2
    assert exact_changes(matrix, path.switch_costs, length - 1, 89, found) == 2
    assert abs(found[0] - 60 - length // 2) <= 2


def f1(found, truth, tolerance):
    pairs = match_boundaries(
        [Boundary(t, t) for t in truth], [Boundary(int(f), int(f)) for f in found], tolerance
    )
    return 2 * len(pairs) / (len(found) + len(truth))


def test_switching_mackey_glass_series_exactly():
    found_all, truth_all = [], []
    for seed in range(2):
        series, truth = mackey_glass(10, 300, seed)
        m, length = 6, 50
        points = np.stack([series[m - 1 - j : len(series) - j] for j in range(m)], axis=1)
        squared = ((points[:, None] - points[None]) ** 2).sum(axis=2)
        sigma = 1.5 * np.sqrt(np.sort(squared, axis=1)[:, 1 : m + 1]).mean()
        n = len(points)
        windows = new_windows(m, length, n)
        distances = np.zeros((n, n))
        for t in range(n):
            push_point(points[t], ONE, t, sigma, windows)
            distances[t, :t] = distances[:t, t] = windows.distances[:t]
        distances = distances[length - 1 :, length - 1 :]
        states = np.zeros(len(distances), dtype=np.int64)
        exact_path(distances, np.full(len(distances), 40 * distances.mean()), states)
        changes = np.flatnonzero(np.diff(states)) + length + m - 1 - length // 2 - (m - 1) // 2
        found_all += list(changes + 10_000 * seed)
        truth_all += [t + 10_000 * seed for t in truth]
    assert f1(found_all, truth_all, 25) >= 0.95


def test_switching_mackey_glass_series_online():
    config = KohlmorgenLemmConfig(
        density="posture",
        embedding=6,
        delay_s=0.01,
        window_s=0.5,
        fifo_s=15.0,
        switch_cost_s=0.03,
        sigma=0.8,
        neighbours_s=0.06,
        zero_velocity=ZeroVelocityConfig(max_length_s=30.0),
    )
    found, truth = [], []
    for seed in range(2):
        series, ends = mackey_glass(10, 300, seed)
        segments: list[Segment] = KohlmorgenLemm(1, 100.0, config).segment(series[:, None])
        found += [s.end + 10_000 * seed for s in segments[:-1]]
        truth += [t + 10_000 * seed for t in ends]
    assert f1(found, truth, 25) >= 0.85

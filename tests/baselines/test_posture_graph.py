import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mplearn.baselines import PostureGraph, minimum_error_split
from mplearn.errors import FrameError, InvalidValueError


def kittler(values, threshold):
    """The criterion as published, term by term."""
    total = 1.0
    for part in (values[values <= threshold], values[values > threshold]):
        share = len(part) / len(values)
        sigma = max(part.std() / values.std(), 1e-3)
        total += 2 * share * (np.log(sigma) - np.log(share))
    return total


@given(st.lists(st.integers(-50, 50), min_size=4, max_size=40), st.integers(1, 5))
def test_the_threshold_is_the_best_of_all(values, smallest):
    values = np.array(values) / 7.0
    levels = np.unique(values)
    middles = 0.5 * (levels[:-1] + levels[1:])
    allowed = [t for t in middles if min((values <= t).sum(), (values > t).sum()) >= smallest]
    found = minimum_error_split(values, smallest)
    if not allowed:
        assert found is None
        return
    best = min(kittler(values, t) for t in allowed)
    assert kittler(values, found) == pytest.approx(best, abs=1e-6)


def test_two_normal_classes_are_told_apart_where_bayes_would():
    rng = np.random.default_rng(0)
    narrow, wide = rng.normal(0, 1, 6000), rng.normal(8, 2, 3000)
    threshold = minimum_error_split(np.concatenate([narrow, wide]), 10)
    x = np.linspace(0, 8, 8001)  # where weighted densities cross
    difference = np.log(2 / 1) - 0.5 * x**2 - (np.log(1 / 2) - 0.5 * ((x - 8) / 2) ** 2)
    crossing = x[np.argmax(difference < 0)]
    assert threshold == pytest.approx(crossing, abs=0.35)


def walking_round(n_rounds, postures, frames_each, rng):
    """A stream that stays in one posture after another."""
    order = np.tile(np.arange(len(postures)), n_rounds)
    stays = np.repeat(order, frames_each)
    return postures[stays] + 0.01 * rng.normal(size=(len(stays), postures.shape[1])), stays


def test_clusters_are_found_and_their_order_is_counted():
    rng = np.random.default_rng(1)
    postures = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1.0]])
    frames, stays = walking_round(30, postures, 20, rng)
    graph = PostureGraph.build(frames, 50.0, smallest=60)
    assert len(graph.leaves) >= 4
    inside = (stays == np.roll(stays, 1)) & (stays == np.roll(stays, -1))  # no jump beside it
    for leaf in np.unique(graph.leaf_of[inside]):
        held = np.bincount(stays[inside & (graph.leaf_of == leaf)], minlength=4)
        assert held.max() > 0.95 * held.sum()
    assert graph.edges[:, 2].sum() == len(frames) - 1
    counted = {(i, j): n for i, j, n in graph.edges.tolist()}
    pairs = zip(graph.leaf_of, graph.leaf_of[1:], strict=False)
    for pair in {(int(i), int(j)) for i, j in pairs}:
        both = (graph.leaf_of[:-1] == pair[0]) & (graph.leaf_of[1:] == pair[1])
        assert counted[pair] == both.sum()


def test_every_node_holds_enough_and_the_mean_of_what_is_below():
    rng = np.random.default_rng(2)
    frames = np.cumsum(rng.normal(size=(800, 5)), axis=0)
    graph = PostureGraph.build(frames, 100.0, smallest=20)
    sizes = np.bincount(graph.leaf_of, minlength=len(graph.parents))
    assert (sizes[graph.leaves] >= 20).all()
    assert sizes.sum() == len(frames)
    assert len(graph.parents) == 2 * len(graph.leaves) - 1  # binary
    np.testing.assert_allclose(graph.means[0, :5], frames.mean(axis=0))
    leaf = graph.leaves[0]
    np.testing.assert_allclose(graph.means[leaf, :5], frames[graph.leaf_of == leaf].mean(axis=0))
    again = PostureGraph.build(frames, 100.0, smallest=20)
    np.testing.assert_array_equal(again.leaf_of, graph.leaf_of)
    assert graph.n_bytes > 0


def test_bad_input_is_named():
    with pytest.raises(FrameError, match="finite"):
        PostureGraph.build(np.full((9, 2), np.nan), 100.0)
    with pytest.raises(FrameError, match="two"):
        PostureGraph.build(np.zeros((1, 2)), 100.0)
    with pytest.raises(InvalidValueError, match="rate_hz"):
        PostureGraph.build(np.zeros((5, 2)), 0.0)
    still = PostureGraph.build(np.zeros((50, 2)), 100.0, smallest=3)
    assert still.leaves.tolist() == [0]

"""The recursions against brute force over all state paths, hmmlearn and scipy."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp
from scipy.stats import norm

from mplearn.errors import FrameError, InvalidValueError, ModelError
from mplearn.hmm import LeftRightHMM, from_hmmlearn, score_batch, to_hmmlearn


def random_model(rng, n_states=4, n_channels=3, spread=1.0):
    stay = np.append(rng.uniform(0.2, 0.95, n_states - 1), 1.0)
    return LeftRightHMM(
        rng.normal(0, spread, (n_states, n_channels)),
        rng.uniform(0.05, 1.0, (n_states, n_channels)),
        np.log(stay),
    )


def brute_force(model, frames, weights, complete):
    """Log-joint of every state path, with the paths."""
    emission = weights[:, None] * np.nansum(
        norm.logpdf(frames[:, None], model.means, np.sqrt(model.variances)), axis=2
    )
    paths, scores = [], []
    for moves in product((0, 1), repeat=len(frames) - 1):
        path = np.concatenate([[0], np.cumsum(moves)]).astype(int)
        if path[-1] >= model.n_states or (complete and path[-1] != model.n_states - 1):
            continue
        steps = np.where(moves, model.log_next[path[:-1]], model.log_stay[path[:-1]])
        paths.append(path)
        scores.append(emission[np.arange(len(frames)), path].sum() + steps.sum())
    return np.array(paths), np.array(scores)


@pytest.mark.parametrize("complete", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_all_recursions_equal_brute_force(seed, complete):
    rng = np.random.default_rng(seed)
    model = random_model(rng)
    frames = rng.normal(0, 1, (9, 3))
    frames[rng.random(frames.shape) < 0.15] = np.nan
    weights = rng.uniform(0, 1.5, 9)
    paths, scores = brute_force(model, frames, weights, complete)
    assert model.score(frames, weights, complete=complete) == pytest.approx(
        logsumexp(scores), abs=1e-10
    )
    np.testing.assert_array_equal(
        model.decode(frames, weights, complete=complete), paths[scores.argmax()]
    )
    share = np.exp(scores - logsumexp(scores))
    expected = np.stack([(share[:, None] * (paths == n)).sum(0) for n in range(4)], axis=1)
    np.testing.assert_allclose(
        model.posteriors(frames, weights, complete=complete), expected, atol=1e-10
    )
    reached = model.forward(frames, weights)[-1]
    assert logsumexp(reached[-1:] if complete else reached) == pytest.approx(logsumexp(scores))


@pytest.mark.parametrize("far", [0.0, 30.0, 1000.0])
def test_score_equals_hmmlearn_near_and_far_from_the_data(far):
    rng = np.random.default_rng(3)
    model = random_model(rng, 6, 30)
    frames = rng.normal(far, 1, (100, 30))
    reference = to_hmmlearn(model).score(frames)
    assert model.score(frames, complete=False) == pytest.approx(reference, rel=1e-11)


def test_decoding_equals_hmmlearn():
    rng = np.random.default_rng(4)
    model = random_model(rng, 6, 5)
    frames = np.repeat(model.means, 7, axis=0) + rng.normal(0, 0.3, (42, 5))
    _, path = to_hmmlearn(model).decode(frames)
    np.testing.assert_array_equal(model.decode(frames, complete=False), path)


def test_a_missing_channel_counts_as_if_its_column_did_not_exist():
    rng = np.random.default_rng(5)
    model = random_model(rng, 5, 4)
    frames = rng.normal(0, 1, (30, 4))
    frames[:, 2] = np.nan
    kept = [0, 1, 3]
    smaller = LeftRightHMM(model.means[:, kept], model.variances[:, kept], model.log_stay)
    assert model.score(frames) == pytest.approx(smaller.score(frames[:, kept]), abs=1e-10)


def test_weights_of_zero_and_one_hide_and_keep_frames():
    rng = np.random.default_rng(6)
    model = random_model(rng, 3, 4)
    frames = rng.normal(0, 1, (20, 4))
    weights = (np.arange(20) % 3 > 0).astype(float)
    hidden = np.where(weights[:, None] > 0, frames, np.nan)
    assert model.score(frames, weights) == pytest.approx(model.score(hidden), abs=1e-10)


def test_the_end_must_be_reached():
    model = LeftRightHMM(np.arange(4.0)[:, None], np.full((4, 1), 0.01), np.log([0.8, 0.8, 0.8, 1]))
    whole = np.repeat(np.arange(4.0), 5)[:, None]
    beginning = whole[:10]
    assert model.score(beginning) < model.score(beginning, complete=False) - 100
    assert model.score(whole) == pytest.approx(model.score(whole, complete=False), abs=1e-3)
    assert model.score(whole[:3]) == -np.inf
    with pytest.raises(ModelError, match="4 states"):
        model.decode(whole[:3])


@given(st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_batch_equals_single_scores_whatever_is_scored_beside(seed):
    rng = np.random.default_rng(seed)
    models = [random_model(rng, int(rng.integers(1, 7)), 3) for _ in range(3)]
    sequences = [rng.normal(0, 1, (int(rng.integers(1, 30)), 3)) for _ in range(4)]
    scores = score_batch(models, sequences)
    for m, model in enumerate(models):
        for s, frames in enumerate(sequences):
            assert scores[m, s] == model.score(frames)


def test_many_cores_give_the_same_bits():
    rng = np.random.default_rng(8)
    models = [random_model(rng, 8, 30) for _ in range(20)]
    sequences = [rng.normal(0, 1, (int(rng.integers(80, 120)), 30)) for _ in range(60)]
    together = score_batch(models, sequences)
    alone = np.concatenate([score_batch([model], sequences) for model in models])
    np.testing.assert_array_equal(together, alone)


def test_hmmlearn_round_trip():
    model = random_model(np.random.default_rng(9), 5, 3)
    back = from_hmmlearn(to_hmmlearn(model))
    np.testing.assert_allclose(back.means, model.means)
    np.testing.assert_allclose(back.variances, model.variances)
    np.testing.assert_allclose(back.log_stay, model.log_stay)


def test_models_of_another_kind_are_refused():
    other = to_hmmlearn(random_model(np.random.default_rng(9), 3, 2))
    other.transmat_ = np.full((3, 3), 1 / 3)
    with pytest.raises(ModelError, match="left-right"):
        from_hmmlearn(other)
    other.covariance_type = "full"
    with pytest.raises(ModelError, match="'full'"):
        from_hmmlearn(other)


def test_bad_parameters_and_frames_are_refused():
    good = np.zeros((2, 3)), np.ones((2, 3)), np.log([0.5, 1.0])
    LeftRightHMM(*good)
    for bad, message in [
        ((np.zeros(3), *good[1:]), "shape"),
        ((good[0], np.ones((2, 2)), good[2]), "shape"),
        ((np.full((2, 3), np.nan), *good[1:]), "finite"),
        ((good[0], np.zeros((2, 3)), good[2]), "positive"),
        ((*good[:2], np.log([0.5, 0.5])), "last"),
    ]:
        with pytest.raises(ModelError, match=message):
            LeftRightHMM(*bad)
    model = LeftRightHMM(*good)
    with pytest.raises(FrameError, match=r"\(T, 3\)"):
        model.score(np.zeros((5, 2)))
    with pytest.raises(FrameError, match="infinite"):
        model.score(np.full((5, 3), np.inf))
    with pytest.raises(InvalidValueError, match="weights"):
        model.score(np.zeros((5, 3)), np.zeros(5))
    with pytest.raises(ValueError, match="read-only"):
        model.means[0, 0] = 1.0

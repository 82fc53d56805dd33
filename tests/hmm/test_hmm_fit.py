"""Fitting against hmmlearn, additivity of the statistics, distance and choice of size."""

import numpy as np
import pytest
from em_steps import expected_statistics, model_of, no_statistics
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError, ModelError
from mplearn.hmm import SequenceBatch, distance, distance_matrix, em, fit, select_size, to_hmmlearn
from mplearn.hmm.selection import n_parameters


def motion(rng, n_frames=60, n_channels=5, phase=0.0, noise=0.05):
    time = np.linspace(0, 1, n_frames)[:, None]
    curve = np.sin(3 * time * np.arange(1, n_channels + 1) + phase)
    return curve + rng.normal(0, noise, (n_frames, n_channels))


def test_em_steps_equal_hmmlearn():
    from hmmlearn.hmm import GaussianHMM

    rng = np.random.default_rng(0)
    sequences = [motion(rng, n) for n in (50, 60, 75)]
    start = fit(sequences, 6, n_steps=0)
    reference = GaussianHMM(
        6,
        "diag",
        n_iter=4,
        tol=-np.inf,
        init_params="",
        params="tmc",
        implementation="log",
        min_covar=0.0,
        covars_prior=0.0,
        covars_weight=0.0,
        transmat_prior=2.0,
    )
    first = to_hmmlearn(start)
    reference.startprob_, reference.transmat_ = first.startprob_, first.transmat_
    reference.means_, reference.covars_ = first.means_, start.variances
    reference.fit(np.concatenate(sequences), [50, 60, 75])
    model = fit(sequences, 6, n_steps=4, tolerance=-np.inf, complete=False)
    np.testing.assert_allclose(model.means, reference.means_, atol=1e-9)
    np.testing.assert_allclose(model.variances, np.diagonal(reference.covars_, 0, 1, 2), atol=1e-9)
    np.testing.assert_allclose(np.exp(model.log_stay), np.diag(reference.transmat_), atol=1e-9)


def test_em_never_lowers_the_likelihood():
    rng = np.random.default_rng(1)
    sequences = [motion(rng, n) for n in (40, 55)]
    values = [
        sum(
            fit(sequences, 5, n_steps=n, tolerance=-np.inf, duration_prior=1e-9).score(s)
            for s in sequences
        )
        for n in range(8)
    ]
    assert np.all(np.diff(values) > -1e-8)


@given(st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_statistics_of_a_group_are_the_sum_over_its_exemplars(seed):
    rng = np.random.default_rng(seed)
    sequences = [motion(rng, int(rng.integers(10, 40))) for _ in range(3)]
    model = fit(sequences, 4)
    *whole, likelihood = expected_statistics(model, sequences)
    parts = [expected_statistics(model, [sequence]) for sequence in sequences]
    for total, of_parts in zip((*whole, likelihood), zip(*parts, strict=True), strict=True):
        np.testing.assert_allclose(total, sum(of_parts), atol=1e-8)
    mass, _, _, _, moves = whole
    assert mass[:, 0].sum() == pytest.approx(sum(map(len, sequences)))
    assert moves.sum() == pytest.approx(3 * 3)


def test_fit_equals_its_steps_taken_one_by_one():
    rng = np.random.default_rng(2)
    sequences = [motion(rng, n) for n in (40, 55)]
    weights = [rng.uniform(0.1, 1, n) for n in (40, 55)]
    batch = SequenceBatch.of(sequences, weights)
    split = no_statistics(5, 5)
    em.equal_split(batch.frames, batch.weights, batch.offsets, split)
    model = model_of((*split.emitted, split.stays, split.moves), 1e-3)
    for _ in range(3):
        model = model_of(expected_statistics(model, sequences, weights)[:5], 1e-3)
    direct = fit(sequences, 5, weights=weights, n_steps=3, tolerance=-np.inf, variance_floor=1e-3)
    np.testing.assert_allclose(direct.means, model.means, atol=1e-12)
    np.testing.assert_allclose(direct.variances, model.variances, atol=1e-12)
    np.testing.assert_allclose(direct.log_stay, model.log_stay, atol=1e-12)


def test_a_missing_channel_does_not_touch_the_others():
    rng = np.random.default_rng(3)
    frames = motion(rng, 60)
    broken = frames.copy()
    broken[10:25, 4] = np.nan
    model = fit([broken], 6, n_steps=0)
    np.testing.assert_array_equal(model.means[:, :4], fit([frames], 6, n_steps=0).means[:, :4])
    np.testing.assert_allclose(model.means[5, 4], frames[50:, 4].mean())
    assert np.isfinite(fit([broken], 6).score(broken))


def test_a_state_that_never_saw_a_channel_lies_between_its_neighbours():
    frames = motion(np.random.default_rng(3), 60)
    frames[10:30, 2] = np.nan  # all of states 1 and 2 of 6
    means = fit([frames], 6, n_steps=0).means[:, 2]
    np.testing.assert_allclose(np.diff(means[:4]), (means[3] - means[0]) / 3)


def test_the_floor_holds():
    floor = np.array([0.1, 1e-4, 0.2, 1e-4, 0.3])
    model = fit([motion(np.random.default_rng(4))], 8, variance_floor=floor)
    assert (model.variances >= floor).all()
    assert (model.variances[:, 0] == 0.1).any()


def test_bad_input_is_named():
    frames = motion(np.random.default_rng(5), 6)
    with pytest.raises(ModelError, match=r"8 states need .* 8 frames, not 6"):
        fit([frames], 8)
    with pytest.raises(ModelError, match="variance_floor"):
        fit([frames], 2, variance_floor=0.0)
    with pytest.raises(InvalidValueError, match="n_states"):
        fit([frames], 0)
    frames[:, 3] = np.nan
    with pytest.raises(ModelError, match=r"\[3\] were never measured"):
        fit([frames], 2)


def test_distance_is_symmetric_small_inside_and_large_between_motions():
    rng = np.random.default_rng(6)
    sequences = [motion(rng, 50), motion(rng, 70), motion(rng, 60, phase=1.0)]
    models = [fit([s], 6, variance_floor=0.05) for s in sequences]
    matrix = distance_matrix(models, sequences)
    np.testing.assert_array_equal(matrix, matrix.T)
    np.testing.assert_array_equal(np.diag(matrix), 0)
    assert matrix[0, 2] > 10 * matrix[0, 1] > 0
    pair = distance(models[0], sequences[:1], models[2], sequences[2:])
    assert pair == pytest.approx(matrix[0, 2])
    swapped = distance(models[2], sequences[2:], models[0], sequences[:1])
    assert swapped == pytest.approx(pair)


def test_distance_is_the_formula_of_the_paper():
    rng = np.random.default_rng(7)
    one, two = [motion(rng, 50), motion(rng, 60)], [motion(rng, 55, phase=0.5)]
    a, b = fit(one, 4, variance_floor=0.05), fit(two, 4, variance_floor=0.05)
    forth = np.mean([(a.score(s) - b.score(s)) / len(s) for s in one])
    back = (b.score(two[0]) - a.score(two[0])) / 55
    assert distance(a, one, b, two) == pytest.approx((forth + back) / 2)


def test_the_right_size_is_found():
    rng = np.random.default_rng(8)
    steps = rng.normal(0, 3, (4, 6))
    sequences = [np.repeat(steps, 15, axis=0) + rng.normal(0, 0.1, (60, 6)) for _ in range(4)]
    chosen = select_size(sequences, range(1, 9))
    assert chosen.n_states == chosen.model.n_states == 4
    assert chosen.criterion[4] == min(chosen.criterion.values())
    assert n_parameters(4, 6) == 4 * 6 + 4 * 6 + 3
    with pytest.raises(InvalidValueError, match="'hqc'"):
        select_size(sequences, criterion="hqc")
    with pytest.raises(InvalidValueError, match=r"\[1, 60\]"):
        select_size(sequences, (70, 80))

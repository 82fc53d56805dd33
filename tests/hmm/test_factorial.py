"""Factorial models, against every combination of paths written out and against hmmlearn."""

from itertools import product

import numpy as np
import pytest
from em_steps import expected_statistics, model_of
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import logsumexp
from scipy.stats import norm

from mplearn.errors import InvalidValueError, ModelError
from mplearn.hmm import (
    FactorialHMM,
    LeftRightHMM,
    add_chain,
    distance,
    em_step,
    fit,
    fit_factorial,
    needs_more_chains,
)
from mplearn.hmm.factorial.posterior import variational_moments


def random_model(rng, sizes=(2, 3), n_channels=2):
    return FactorialHMM(
        tuple(rng.normal(0, 1, (size, n_channels)) for size in sizes),
        tuple(np.append(np.log(rng.uniform(0.3, 0.9, size - 1)), 0.0) for size in sizes),
        rng.uniform(0.2, 1.0, n_channels),
    )


def chain_paths(chain, n_frames, complete):
    for moves in product((0, 1), repeat=n_frames - 1):
        path = np.concatenate([[0], np.cumsum(moves)]).astype(int)
        if path[-1] >= chain.n_states or (complete and path[-1] != chain.n_states - 1):
            continue
        steps = np.where(moves, chain.log_next[path[:-1]], chain.log_stay[path[:-1]])
        yield path, steps.sum()


def all_paths(model, frames, weights, complete=True):
    """State of each chain at each frame and the log-joint, for every combination of paths."""
    each = [list(chain_paths(chain, len(frames), complete)) for chain in model.chains]
    for combination in product(*each):
        paths = np.stack([path for path, _ in combination])
        output = sum(chain.means[p] for chain, p in zip(model.chains, paths, strict=True))
        seen = np.nansum(norm.logpdf(frames, output, np.sqrt(model.variances)), axis=1)
        yield paths, (weights * seen).sum() + sum(steps for _, steps in combination)


@pytest.mark.parametrize("complete", [True, False])
@pytest.mark.parametrize("sizes", [(2, 3), (2, 2, 2)])
def test_the_exact_posterior_is_that_of_all_combinations(sizes, complete):
    rng = np.random.default_rng(sum(sizes) + complete)
    model = random_model(rng, sizes)
    frames, weights = rng.normal(0, 1, (6, 2)), rng.uniform(0.2, 1.5, 6)
    frames[rng.random(frames.shape) < 0.15] = np.nan
    ways = list(all_paths(model, frames, weights, complete))
    total = logsumexp([score for _, score in ways])
    moments = model.moments(frames, weights, complete=complete, exact=True)
    assert moments.log_likelihood == pytest.approx(total, abs=1e-10)
    assert model.score(frames, weights, complete=complete) == pytest.approx(total, abs=1e-10)
    marginals, pairs = np.zeros((6, sum(sizes))), np.zeros((6, sum(sizes), sum(sizes)))
    starts = np.cumsum([0, *sizes[:-1]])
    for paths, score in ways:
        indicator = np.zeros((6, sum(sizes)))
        for start, path in zip(starts, paths, strict=True):
            indicator[np.arange(6), start + path] = 1.0
        marginals += np.exp(score - total) * indicator
        pairs += np.exp(score - total) * indicator[:, :, None] * indicator[:, None, :]
    np.testing.assert_allclose(moments.marginals, marginals, atol=1e-10)
    np.testing.assert_allclose(moments.pairs, pairs, atol=1e-10)


def test_the_likelihood_is_hmmlearns_on_the_product_chain():
    from hmmlearn.hmm import GaussianHMM

    rng = np.random.default_rng(5)
    model = random_model(rng, (3, 4), 5)
    joint = model.product
    other = GaussianHMM(12, "diag", implementation="log")
    other.n_features, other.startprob_ = 5, np.eye(12)[0]
    other.transmat_ = np.zeros((12, 12))
    for k, (before, steps) in enumerate(zip(joint.before, joint.log_steps, strict=True)):
        for i, step in zip(before[before >= 0], steps[before >= 0], strict=True):
            other.transmat_[i, k] = np.exp(step)
    np.testing.assert_allclose(other.transmat_.sum(axis=1), 1.0)
    other.means_ = model.means[0][joint.states[:, 0]] + model.means[1][joint.states[:, 1]]
    other.covars_ = np.tile(model.variances, (12, 1))
    frames = rng.normal(0, 2, (60, 5))
    assert model.score(frames, complete=False) == pytest.approx(other.score(frames), rel=1e-11)


@pytest.mark.parametrize("seed", range(5))
def test_the_bound_rises_and_stays_below_the_likelihood(seed):
    rng = np.random.default_rng(seed)
    model = random_model(rng, (3, 4, 2), 3)
    frames, weights = rng.normal(0, 1.5, (30, 3)), rng.uniform(0.2, 1.2, 30)
    frames[rng.random(frames.shape) < 0.1] = np.nan
    bounds = [
        variational_moments(model.chains, frames, weights, True, sweeps).log_likelihood
        for sweeps in range(1, 12)
    ]
    assert np.all(np.diff(bounds) >= -1e-9)
    assert bounds[-1] <= model.moments(frames, weights, exact=True).log_likelihood + 1e-9


def test_one_chain_is_a_left_right_hmm():
    rng = np.random.default_rng(8)
    single = random_model(rng, (5,), 3)
    twin = LeftRightHMM(single.means[0], np.tile(single.variances, (5, 1)), single.log_stays[0])
    frames = rng.normal(0, 1, (20, 3))
    frames[4:7, 1] = np.nan
    for exact in (True, False):
        moments = single.moments(frames, exact=exact)
        assert moments.log_likelihood == pytest.approx(twin.score(frames), abs=1e-9)
        np.testing.assert_allclose(moments.marginals, twin.posteriors(frames), atol=1e-9)
    stepped = em_step(single, [frames])
    reference = model_of(expected_statistics(twin, [frames])[:5])
    np.testing.assert_allclose(stepped.means[0], reference.means, atol=1e-9)
    np.testing.assert_allclose(stepped.log_stays[0], reference.log_stay, atol=1e-9)
    assert len(single.mean_motion()) == len(twin.mean_motion())


def two_limbs(rng, n_frames, turn):
    """Two limbs that step at times of their own, seen in channels that mix them."""
    arm = np.repeat([0.0, 2.0, 1.0], [turn, 10, n_frames - turn - 10])
    leg = np.repeat([0.0, -1.5], [n_frames // 2, n_frames - n_frames // 2])
    mixed = np.column_stack([arm, leg, arm + leg, arm - leg])
    return mixed + rng.normal(0, 0.1, mixed.shape)


@pytest.mark.parametrize("exact", [True, False])
def test_em_never_lowers_the_likelihood(exact):
    rng = np.random.default_rng(9)
    sequences = [two_limbs(rng, 40, int(rng.integers(5, 25))) for _ in range(4)]
    model = fit_factorial(sequences, (3, 2), n_steps=0)
    values = []
    for _ in range(8):
        values.append(sum(model.moments(s, exact=exact).log_likelihood for s in sequences))
        model = em_step(model, sequences, duration_prior=1e-9, exact=exact)
    assert np.all(np.diff(values) > -1e-6)
    assert values[-1] > values[0] + 10


def test_limbs_with_times_of_their_own_need_a_chain_each():
    rng = np.random.default_rng(10)
    train, unseen = (
        [two_limbs(rng, 40, int(rng.integers(3, 27))) for _ in range(12)] for _ in range(2)
    )
    chain = fit_factorial(train, (5,), n_steps=5)
    both = fit_factorial(train, (3, 2), n_steps=5)
    assert sum(both.score(s) for s in unseen) > sum(chain.score(s) for s in unseen) + 500


def test_an_added_chain_explains_what_was_left():
    rng = np.random.default_rng(11)
    sequences = [two_limbs(rng, 40, int(rng.integers(3, 27))) for _ in range(6)]
    single = fit(sequences, 2)
    grown = em_step(add_chain(single, sequences, 3), sequences)
    assert [chain.n_states for chain in grown.chains] == [2, 3]

    def left(explained):
        return sum(((s - explained(s)) ** 2).sum() for s in sequences)

    alone = left(lambda s: single.posteriors(s) @ single.means)
    assert left(grown.explained) < 0.5 * alone


def test_missing_channels_do_not_spoil_the_fit():
    rng = np.random.default_rng(12)
    sequences = [two_limbs(rng, 40, int(rng.integers(5, 25))) for _ in range(6)]
    broken = [s.copy() for s in sequences]
    for s in broken:
        s[rng.random(s.shape) < 0.2] = np.nan
    model = fit_factorial(broken, (3, 2), n_steps=8)
    assert np.sqrt(model.variances).max() < 0.5
    for s, b in zip(sequences, broken, strict=True):
        hidden = np.isnan(b)
        assert np.sqrt(((model.explained(b) - s)[hidden] ** 2).mean()) < 0.4
    broken[0][:, 2] = np.nan
    with pytest.raises(ModelError, match="never measured"):
        fit_factorial(broken[:1], (3, 2))


def test_a_chain_is_added_only_where_neighbours_look_alike():
    rng = np.random.default_rng(13)
    early = [two_limbs(rng, 40, int(rng.integers(3, 9))) for _ in range(6)]
    other = [3.0 + s for s in early]
    a, b = fit(early, 3, variance_floor=0.01), fit(other, 3, variance_floor=0.01)
    assert not needs_more_chains(a, early, b, other)
    again = [two_limbs(rng, 40, int(rng.integers(3, 9))) for _ in range(6)]
    assert needs_more_chains(a, early, fit(again, 3, variance_floor=0.01), again)


def test_it_generates_the_sum_of_its_chains():
    model = FactorialHMM(
        (np.array([[1.0], [2.0]]), np.array([[10.0], [20.0], [30.0]])),
        (np.log([0.5, 1.0]), np.log([0.75, 0.75, 1.0])),
        np.ones(1),
    )
    motion = model.mean_motion()[:, 0]
    np.testing.assert_array_equal(motion, [11, 11, 12, 12, *[22] * 4, *[32] * 4])
    assert model.score(motion[:, None]) > model.score(motion[::-1, None])


def test_distance_is_for_models_of_every_kind():
    rng = np.random.default_rng(14)
    one, two = ([two_limbs(rng, 40, turn) for _ in range(3)] for turn in (5, 20))
    a, b = (fit_factorial(s, (3, 2), n_steps=2, variance_floor=0.01) for s in (one, two))
    far = distance(a, one, b, two)
    assert far > 0
    assert far == pytest.approx(distance(b, two, a, one))
    forth = np.mean([(a.score(s) - b.score(s)) / 40 for s in one])
    back = np.mean([(b.score(s) - a.score(s)) / 40 for s in two])
    assert far == pytest.approx((forth + back) / 2)


def test_wrong_values_are_named():
    rng = np.random.default_rng(15)
    model = random_model(rng)
    assert model.score(np.zeros((2, 2))) == -np.inf
    with pytest.raises(ModelError, match="3 states"):
        model.moments(np.zeros((2, 2)))
    with pytest.raises(ModelError, match="log_stays"):
        FactorialHMM(model.means, model.log_stays[:1], model.variances)
    with pytest.raises(ModelError, match="variances"):
        FactorialHMM(model.means, model.log_stays, np.ones((2, 2)))
    with pytest.raises(InvalidValueError, match="sizes"):
        fit_factorial([np.zeros((9, 2))], ())


@given(st.integers(0, 10_000))
def test_one_chain_through_the_combinations_generates_the_same_motion(seed):
    rng = np.random.default_rng(seed)
    sizes = tuple(int(size) for size in rng.integers(1, 5, rng.integers(1, 4)))
    model = random_model(rng, sizes)
    motion, one = model.mean_motion(), model.left_right()
    changes = (np.diff(motion, axis=0) != 0).any(axis=1).sum()
    assert one.n_states == changes + 1
    assert np.allclose(one.means[0], motion[0]) and np.allclose(one.means[-1], motion[-1])
    starts = np.flatnonzero(np.append(True, (np.diff(motion, axis=0) != 0).any(axis=1)))
    assert np.allclose(one.durations_frames, np.maximum(np.diff(starts), 1.05))
    assert np.allclose(one.means, motion[starts])
    assert (one.variances == model.variances).all()

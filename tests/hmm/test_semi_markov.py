"""Explicit durations, against every segmentation written out."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import norm

from mplearn.errors import InvalidValueError, ModelError
from mplearn.hmm import SemiMarkovHMM, fit, fit_semi_markov


def random_model(rng, n_states=3, n_channels=2):
    return SemiMarkovHMM(
        rng.normal(0, 1, (n_states, n_channels)),
        rng.uniform(0.1, 1.0, (n_states, n_channels)),
        rng.uniform(1, 5, n_states),
        rng.uniform(0.7, 3, n_states),
    )


def emissions(model, frames, weights):
    each = norm.logpdf(frames[:, None], model.means, np.sqrt(model.variances))
    return weights[:, None] * np.nansum(each, axis=2)


def duration(model, n, d):
    """The normal density over whole frames from 1 on, summed to one."""
    whole = np.arange(1, 400)
    shares = norm.pdf(whole, model.durations_frames[n], model.spreads_frames[n])
    return np.log(shares[d - 1] / shares.sum())


def segmentations(model, frames, weights):
    """Log-joint of every way to cut T frames into N stretches, and its cuts."""
    table = emissions(model, frames, weights)
    n_frames, n_states = table.shape
    for inner in combinations(range(1, n_frames), n_states - 1):
        cuts = (0, *inner, n_frames)
        yield (
            cuts,
            sum(
                table[a:b, n].sum() + duration(model, n, b - a)
                for n, (a, b) in enumerate(pairwise(cuts))
            ),
        )


@pytest.mark.parametrize("seed", range(6))
def test_the_likelihood_is_the_sum_over_all_segmentations(seed):
    rng = np.random.default_rng(seed)
    model = random_model(rng)
    frames, weights = rng.normal(0, 1, (10, 2)), rng.uniform(0, 1.5, 10)
    frames[rng.random(frames.shape) < 0.15] = np.nan
    expected = logsumexp([score for _, score in segmentations(model, frames, weights)])
    assert model.score(frames, weights) == pytest.approx(expected, abs=1e-9)


def test_an_unfinished_motion_is_a_sum_over_all_that_may_follow():
    rng = np.random.default_rng(7)
    model = random_model(rng)
    frames = rng.normal(0, 1, (6, 2))
    going_on = []
    for more in range(60):  # frames that nobody has seen: missing throughout
        longer = np.vstack([frames, np.full((more, 2), np.nan)])
        going_on.append(model.score(longer))
    assert model.score(frames, complete=False) == pytest.approx(logsumexp(going_on), abs=1e-6)


def test_one_step_of_em_is_the_expectation_over_all_segmentations():
    rng = np.random.default_rng(3)
    sequences = [rng.normal(0, 1, (n, 2)) + np.linspace(0, 4, n)[:, None] for n in (9, 11)]
    floor = 1e-6
    start = fit_semi_markov(sequences, 3, n_steps=0, variance_floor=floor)
    stepped = fit_semi_markov(sequences, 3, n_steps=1, variance_floor=floor, duration_spread=0.0)
    occupied, first, second, lengths = np.zeros(3), np.zeros((3, 2)), np.zeros((3, 2)), []
    for frames in sequences:
        ways = list(segmentations(start, frames, np.ones(len(frames))))
        shares = np.exp(np.array([s for _, s in ways]) - logsumexp([s for _, s in ways]))
        lengths.append(sum(w * np.diff(cuts) for (cuts, _), w in zip(ways, shares, strict=True)))
        for (cuts, _), share in zip(ways, shares, strict=True):
            for n in range(3):
                inside = frames[cuts[n] : cuts[n + 1]]
                occupied[n] += share * len(inside)
                first[n] += share * inside.sum(axis=0)
                second[n] += share * (inside**2).sum(axis=0)
    means = first / occupied[:, None]
    np.testing.assert_allclose(stepped.means, means, atol=1e-9)
    np.testing.assert_allclose(stepped.variances, second / occupied[:, None] - means**2, atol=1e-9)
    np.testing.assert_allclose(stepped.durations_frames, np.mean(lengths, axis=0), atol=1e-9)


def timed(rng, lengths, noise=0.3):
    """Steps of given lengths, each at a posture of its own."""
    states = np.repeat(np.arange(len(lengths)), lengths)
    return 2.0 * states[:, None] + rng.normal(0, noise, (len(states), 2))


def test_em_never_lowers_the_likelihood_and_finds_the_durations():
    rng = np.random.default_rng(1)
    truth = np.array([12, 30, 8, 20])
    sequences = [timed(rng, truth + rng.integers(-2, 3, 4)) for _ in range(8)]
    values = []
    for n_steps in range(7):
        model = fit_semi_markov(
            sequences, 4, n_steps=n_steps, tolerance=-np.inf, duration_spread=0.0
        )
        values.append(sum(model.score(s) for s in sequences))
    assert np.all(np.diff(values) > -1e-3)  # normal moments are exact but for the edge at 1
    np.testing.assert_allclose(model.durations_frames, truth, atol=1.5)
    assert (model.spreads_frames < 3).all()


def test_timing_tells_motions_apart_that_a_chain_cannot():
    rng = np.random.default_rng(2)

    def quick_slow(n):
        return [
            timed(rng, np.array([10, 30]) + rng.integers(-2, 3, 2), noise=0.8) for _ in range(n)
        ]

    def slow_quick(n):
        return [
            timed(rng, np.array([30, 10]) + rng.integers(-2, 3, 2), noise=0.8) for _ in range(n)
        ]

    shares = []
    for make in (fit, fit_semi_markov):
        a, b = make(quick_slow(6), 2), make(slow_quick(6), 2)
        margins = [a.score(s) - b.score(s) for s in quick_slow(20)]
        margins += [b.score(s) - a.score(s) for s in slow_quick(20)]
        shares.append(np.mean(margins))
    assert shares[1] > shares[0] + 5


def test_what_it_generates_has_its_durations():
    rng = np.random.default_rng(4)
    model = SemiMarkovHMM(
        np.array([[0.0], [5.0], [1.0]]), np.full((3, 1), 1e-4), [10.0, 4.0, 7.0], [0.7, 1.0, 2.0]
    )
    assert len(model.mean_motion()) == 21
    np.testing.assert_array_equal(model.mean_motion()[9:14, 0], [0, 5, 5, 5, 5])
    samples = [model.sample(rng) for _ in range(400)]
    lengths = np.array([len(s) for s in samples])
    assert lengths.mean() == pytest.approx(21, abs=0.4)
    assert lengths.std() == pytest.approx(np.sqrt(0.49 + 1 + 4), rel=0.15)
    again = [model.sample(np.random.default_rng(4)) for _ in range(2)]
    np.testing.assert_array_equal(again[0], again[1])


def test_too_short_and_wrong_values_are_named():
    rng = np.random.default_rng(5)
    model = random_model(rng)
    assert model.score(np.zeros((2, 2))) == -np.inf
    with pytest.raises(ModelError, match="4 states"):
        fit_semi_markov([np.zeros((3, 2))], 4)
    with pytest.raises(InvalidValueError, match="duration_spread"):
        fit_semi_markov([np.zeros((9, 2))], 2, duration_spread=-1.0)
    with pytest.raises(ModelError, match="durations_frames"):
        SemiMarkovHMM(model.means, model.variances, np.zeros(3), np.ones(3))
    with pytest.raises(ModelError, match="spreads_frames"):
        SemiMarkovHMM(model.means, model.variances, np.ones(3), np.ones(2))

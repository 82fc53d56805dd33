"""The measure of the tree: eq. 5 by general models, its Monte-Carlo form, one's own."""

from dataclasses import replace

import numpy as np
import pytest

from mplearn.errors import InvalidValueError
from mplearn.hmm import LeftRightHMM, distance
from mplearn.recording import FloatArray, IntArray
from mplearn.tree import (
    Distance,
    Exemplar,
    PrimitiveTree,
    TreeConfig,
    make_distance,
    register_distance,
)
from mplearn.tree.exemplars import normalisation as forms
from mplearn.tree.exemplars.bank import ExemplarBank

D, N, SIGMA = 3, 9, 0.3
NAMES = ("likelihood", "monte_carlo")


def banked(config: TreeConfig, seed: int = 0) -> tuple[ExemplarBank, list[Exemplar]]:
    rng = np.random.default_rng(seed)
    bank = ExemplarBank(config, D, np.full(D, SIGMA**2))
    for number in range(N):
        phase = rng.uniform(0, 2 * np.pi, D)
        t = np.linspace(0, np.pi, config.normalisation.n_points)[:, None]
        bank.add(number, bank.model(np.sin(t + phase) + rng.normal(0, 0.05, (len(t), D))))
    return bank, [bank[number] for number in range(N)]


def general(exemplar: Exemplar) -> LeftRightHMM:
    return LeftRightHMM(exemplar.means, exemplar.variances, exemplar.log_stay)


def test_the_default_is_the_distance_of_general_models() -> None:
    config = TreeConfig()
    bank, exemplars = banked(config)
    weights = forms.weights(config.normalisation)
    for i in (0, 4):
        found = bank.distances(exemplars[i], range(N))
        for j in range(N):
            a, b = exemplars[i], exemplars[j]
            expected = distance(
                general(a), [a.columns.T], general(b), [b.columns.T], [weights], [weights]
            )
            assert found[j] ** 2 == pytest.approx(max(expected, 0.0), abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_symmetric_deterministic_and_zero_on_itself(name: str) -> None:
    config = TreeConfig(distance=name)
    bank, exemplars = banked(config)
    matrix = np.array([bank.distances(each, range(N)) for each in exemplars])
    again = np.array([bank.distances(each, range(N)) for each in exemplars])
    np.testing.assert_array_equal(matrix, again)
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.diag(matrix), 0.0, atol=1e-6)
    assert (matrix[~np.eye(N, dtype=bool)] > 0).all()


@pytest.mark.parametrize("name", NAMES)
def test_pairs_are_as_far_apart_as_one_by_one(name: str) -> None:
    config = TreeConfig(distance=name)
    bank, exemplars = banked(config)
    weights = forms.weights(config.normalisation)
    one = Exemplar(*map(np.stack, zip(*exemplars, strict=True)))
    other = Exemplar(*(part[::-1].copy() for part in one))
    found = bank.distance.pairwise(one, other, weights)
    for k in range(N):
        expected = bank.distance.divergence(exemplars[k], other, np.array([k]), weights)
        assert found[k] == expected[0]


def test_generated_sequences_say_what_training_sequences_say() -> None:
    """Of models whose segments were their own means, both forms measure the same differences."""
    bank, exemplars = banked(TreeConfig())
    drawn, _ = banked(TreeConfig(distance="monte_carlo"))
    apart = np.triu_indices(N, 1)
    one = np.array([bank.distances(each, range(N)) for each in exemplars])[apart]
    other = np.array([drawn.distances(each, range(N)) for each in exemplars])[apart]
    assert np.corrcoef(one, other)[0, 1] > 0.9
    assert np.median(other / one) == pytest.approx(1.0, abs=0.25)


def segments(rng: np.random.Generator, n: int) -> list[FloatArray]:
    t = np.linspace(0, np.pi, 40)[:, None]
    kinds = rng.uniform(0, 2 * np.pi, (3, D))
    return [np.sin(t + kinds[k % 3]) + rng.normal(0, 0.03, (40, D)) for k in range(n)]


class MeanOffset(Distance):
    """Mean squared difference of the points."""

    def divergence(
        self, exemplar: Exemplar, others: Exemplar, rows: IntArray, weights: FloatArray
    ) -> FloatArray:
        offsets = others.columns[rows] - exemplar.columns
        return np.asarray((offsets**2 * weights).sum(axis=(1, 2)) / weights.sum())


register_distance("mean offset", MeanOffset)


@pytest.mark.parametrize("name", [*NAMES, "mean offset"])
def test_a_tree_learns_and_recognises_by_it(name: str) -> None:
    tree = PrimitiveTree(TreeConfig(distance=name), D, 50.0)
    shown = segments(np.random.default_rng(1), 24)
    for frames in shown:
        tree.insert(frames)
    assert len(tree.leaves) == 3
    recogniser = tree.recogniser()
    homes = {k: {recogniser.recognise(f).primitive for f in shown[k::3]} for k in range(3)}
    assert sorted(map(len, homes.values())) == [1, 1, 1]
    assert len(set.union(*homes.values())) == 3
    twin = PrimitiveTree(TreeConfig(distance=name), D, 50.0)
    twin.load_state(tree.state())
    assert twin.insert(shown[0]) == tree.insert(shown[0])


@pytest.mark.parametrize("name", [*NAMES, "mean offset"])
@pytest.mark.parametrize("power", [0.5, 1.0])
def test_lengths_and_divergences_are_each_others_inverse(name: str, power: float) -> None:
    measure = make_distance(replace(TreeConfig(), distance=name, power=power))
    for length in (0.0, 0.3, 7.0):
        assert measure.length(measure.divergence_of(length)) == pytest.approx(length)
    assert measure.length(-1e-9) == 0


def test_names_are_known_and_taken_once() -> None:
    with pytest.raises(InvalidValueError, match=r"'far'; there are likelihood, monte_carlo"):
        PrimitiveTree(TreeConfig(distance="far"), D, 50.0)
    with pytest.raises(InvalidValueError, match="already"):
        register_distance("likelihood", MeanOffset)

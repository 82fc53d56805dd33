"""What the bank remembers of distances and models is what is measured and fitted anew."""

from dataclasses import replace

import numpy as np
import pytest

from mplearn.errors import ModelError
from mplearn.hmm import LeftRightHMM, distance, fit
from mplearn.tree import Exemplar, TreeConfig
from mplearn.tree.exemplars import normalisation
from mplearn.tree.exemplars.bank import ExemplarBank
from mplearn.tree.nodes.search import _group_means, mean_nearest

D = 5


def points(rng: np.random.Generator, config: TreeConfig) -> np.ndarray:
    at = np.linspace(0, np.pi, config.normalisation.n_points)[:, None]
    return np.sin(at + rng.uniform(0, 2 * np.pi, D)) + rng.normal(0, 0.05, (len(at), D))


def banked(rng: np.random.Generator, numbers: range) -> ExemplarBank:
    bank = ExemplarBank(TreeConfig(), D, np.full(D, 0.09))
    for number in numbers:
        bank.add(number, bank.model(points(rng, bank.config), rng.uniform(40, 160)))
    return bank


@pytest.mark.parametrize("n_missing", [0, 7])
def test_a_model_is_that_of_one_step_of_em(n_missing: int) -> None:
    rng = np.random.default_rng(n_missing)
    bank = ExemplarBank(TreeConfig(), D, np.linspace(0.01, 0.2, D))
    seen = points(rng, bank.config)
    seen.ravel()[rng.choice(seen.size, n_missing, replace=False)] = np.nan
    seen, weights = seen.astype(np.float32), normalisation.weights(bank.config.normalisation)
    exemplar = bank.model(seen, 90.0)
    model = fit(
        [seen], bank.config.n_states, weights=[weights], n_steps=1, variance_floor=bank.floor
    )
    for name in ("means", "variances", "log_stay", "log_next"):
        np.testing.assert_array_equal(getattr(exemplar, name), getattr(model, name))
    np.testing.assert_allclose(exemplar.log_norms, model.log_norms.sum(axis=1), rtol=1e-14)
    assert exemplar.own == pytest.approx(model.score(seen, weights), rel=1e-12)
    still = np.broadcast_to(
        normalisation.mean_posture(seen.astype(float), bank.config.normalisation), seen.shape
    )
    other = ExemplarBank(replace(bank.config, extent_share=np.inf), D, bank.floor)
    parts = other._modelled(still[None], np.array([90.0]))
    other.add(0, Exemplar(*(part[0] for part in parts)))
    np.testing.assert_array_equal(exemplar.extent, other.distances(exemplar, [0])[0])


@pytest.mark.parametrize("by_rows", [True, False])
def test_many_modelled_at_once_are_what_each_is_by_itself(by_rows: bool) -> None:
    rng = np.random.default_rng(11)
    bank = ExemplarBank(TreeConfig(), D, np.linspace(0.01, 0.2, D))
    form, n = bank.config.normalisation, 600  # more than a block of slots
    many = np.array([points(rng, bank.config) for _ in range(n)])
    many[::50, 3:5, 1] = np.nan
    if not by_rows:
        many = many.transpose(0, 2, 1).copy().transpose(0, 2, 1)
    lengths = rng.integers(20, 200, n).astype(float)
    for together, alone in zip(
        normalisation.centred(many, form),
        (normalisation.centred(x, form) for x in many),
        strict=True,
    ):
        np.testing.assert_array_equal(together, alone)
    bank.add_modelled(range(n), many, lengths)
    for number in range(n):
        alone = bank.model(many[number], lengths[number])
        for name in Exemplar._fields:
            np.testing.assert_array_equal(getattr(bank[number], name), getattr(alone, name))


def test_a_model_does_not_depend_on_how_points_lie_in_memory() -> None:
    bank = banked(np.random.default_rng(3), range(20))
    again = ExemplarBank.from_state(bank.config, bank.state(range(20)))
    for number in range(20):
        for name in Exemplar._fields:
            np.testing.assert_array_equal(
                getattr(again[number], name), getattr(bank[number], name), err_msg=name
            )


def test_what_cannot_be_modelled_leaves_a_bank_as_it_was() -> None:
    bank = ExemplarBank(TreeConfig(), D, np.full(D, 0.09))
    many = np.array([points(np.random.default_rng(k), bank.config) for k in range(3)])
    many[1, :, 2] = np.nan
    with pytest.raises(ModelError, match=r"channels \[2\]"):
        bank.add_modelled([0, 1, 2], many, np.full(3, 50.0))
    assert bank.numbers() == []


@pytest.mark.parametrize("width", [1, 3, 4, 9])
def test_distances_are_those_of_general_models_whatever_is_missing(width: int) -> None:
    rng = np.random.default_rng(width)
    config = TreeConfig()
    weights = normalisation.weights(config.normalisation)
    bank = ExemplarBank(config, width, np.linspace(0.01, 0.2, width))
    for number in range(6):
        seen = rng.normal(0, 0.5, (len(weights), width)).cumsum(axis=0)
        if number % 2 and width > 1:
            seen.ravel()[rng.choice(seen.size, seen.size // 4, replace=False)] = np.nan
        bank.add(number, bank.model(seen))
    matrix = np.stack([bank.distances(bank[n], range(6)) for n in range(6)])
    np.testing.assert_array_equal(matrix, matrix.T)
    assert (np.diag(matrix) == 0).all()  # a copy is no way off
    models = [
        LeftRightHMM(e.means, e.variances, e.log_stay) for e in map(bank.__getitem__, range(6))
    ]
    for i, j in [(0, 1), (1, 3), (2, 4), (5, 0)]:
        one, other = bank[i].columns.T, bank[j].columns.T
        expected = distance(models[i], [one], models[j], [other], [weights], [weights])
        assert matrix[i, j] ** 2 == pytest.approx(expected, rel=1e-10)


def test_a_model_of_what_was_never_seen_is_refused() -> None:
    bank = ExemplarBank(TreeConfig(), D, np.full(D, 0.09))
    seen = points(np.random.default_rng(0), bank.config)
    seen[:, 2] = np.nan
    with pytest.raises(ModelError, match=r"channels \[2\] were never measured"):
        bank.model(seen)


@pytest.mark.parametrize("without_tempo", [False, True])
def test_what_is_known_of_leaves_is_what_is_measured(without_tempo: bool) -> None:
    """Whatever was asked before, who came and went since, and where all models are made anew."""
    rng = np.random.default_rng(5)
    bank = banked(rng, range(8))
    for step in range(20):
        if step == 12:
            wider = ExemplarBank(bank.config, D, 3.0 * bank.floor)
            for number in bank.numbers():
                old = bank[number]
                wider.add(number, wider.model(old.columns.T, float(old.duration)))
            bank.take_over(wider)
        bank.add(8 + step, bank.model(points(rng, bank.config), rng.uniform(40, 160)))
        bank.drop(int(rng.choice(bank.numbers())))
        one, other = (rng.permutation(bank.numbers())[:n].tolist() for n in (5, 4))
        measured = [
            bank.distances(bank[number], other, without_tempo=without_tempo) for number in one
        ]
        found = bank.across(one, other, without_tempo=without_tempo)
        np.testing.assert_array_equal(found, np.stack(measured))


def test_what_is_known_of_the_latest_is_what_is_measured() -> None:
    """Exemplars come and go, in any order, and slots are taken again."""
    rng = np.random.default_rng(3)
    bank, next_number = banked(rng, range(6)), 6
    for _ in range(60):
        step, numbers = rng.integers(4), bank.numbers()
        if step == 0 or len(numbers) < 4:
            bank.add(next_number, bank.model(points(rng, bank.config), rng.uniform(40, 160)))
            next_number += 1
        elif step == 1:
            bank.drop(int(rng.choice(numbers)))
        elif step == 2:
            bank = bank.fork()
        else:
            bank.take_over(banked(rng, range(next_number - 3, next_number)))
        numbers = bank.numbers()
        asked = [int(n) for n in rng.permutation(numbers)[:5]]
        for without_tempo in (False, True):
            for number in (numbers[-1], numbers[0]):
                apart = Exemplar(*(part.copy() for part in bank[number]))
                np.testing.assert_array_equal(
                    bank.distances(bank[number], asked, without_tempo=without_tempo),
                    bank.distances(apart, asked, without_tempo=without_tempo),
                )


def test_tempo_is_taken_out_of_distances() -> None:
    bank = banked(np.random.default_rng(1), range(12))
    numbers = [4, 2, 9, 0, 11, 7]
    matrix = bank.matrix(numbers)
    before = matrix.copy()
    found = bank.without_tempo(numbers, matrix)
    np.testing.assert_array_equal(found, bank.matrix(numbers, without_tempo=True))
    np.testing.assert_array_equal(matrix, before)
    assert (found < matrix).any()


@pytest.mark.parametrize("n_nearest", [1, 2, 1000])
def test_means_of_groups_are_those_of_each(n_nearest: int) -> None:
    rng = np.random.default_rng(n_nearest)
    sizes = rng.integers(1, 13, 7)
    distances = rng.random(sizes.sum())
    expected = [mean_nearest(each, n_nearest) for each in np.split(distances, sizes.cumsum()[:-1])]
    np.testing.assert_allclose(_group_means(distances, sizes, n_nearest), expected, rtol=1e-14)

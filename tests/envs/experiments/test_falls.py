"""What makes the robot fall: fitted against known hazards, and how well it is foretold."""

import numpy as np
import pytest
from standing_library import standing_library

from mplearn.errors import InvalidValueError
from mplearn_envs.execution.risk import FallRisk, fitted
from mplearn_envs.experiments.__main__ import main
from mplearn_envs.experiments.falls import Trials, _fitted, chances, fit, fit_spread, foretold
from mplearn_envs.experiments.soak import SoakedEpisode, made, read_soak, soak, soaked, table_of

WEIGHTS = np.array([-3.0, 1.5, 0.0, 4.0, 0.7])


def trials(n, seed=0, weights=WEIGHTS):
    """Falls as a known hazard makes them."""
    rng = np.random.default_rng(seed)
    kind = rng.integers(0, 40, n)
    of_kind = np.column_stack([np.ones(40), rng.random((40, 4)) * (1.0, 0.2, 0.2, 1.0)])
    strain = of_kind[kind] + np.column_stack([np.zeros(n), 0.02 * rng.random((n, 4))])
    time_s = rng.uniform(1.0, 5.0, n)
    chance = 1.0 - np.exp(-time_s * np.exp(strain @ weights))
    return Trials(strain, time_s, rng.random(n) < chance, kind), chance


def test_a_known_hazard_is_found_again():
    seen, chance = trials(40_000)
    weights = fit(seen)
    assert weights[[0, 1, 4]] == pytest.approx(WEIGHTS[[0, 1, 4]], abs=0.15)
    assert np.abs(chances(weights, seen) - chance).max() < 0.1
    gentle = FallRisk(tuple(weights)).probability(seen.strain[0], float(seen.time_s[0]))
    assert gentle == pytest.approx(chances(weights, seen)[0])


def test_how_much_bodies_differ_is_found_again():
    """Walks of up to 30 steps that end with a fall, each body with a factor of its own."""
    rng, rows = np.random.default_rng(5), []
    risk = FallRisk(tuple(WEIGHTS), spread=0.8)
    for walk in range(1500):
        seen, _ = trials(30, seed=walk + 100)
        own = chances(np.array(risk.of_body(walk).weights), seen)
        fallen = rng.random(30) < own
        n = int(fallen.argmax()) + 1 if fallen.any() else 30
        alive = Trials(seen.strain, seen.time_s, fallen, seen.kind, np.full(30, walk))
        rows.append(alive.part(np.arange(30) < n))
    walks = Trials(*(np.concatenate(parts) for parts in zip(*rows, strict=True)))
    spread = fit_spread(walks)
    assert spread == pytest.approx(0.8, abs=0.2)
    assert fit(walks, spread)[0] == pytest.approx(WEIGHTS[0], abs=0.25)
    assert fit(walks)[0] < fit(walks, spread)[0] - 0.3  # who still walks is robust
    assert _fitted(walks, spread)[1] < _fitted(walks, 0.0)[1] - 20.0
    alike, _ = trials(4000)
    assert fit_spread(alike._replace(episode=np.arange(4000) // 3)) < 0.3


def test_falls_of_primitives_never_seen_are_foretold_as_well_as_can_be():
    seen, chance = trials(8000, seed=3)
    well = foretold(seen)
    best = float(np.mean((chance - seen.fallen) ** 2))
    assert best <= well.brier < well.brier_same and well.brier < 1.02 * best
    assert well.auc > well.auc_same and well.slope == pytest.approx(1.0, abs=0.15)
    same, _ = trials(8000, seed=4, weights=np.array([-3.0, 0, 0, 0, 0]))
    assert foretold(same).brier == pytest.approx(foretold(same).brier_same, rel=0.01)


def test_more_strain_is_never_said_to_help():
    weights = WEIGHTS.copy()
    weights[3] = -6.0
    assert fit(trials(8000, weights=weights)[0])[3] == 0.0
    none = trials(500)[0]._replace(fallen=np.zeros(500, np.bool_))
    assert 0.0 < chances(fit(none), none).max() < 5e-3
    with pytest.raises(InvalidValueError, match="where there are some"):
        foretold(none)


def test_the_weights_that_are_shipped_are_of_the_levels():
    assert {"randomised", "harsh"} <= set(fitted())
    risk = fitted()
    assert all(len(each.weights) == 5 and min(each.weights[1:]) >= 0.0 for each in risk.values())
    at_rest = np.array([1.0, 0, 0, 0, 0])
    on_one_foot = np.array([1.0, 1, 0, 0.03, 0.2])
    for strain in (at_rest, on_one_foot):
        assert risk["randomised"].probability(strain, 3.0) < risk["harsh"].probability(strain, 3.0)
    assert risk["harsh"].probability(at_rest, 3.0) < risk["harsh"].probability(on_one_foot, 3.0)


def test_a_soak_goes_on_where_it_was_interrupted(tmp_path, monkeypatch, capsys):
    from mplearn_envs.experiments import soak as module

    monkeypatch.setattr(module, "LONGEST", 6)
    library, file = standing_library(), tmp_path / "new" / "soak.jsonl"
    whole = list(soak(18, ("nominal",), 5, library=library, speeds=(1.0, 0.7)))
    assert [len(each.steps) for each in whole] == [6, 6, 6]
    assert {step.speed for each in whole for step in each.steps} == {1.0, 0.7}
    first = next(iter(soak(18, ("nominal",), 5, file, library=library, speeds=(1.0, 0.7))))
    assert first == whole[0] and file.read_text() == first.line() + "\n"
    file.write_text(first.line() + "\n" + whole[1].line()[:40])  # cut off
    monkeypatch.setattr(module, "soaked", _counting(calls := []))
    again = list(soak(18, ("nominal",), 5, file, library=library, speeds=(1.0, 0.7)))
    assert again == whole == read_soak(file) and calls == [1, 2]
    (row,) = table_of(whole).rows
    assert row[:2] == ("nominal", "18") and row[4] == row[7] == "0"
    file.write_text("[1]\n")
    with pytest.raises(InvalidValueError, match="no episode of a soak"):
        read_soak(file)
    with pytest.raises(InvalidValueError, match="levels must be among"):
        list(soak(1, ("mild",)))


def _counting(calls):
    def counted(env, level, episode, seed):
        calls.append(episode)
        return soaked(env, level, episode, seed)

    return counted


def test_a_fall_is_counted(tmp_path, capsys):
    env = made("harsh", library=standing_library())
    fallen = SoakedEpisode("harsh", 0, soaked(env, "harsh", 0, 1).steps[:1])
    step = fallen.steps[0]._replace(fallen=True, name="kick")
    file = tmp_path / "falls.jsonl"
    episodes = [fallen, fallen._replace(episode=1, steps=(step,))]
    file.write_text("".join(each.line() + "\n" for each in episodes))
    (row,) = table_of(episodes).rows
    assert row[:2] == ("harsh", "2") and row[4] == "1" and row[-1] == "kick 1"
    assert main(["falls", str(file)]) == 0
    assert "| harsh | 2 | 1 |" in capsys.readouterr().out

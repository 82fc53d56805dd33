import re

import numpy as np
import pytest
from data_folder import DATA, needs_data

from mplearn.demonstrator import demonstrate, markov_script
from mplearn.errors import InvalidValueError
from mplearn.evaluation import Table
from mplearn.evaluation.experiments import boundary_table, learn_session, learning_table
from mplearn.evaluation.table import percent
from mplearn.mocap import open_recordings


def test_a_table_is_markdown() -> None:
    table = Table("T", ("a", "b"), (("1", "x|y"),), "Read it so.")
    assert (
        table.to_markdown() == "### T\n\n| a | b |\n| --- | --- |\n| 1 | x\\|y |\n\nRead it so.\n"
    )
    with pytest.raises(InvalidValueError, match="2 columns, a row has 1"):
        Table("T", ("a", "b"), (("1",),))


def test_percent() -> None:
    assert percent(0.0354) == "3.5 %"
    assert percent(float("nan")) == "-"


def test_a_session_is_learned_and_rated_beside_the_paper() -> None:
    shown = demonstrate(markov_script(60, np.random.default_rng(2)), seed=2)
    outcome = learn_session(shown.recording, shown.truth)
    assert outcome.boundaries.f1 > 0.95
    assert outcome.rates.n_motions == len(shown.truth)
    assert outcome.rates.false_positive <= 0.05
    assert outcome.rates.n_inside >= outcome.rates.n_recognised > 0
    table = learning_table("Twice", [("one", outcome), ("again", outcome)])
    assert [row[0] for row in table.rows] == ["paper, one person", "one", "again", "mean"]
    assert table.rows[0][1] == "17 of 22"
    assert table.rows[1][1:8] == table.rows[2][1:8]


@needs_data
def test_boundaries_of_real_takes() -> None:
    assert DATA is not None
    takes = [t for t in open_recordings(DATA / "ui_prmd") if t.name in ("m01_s02", "m07_s02")]
    table = boundary_table(takes)
    rows = {row[:2]: row for row in table.rows}
    for name in ("kohlmorgen-lemm", "zero-velocity"):
        row = rows[name, "all"]
        assert row[2:] == rows[name, "s02"][2:]
        joins = float(re.sub(" %", "", row[2]))
        assert joins > 80.0

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import mannwhitneyu

from mplearn.demonstrator import demonstrate
from mplearn.evaluation import observe
from mplearn.evaluation.experiments.anomaly import found_motions
from mplearn.evaluation.experiments.judged import Judged, anomaly_table
from mplearn.evaluation.experiments.prediction import foretell, prediction_table
from mplearn.library import AnomalyScore

scores = st.lists(st.integers(0, 5), min_size=1, max_size=20)


def scored(values):
    return tuple(AnomalyScore(float(v), 1 / (1 + v)) for v in values)


@given(scores, scores)
def test_the_area_is_that_of_the_rank_sum(right, wrong):
    judged = Judged(scored(right), scored(wrong))
    u = mannwhitneyu(wrong, right).statistic
    assert judged.auc == pytest.approx(u / (len(right) * len(wrong)))


def test_a_table_of_planted_anomalies():
    judged = Judged(scored([0, 0, 1, 30]), scored([9, 40]))
    table = anomaly_table([("one", {"odd": judged}), ("two", {"odd": Judged((), ())})])
    assert table.rows[0] == ("one", "odd", "4 / 2", "0.875", "25.0 %", "50.0 %")
    assert table.rows[-1][:4] == ("mean", "odd", "4 / 2", "0.875")
    assert math.isnan(Judged((), ()).auc)


def test_motions_are_foretold_once_they_have_been_seen():
    session = demonstrate(["BAR", "BAL", "BAD", "BAU"] * 9, seed=3)
    features = observe(session.recording)
    motions = found_motions(features, session.truth)
    assert np.mean([motion.label != "" for motion in motions]) > 0.9
    foretold = foretell(features, session.truth)
    assert foretold.perfect.shape == foretold.learned.shape == foretold.primitives.shape == (35, 3)
    assert foretold.shown[:5].tolist() == [0, 0, 0, 1, 1]
    assert foretold.perfect[4:, 0].all()  # a cycle: from the second round on all is known
    assert not foretold.learned[:3, 0].any()
    assert not foretold.primitives[:6, 0].any()  # two rounds make primitives
    assert foretold.learned[4:, 0].mean() >= 0.9
    assert foretold.primitives[-8:, 0].mean() >= 0.75
    assert (foretold.learned[-8:, 2] < 0.5).mean() >= 0.75
    assert foretold.at_most == pytest.approx(28 / 31)
    assert len(prediction_table("told", [("one", foretold)] * 2).rows) == 3

"""Agreement of partitions against scikit-learn and by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn.evaluation.partitions import agreement


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 4)), min_size=2, max_size=60))
@settings(max_examples=60, deadline=None)
def test_indices_are_those_of_scikit_learn(pairs):
    metrics = pytest.importorskip("sklearn.metrics")
    truth, found = (np.array(each) for each in zip(*pairs, strict=True))
    result = agreement(truth, found)
    assert result.ari == pytest.approx(metrics.adjusted_rand_score(truth, found), abs=1e-12)
    expected = metrics.normalized_mutual_info_score(truth, found)
    assert result.nmi == pytest.approx(expected, abs=1e-9)


def test_names_do_not_matter_and_equal_partitions_agree():
    truth = np.array(["walk"] * 40 + ["jump"] * 30 + ["walk"] * 30)
    found = np.array([7] * 40 + [2] * 30 + [7] * 30)
    result = agreement(truth, found)
    assert (result.ari, result.nmi, result.covering, result.change_f1) == (1, 1, 1, 1)
    assert (result.n_true, result.n_found) == (2, 2)


def test_covering_and_change_points_by_hand():
    truth = np.repeat([0, 1], [60, 40])
    found = np.repeat([0, 1, 2], [61, 9, 30])
    result = agreement(truth, found)
    assert result.covering == pytest.approx(0.6 * 60 / 61 + 0.4 * 30 / 40)
    assert result.change_f1 == pytest.approx(2 / 3)  # 60 and 61 match within 1 %, 70 does not
    assert agreement(truth, np.roll(found, 2)).change_f1 < 1


def test_partitions_of_other_lengths_are_named():
    with pytest.raises(InvalidValueError, match="3 and 2"):
        agreement(np.zeros(3), np.zeros(2))

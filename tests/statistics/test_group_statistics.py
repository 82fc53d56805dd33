"""Measures against counting by hand, tests against other libraries and brute force."""

import math
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from mplearn.errors import InvalidValueError
from mplearn.evaluation.experiments.group_tests import alarms, made_up_study
from mplearn.statistics import (
    MEASURES,
    Measure,
    Transitions,
    compare,
    compare_transitions,
    durations,
    quality,
    repetitions,
    spread,
    tempo,
    transitions,
    variability,
)
from mplearn.statistics.plots import plot_measure, plot_quality, plot_transitions
from mplearn.tables import RecognisedSegment, SegmentTable


def row(take, start_s, end_s, name="bow", person="anna", distance=0.1) -> RecognisedSegment:
    primitive = 1 if name else None
    return RecognisedSegment(take, start_s, end_s, primitive, name, "bow", distance, 0.5, person)


TABLE = SegmentTable(
    [
        row("t1", 0.0, 1.0, distance=0.2),
        row("t1", 1.5, 2.0, "lift"),
        row("t1", 2.0, 4.0, distance=0.4),
        row("t2", 0.0, 1.5, distance=0.3),
        row("t2", 1.5, 2.0, ""),
        row("t2", 2.0, 2.5, "lift"),
        row("t3", 0.0, 1.0, "lift", "ben"),
        row("t3", 9.0, 9.5, "lift", "ben"),
    ]
)


def test_primitives_come_in_the_order_in_which_people_count() -> None:
    order = ["P", "P1", "P01x", "P2", "P10", "P10 a", "P10 b", "P٣", "b2", "b10", "²"]
    table = SegmentTable([row("t", 0.0, 1.0, name) for name in reversed(order)])
    assert list(durations(table).primitives) == list(transitions(table).primitives) == order


def test_measures_and_comparisons_go_into_tables_as_they_are() -> None:
    took = durations(TABLE)
    frame = took.to_pandas()
    assert frame.index.tolist() == ["anna", "ben"]
    assert frame.columns.tolist() == ["bow", "lift"]
    assert np.array_equal(frame.to_numpy(), took.values, equal_nan=True)
    assert frame.loc["anna", "bow"] == pytest.approx((1.0 + 2.0 + 1.5) / 3)
    steps = transitions(TABLE)
    rows = steps.to_pandas().to_dict("records")
    assert rows == [
        {"unit": "anna", "before": "bow", "after": "lift", "times": 1},
        {"unit": "anna", "before": "lift", "after": "bow", "times": 1},
    ]
    people = tuple("abcdef")
    groups = {who: "old" if who < "d" else "young" for who in people}
    values = np.arange(12.0).reshape(6, 2) ** 2
    found = compare(Measure("tempo", people, ("bow", "lift"), values), groups)
    frame = found.to_pandas()
    assert frame.index.tolist() == ["bow", "lift"]
    assert frame["mean of young"].tolist() == values[3:].mean(axis=0).tolist()
    assert frame["adjusted"].tolist() == found.adjusted.tolist()
    assert repr(found) == f"Comparison(tempo, 3 'old' with 3 'young': p = {found.p_value:.3g})"
    assert repr(took) == "Measure('duration [s]', 2 units, 2 primitives)"
    assert repr(steps) == "Transitions(2 of 2 primitives, 2 units)"


def test_measures_are_what_one_counts() -> None:
    assert repetitions(TABLE).of("anna", "bow") == 3
    assert repetitions(TABLE).of("ben", "bow") == 0
    assert durations(TABLE).of("anna", "bow") == pytest.approx(1.5)
    assert math.isnan(durations(TABLE).of("ben", "bow"))
    assert tempo(TABLE).of("anna", "bow") == pytest.approx(30.0)  # 2 s apart
    assert tempo(TABLE).of("ben", "lift") == pytest.approx(60 / 9)
    assert variability(TABLE).of("anna", "bow") == pytest.approx(
        stats.variation([1, 2, 1.5], ddof=1)
    )
    assert spread(TABLE).of("anna", "bow") == pytest.approx(0.3)
    assert repetitions(TABLE, "take").units == ("t1", "t2", "t3")


def test_transitions_are_broken_by_pauses_takes_and_the_unknown() -> None:
    counted = transitions(TABLE)
    assert counted.primitives == ("bow", "lift")
    assert counted.counts[0].tolist() == [[0, 1], [1, 0]]
    assert counted.counts[1].tolist() == [[0, 0], [0, 0]]
    assert transitions(TABLE, longest_pause_s=10).counts[1].tolist() == [[0, 0], [0, 1]]
    assert counted.matrix("anna").tolist() == [[0, 1], [1, 0]]


def test_who_is_unnamed_is_no_unit() -> None:
    nobody = SegmentTable([row("t", 0, 1, person="")])
    with pytest.raises(InvalidValueError, match="unit='take'"):
        repetitions(nobody)
    assert repetitions(nobody, "take").units == ("t",)
    with pytest.raises(InvalidValueError, match="'person' or 'take'"):
        repetitions(TABLE, "day")


VALUES = st.lists(st.floats(-5, 5).map(lambda x: round(x, 2)), min_size=7, max_size=7)


@settings(deadline=None)
@given(VALUES, st.integers(2, 5))
def test_all_exchanges_are_tried_where_they_are_few(values: list[float], size: int) -> None:
    units = tuple("abcdefg")
    groups = {unit: "x" if k < size else "y" for k, unit in enumerate(units)}
    found = compare(Measure("m", units, ("p",), np.array(values)[:, None]), groups)
    x = np.array(values)
    if np.ptp(x) < 1e-6:
        assert math.isnan(found.p_values[0]) and found.p_value == 1.0
        return

    def far(chosen) -> float:
        inside = np.isin(np.arange(7), chosen)
        return abs(x[inside].mean() - x[~inside].mean()) ** 2

    everything = [far(chosen) for chosen in combinations(range(7), size)]
    expected = np.mean([each >= far(range(size)) - 1e-9 for each in everything])
    assert found.p_values[0] == pytest.approx(expected)
    assert found.p_value == found.adjusted[0] == pytest.approx(expected)


def test_the_statistic_is_that_of_an_analysis_of_variance() -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(size=(15, 2))
    values[3, 1] = np.nan
    units = tuple(f"u{k}" for k in range(15))
    groups = {unit: "abc"[k % 3] for k, unit in enumerate(units)}
    found = compare(Measure("m", units, ("p", "q"), values), groups, permutations=1999)
    for k in range(2):
        parts = [values[g::3, k][np.isfinite(values[g::3, k])] for g in range(3)]
        f, p = stats.f_oneway(*parts)
        assert found.statistics[k] == pytest.approx(f)
        assert found.p_values[k] == pytest.approx(p, abs=0.05)
        assert found.means[:, k] == pytest.approx([part.mean() for part in parts])
    assert found.sizes == (5, 5, 5)
    assert np.all(found.adjusted >= found.p_values - 1e-9)


def test_the_statistic_of_transitions_is_a_likelihood_ratio() -> None:
    counts = np.random.default_rng(1).integers(1, 9, (6, 3, 3)).astype(float)
    units = tuple("abcdef")
    groups = dict(zip(units, "xxxyyy", strict=True))
    found = compare_transitions(Transitions(units, ("p", "q", "r"), counts), groups)
    shares = counts / counts.sum(axis=2, keepdims=True)
    for k in range(3):
        table = np.array([shares[:3, k].sum(axis=0), shares[3:, k].sum(axis=0)])
        g = stats.chi2_contingency(table, correction=False, lambda_="log-likelihood").statistic
        assert 2 * found.statistics[k] == pytest.approx(g)
    assert found.permutations == 19


def test_exchanges_are_of_whole_people() -> None:
    """Two people a group say nothing, however many executions they show."""
    rows = [
        row(who, 2.0 * k, 2.0 * k + length, person=who)
        for who, length in (("a", 1.0), ("b", 1.01), ("c", 1.5), ("d", 1.51))
        for k in range(200)
    ]
    groups = {"a": "x", "b": "x", "c": "y", "d": "y"}
    assert compare(durations(SegmentTable(rows)), groups).p_value == pytest.approx(1 / 3)


def test_tests_are_calibrated_and_find_what_is_there() -> None:
    found = alarms(80, seed=7)
    for name, share in found.items():  # the chance that a calibrated test is beyond is 1 in 2,000
        assert stats.binomtest(round(80 * share), 80, 0.05, "greater").pvalue > 5e-4, name
    assert sum(found.values()) / len(found) > 0.01
    assert alarms(20, effect=4.0)["durations"] > 0.9


def test_groups_that_cannot_be_compared_are_refused() -> None:
    table, groups = made_up_study(np.random.default_rng(0))
    measure = durations(table)
    with pytest.raises(InvalidValueError, match="no units"):
        compare(measure, {**groups, "nobody": "first"})
    with pytest.raises(InvalidValueError, match="two groups"):
        compare(measure, dict.fromkeys(groups, "one"))
    with pytest.raises(InvalidValueError, match="permutations"):
        compare(measure, groups, permutations=0)
    with pytest.raises(InvalidValueError, match="two groups"):
        compare_transitions(transitions(table), {"p00": "a", "p11": "b"})


def test_quality_is_even_for_what_is_like_the_reference() -> None:
    rng = np.random.default_rng(3)
    reference = SegmentTable(
        [row("r", k, k + 1, distance=d) for k, d in enumerate(rng.gamma(3, size=400))]
    )
    same = SegmentTable(
        [row("s", k, k + 1, distance=d) for k, d in enumerate(rng.gamma(3, size=400))]
    )
    shares = quality(same, reference)
    assert stats.kstest(shares, "uniform").pvalue > 0.001
    worse = SegmentTable([row("w", 0, 1, distance=50.0)])
    assert quality(worse, reference)[0] == pytest.approx(1 / 401)
    assert np.isnan(quality(same, SegmentTable())).all()


def test_each_has_its_plot() -> None:
    table, groups = made_up_study(np.random.default_rng(0))
    for measure in MEASURES.values():
        figure = plot_measure(measure(table), groups)
        assert len(figure.axes) == 1
        assert figure.axes[0].get_ylabel() == measure(table).name
    assert len(plot_transitions(transitions(table), groups).axes) == 3  # two matrices, one scale
    reference = SegmentTable(table[:200])
    assert plot_quality({"all": quality(table, reference)}).axes


@pytest.mark.parametrize("n", [3, 90])
def test_plots_are_legible_whatever_primitives_are_called_and_however_many(
    n: int, tmp_path: Path
) -> None:
    rng, units = np.random.default_rng(0), ("anna", "ben", "cleo")
    names = ("$\\frac{", "a" * 80, *(f"P{k}" for k in range(n - 2)))
    groups = {"anna": "usual", "ben": "usual", "cleo": "$slow_{"}
    values = rng.uniform(1.0, 2.0, (3, n))
    values[:, 1] = np.nan
    figure = plot_measure(Measure("duration [s]", units, names, values), groups)
    figure.savefig(tmp_path / "measure.png", dpi=40)
    width, height = figure.get_size_inches()
    assert width <= 17.0 and height <= 40.0
    shown = [text.get_text() for axes in figure.axes for text in axes.get_xticklabels()]
    assert shown == ["$\\frac{", "a" * 21 + "…", *names[2:]]
    assert len({axes.get_ylim() for axes in figure.axes}) == 1  # comparable
    dots = [line.get_ydata() for axes in figure.axes for line in axes.lines]
    found = np.sort(np.concatenate([np.asarray(each, float) for each in dots]))
    np.testing.assert_array_equal(found, np.sort(values[np.isfinite(values)]))

    counts = rng.integers(0, 3, (3, n, n)) + np.eye(n)
    figure = plot_transitions(Transitions(units, names, counts), groups)
    figure.savefig(tmp_path / "transitions.png", dpi=40)
    for axes, chosen in zip(figure.axes, ([2], [0, 1]), strict=False):
        size = axes.get_window_extent().transformed(figure.dpi_scale_trans.inverted())
        label = axes.get_yticklabels()[0]
        assert label.get_fontsize() / 72.0 < size.height / n  # none covers the next
        drawn = axes.images[0].get_array()
        share = counts[chosen].sum(axis=0)
        share /= share.sum(axis=1, keepdims=True)
        np.testing.assert_allclose(np.ma.filled(drawn, 0.0), share)
    assert label.get_fontsize() > 5.0

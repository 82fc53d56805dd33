"""The protocols on a session of four motions, and activities on one that repeats two."""

from itertools import cycle, islice

import numpy as np
import pytest

from mplearn.demonstrator import demonstrate
from mplearn.evaluation.experiments.activities import activities_in
from mplearn.evaluation.experiments.presentations import (
    all_at_once,
    first_presentation,
    halves,
    learn,
    presentation_table,
    second_presentation,
)
from mplearn.evaluation.experiments.seen import Seen
from mplearn.evaluation.ownership import frame_labels
from mplearn.evaluation.partitions import agreement
from mplearn.tree import TreeConfig


@pytest.fixture(scope="module")
def seen():
    script = [*islice(cycle(("BAR", "BAL", "BAD", "BAU")), 40)]
    demonstration = demonstrate(script, seed=8)
    return Seen.of(demonstration.recording, demonstration.truth)


def test_a_part_and_twice_keep_the_truth_with_the_segments(seen):
    middle = len(seen.segments) // 2
    first, second = seen.part(0, middle), seen.part(middle, len(seen.segments))
    assert first.truth + second.truth == seen.truth
    assert first.labels + second.labels == seen.labels
    twice = seen.twice()
    assert twice.labels == seen.labels * 2
    assert len(twice.frames) == 2 * len(seen.frames)


def test_the_protocols_agree_where_all_is_easy(seen):
    config = TreeConfig()
    first, second = first_presentation(seen, config), second_presentation(seen, config)
    assert first.extracted == second.extracted == first.n_classes == 4
    assert second.false_negative <= first.false_negative + 0.05
    assert second.inside >= first.inside
    assert halves(seen, config).false_positive == 0
    bound = all_at_once(seen, config)
    assert bound.extracted == 4 and bound.false_positive == 0
    assert bound.inside >= first.inside
    rates = learn(seen, config)[1]
    assert first.inside == rates.coverage


def test_the_table_has_the_paper_beside_it(seen):
    table = presentation_table([("four", seen)])
    assert len(table.rows) == 3 + 4
    assert table.rows[0][:2] == ("paper", "first presentation")
    assert table.rows[3][3] == "4.0 of 4.0"


def test_activities_are_what_recurs_together():
    script = ["BAR", "BAL"] * 5 + ["BAD", "BAU"] * 5 + ["BAR", "BAL"] * 4
    demonstration = demonstrate(script, seed=3)
    labels = demonstration.truth
    names = frame_labels(labels, len(demonstration.recording))
    kind = np.where(np.isin(names, ["BAR", "BAL"]), "arms", "bow")
    kind[names == ""] = ""
    found = activities_in(demonstration.recording)
    known = kind != ""
    result = agreement(kind[known], found[known])
    assert result.nmi > 0.7 and result.n_found == 2
